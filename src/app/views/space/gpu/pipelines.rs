//! How each kind of thing is drawn: made once for a window.

use std::sync::{Arc, Mutex, PoisonError};

use eframe::wgpu;

use super::{Line, Spot, guarded};

/// Samples in a pixel: lines have smooth edges.
pub(super) const SAMPLES: u32 = 4;
/// Format of the picture. Values are written as egui encodes them.
pub(super) const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The pipelines of a device, unless it refused them.
pub(super) struct Pipelines {
    made: Result<Made, String>,
    lost: Arc<Mutex<Option<String>>>,
}

pub(super) struct Made {
    pub(super) points: wgpu::RenderPipeline,
    pub(super) lines: wgpu::RenderPipeline,
    pub(super) faces: wgpu::RenderPipeline,
    pub(super) blit: wgpu::RenderPipeline,
    pub(super) view_layout: wgpu::BindGroupLayout,
    pub(super) blit_layout: wgpu::BindGroupLayout,
}

impl Pipelines {
    /// Pipelines for a device whose window has this format.
    pub(super) fn new(device: &wgpu::Device, target: wgpu::TextureFormat) -> Self {
        let lost: Arc<Mutex<Option<String>>> = Arc::default();
        let told = Arc::clone(&lost);
        device.set_device_lost_callback(move |_, why| {
            let why = format!("the graphics card was lost {}", super::one_line(&why));
            *told.lock().unwrap_or_else(PoisonError::into_inner) = Some(why.trim().to_owned());
        });
        Self {
            made: guarded(device, || Made::new(device, target)),
            lost,
        }
    }

    pub(super) fn made(&self) -> Option<&Made> {
        self.made.as_ref().ok()
    }

    /// Why nothing can be drawn, if so.
    pub(super) fn trouble(&self) -> Option<String> {
        let lost = self.lost.lock().unwrap_or_else(PoisonError::into_inner);
        lost.clone().or_else(|| self.made.as_ref().err().cloned())
    }
}

impl Made {
    fn new(device: &wgpu::Device, target: wgpu::TextureFormat) -> Self {
        let scene = device.create_shader_module(wgpu::include_wgsl!("../scene.wgsl"));
        let blit = device.create_shader_module(wgpu::include_wgsl!("../blit.wgsl"));
        let view_layout = layout(
            device,
            wgpu::ShaderStages::VERTEX,
            wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
        );
        let blit_layout = layout(
            device,
            wgpu::ShaderStages::FRAGMENT,
            wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: false },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
        );
        let spot = wgpu::vertex_attr_array![0 => Float32x3, 1 => Unorm8x4];
        let line = wgpu::vertex_attr_array![
            0 => Float32x3, 1 => Float32x3, 2 => Unorm8x4, 3 => Float32
        ];
        let instance = wgpu::VertexStepMode::Instance;
        let strip = wgpu::PrimitiveTopology::TriangleStrip;
        let part = |name, topology, buffer| {
            let drawn = Drawn {
                layout: &view_layout,
                vertex: (&scene, name),
                fragment: (&scene, "paint"),
                buffer: Some(buffer),
                topology,
                format: COLOR,
                has_depth: true,
            };
            drawn.pipeline(device)
        };
        Self {
            points: part("point", strip, buffer(Spot::BYTES, instance, &spot)),
            lines: part("line", strip, buffer(Line::BYTES, instance, &line)),
            faces: part(
                "face",
                wgpu::PrimitiveTopology::TriangleList,
                buffer(Spot::BYTES, wgpu::VertexStepMode::Vertex, &spot),
            ),
            blit: Drawn {
                layout: &blit_layout,
                vertex: (&blit, "cover"),
                fragment: match target.is_srgb() {
                    true => (&blit, "linear"),
                    false => (&blit, "encoded"),
                },
                buffer: None,
                topology: wgpu::PrimitiveTopology::TriangleList,
                format: target,
                has_depth: false,
            }
            .pipeline(device),
            view_layout,
            blit_layout,
        }
    }
}

fn buffer(
    stride: usize,
    step_mode: wgpu::VertexStepMode,
    attributes: &[wgpu::VertexAttribute],
) -> wgpu::VertexBufferLayout<'_> {
    wgpu::VertexBufferLayout {
        array_stride: stride as u64,
        step_mode,
        attributes,
    }
}

fn layout(
    device: &wgpu::Device,
    visibility: wgpu::ShaderStages,
    ty: wgpu::BindingType,
) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("space"),
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility,
            ty,
            count: None,
        }],
    })
}

/// One pipeline in words.
struct Drawn<'a> {
    layout: &'a wgpu::BindGroupLayout,
    vertex: (&'a wgpu::ShaderModule, &'a str),
    fragment: (&'a wgpu::ShaderModule, &'a str),
    buffer: Option<wgpu::VertexBufferLayout<'a>>,
    topology: wgpu::PrimitiveTopology,
    format: wgpu::TextureFormat,
    /// Whether it is drawn into the picture, with depth and several samples in a pixel.
    has_depth: bool,
}

impl Drawn<'_> {
    fn pipeline(self, device: &wgpu::Device) -> wgpu::RenderPipeline {
        let label = Some(self.vertex.1);
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label,
            bind_group_layouts: &[Some(self.layout)],
            immediate_size: 0,
        });
        let buffers: Vec<_> = self.buffer.into_iter().map(Some).collect();
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label,
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: self.vertex.0,
                entry_point: Some(self.vertex.1),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &buffers,
            },
            primitive: wgpu::PrimitiveState {
                topology: self.topology,
                ..wgpu::PrimitiveState::default()
            },
            depth_stencil: self.has_depth.then(|| wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState {
                count: if self.has_depth { SAMPLES } else { 1 },
                ..wgpu::MultisampleState::default()
            },
            fragment: Some(wgpu::FragmentState {
                module: self.fragment.0,
                entry_point: Some(self.fragment.1),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format: self.format,
                    blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
                    write_mask: wgpu::ColorWrites::ALL,
                })],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}
