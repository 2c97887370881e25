//! How each kind of thing is drawn: made once for a window.

use std::sync::{Arc, Mutex, PoisonError};

use super::frame::{Line, Spot};
use super::guard::{guarded, one_line};

/// Samples in a pixel: lines have smooth edges.
pub(super) const SAMPLES: u32 = 4;
/// Format of the picture. Values are written as egui encodes them.
pub(super) const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The pipelines of a device, unless it refused them.
pub(super) struct Pipelines {
    made: Result<PipelineSet, String>,
    lost: Arc<Mutex<Option<String>>>,
}

pub(super) struct PipelineSet {
    pub(super) points: wgpu::RenderPipeline,
    pub(super) lines: wgpu::RenderPipeline,
    pub(super) faces: wgpu::RenderPipeline,
    pub(super) backdrop: wgpu::RenderPipeline,
    pub(super) blit: wgpu::RenderPipeline,
    pub(super) view_layout: wgpu::BindGroupLayout,
    pub(super) backdrop_layout: wgpu::BindGroupLayout,
    pub(super) blit_layout: wgpu::BindGroupLayout,
}

impl Pipelines {
    /// Pipelines for a device whose window has this format.
    pub(super) fn new(device: &wgpu::Device, target: wgpu::TextureFormat) -> Self {
        let lost: Arc<Mutex<Option<String>>> = Arc::default();
        let told = Arc::clone(&lost);
        device.set_device_lost_callback(move |_, why| {
            let why = format!("the graphics card was lost {}", one_line(&why));
            *told.lock().unwrap_or_else(PoisonError::into_inner) = Some(why.trim().to_owned());
        });
        Self {
            made: guarded(device, || PipelineSet::new(device, target)),
            lost,
        }
    }

    pub(super) fn made(&self) -> Option<&PipelineSet> {
        self.made.as_ref().ok()
    }

    /// Why nothing can be drawn, if so.
    pub(super) fn trouble(&self) -> Option<String> {
        let lost = self.lost.lock().unwrap_or_else(PoisonError::into_inner);
        lost.clone().or_else(|| self.made.as_ref().err().cloned())
    }
}

impl PipelineSet {
    fn new(device: &wgpu::Device, target: wgpu::TextureFormat) -> Self {
        let scene = device.create_shader_module(wgpu::include_wgsl!("../scene.wgsl"));
        let blit = device.create_shader_module(wgpu::include_wgsl!("../blit.wgsl"));
        let view_layout = layout(
            device,
            wgpu::ShaderStages::VERTEX,
            &[wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: None,
            }],
        );
        let texture = |sample_type| wgpu::BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let color = texture(wgpu::TextureSampleType::Float { filterable: false });
        let nearest = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::NonFiltering);
        let fragment = wgpu::ShaderStages::FRAGMENT;
        let blit_layout = layout(device, fragment, &[color]);
        let backdrop_layout = layout(device, fragment, &[color, color, nearest]);
        let spot = wgpu::vertex_attr_array![0 => Float32x3, 1 => Unorm8x4];
        let line = wgpu::vertex_attr_array![
            0 => Float32x3, 1 => Float32x3, 2 => Unorm8x4, 3 => Float32
        ];
        let instance = wgpu::VertexStepMode::Instance;
        let strip = wgpu::PrimitiveTopology::TriangleStrip;
        let part = |name, topology, buffer, target| {
            let drawn = PipelineSpec {
                layout: &view_layout,
                vertex: (&scene, name),
                fragment: (&scene, "paint"),
                buffer: Some(buffer),
                topology,
                target,
            };
            drawn.pipeline(device)
        };
        Self {
            points: part(
                "point",
                strip,
                buffer(Spot::BYTES, instance, &spot),
                TargetKind::Cloud,
            ),
            lines: part(
                "line",
                strip,
                buffer(Line::BYTES, instance, &line),
                TargetKind::Picture,
            ),
            faces: part(
                "face",
                wgpu::PrimitiveTopology::TriangleList,
                buffer(Spot::BYTES, wgpu::VertexStepMode::Vertex, &spot),
                TargetKind::Picture,
            ),
            backdrop: PipelineSpec {
                layout: &backdrop_layout,
                vertex: (&blit, "cover"),
                fragment: (&blit, "backdrop"),
                buffer: None,
                topology: wgpu::PrimitiveTopology::TriangleList,
                target: TargetKind::Picture,
            }
            .pipeline(device),
            blit: PipelineSpec {
                layout: &blit_layout,
                vertex: (&blit, "cover"),
                fragment: if target.is_srgb() {
                    (&blit, "linear")
                } else {
                    (&blit, "encoded")
                },
                buffer: None,
                topology: wgpu::PrimitiveTopology::TriangleList,
                target: TargetKind::Pane(target),
            }
            .pipeline(device),
            view_layout,
            backdrop_layout,
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
    types: &[wgpu::BindingType],
) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = (0..)
        .zip(types)
        .map(|(binding, &ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty,
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("space"),
        entries: &entries,
    })
}

/// One pipeline in words.
struct PipelineSpec<'a> {
    layout: &'a wgpu::BindGroupLayout,
    vertex: (&'a wgpu::ShaderModule, &'a str),
    fragment: (&'a wgpu::ShaderModule, &'a str),
    buffer: Option<wgpu::VertexBufferLayout<'a>>,
    topology: wgpu::PrimitiveTopology,
    target: TargetKind,
}

/// What is drawn into.
#[derive(Clone, Copy)]
enum TargetKind {
    /// The layer of the points alone. They are squares, which more samples would only blur.
    Cloud,
    /// The whole picture.
    Picture,
    /// The window, which has no depth.
    Pane(wgpu::TextureFormat),
}

impl TargetKind {
    fn format(self) -> wgpu::TextureFormat {
        match self {
            Self::Cloud | Self::Picture => COLOR,
            Self::Pane(format) => format,
        }
    }

    fn samples(self) -> u32 {
        match self {
            Self::Picture => SAMPLES,
            Self::Cloud | Self::Pane(_) => 1,
        }
    }
}

impl PipelineSpec<'_> {
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
            depth_stencil: (!matches!(self.target, TargetKind::Pane(_))).then(|| {
                wgpu::DepthStencilState {
                    format: DEPTH,
                    depth_write_enabled: Some(true),
                    depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
                    stencil: wgpu::StencilState::default(),
                    bias: wgpu::DepthBiasState::default(),
                }
            }),
            multisample: wgpu::MultisampleState {
                count: self.target.samples(),
                ..wgpu::MultisampleState::default()
            },
            fragment: Some(wgpu::FragmentState {
                module: self.fragment.0,
                entry_point: Some(self.fragment.1),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format: self.target.format(),
                    blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
                    write_mask: wgpu::ColorWrites::ALL,
                })],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}
