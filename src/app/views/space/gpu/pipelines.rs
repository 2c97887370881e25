//! How each kind of thing is drawn: made once for a window.

use super::frame::{Line, Spot};
use super::guarded;

/// Format of the picture. Values are written as egui encodes them.
pub(super) const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The pipelines of a device.
pub(super) struct Pipelines {
    pub(super) points: wgpu::RenderPipeline,
    pub(super) lines: wgpu::RenderPipeline,
    pub(super) faces: wgpu::RenderPipeline,
    pub(super) blit: wgpu::RenderPipeline,
    pub(super) view_layout: wgpu::BindGroupLayout,
    pub(super) blit_layout: wgpu::BindGroupLayout,
}

impl Pipelines {
    /// Pipelines for a device whose window has this format; an error says what the device refused.
    pub(super) fn new(device: &wgpu::Device, target: wgpu::TextureFormat) -> Result<Self, String> {
        guarded(device, || Self::on(device, target))
    }

    fn on(device: &wgpu::Device, target: wgpu::TextureFormat) -> Self {
        let scene = device.create_shader_module(wgpu::include_wgsl!("../scene.wgsl"));
        let blit = device.create_shader_module(wgpu::include_wgsl!("../blit.wgsl"));
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let texture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let view_layout = layout(device, wgpu::ShaderStages::VERTEX, uniform);
        let blit_layout = layout(device, wgpu::ShaderStages::FRAGMENT, texture);
        let spot = wgpu::vertex_attr_array![0 => Float32x3, 1 => Unorm8x4];
        let line = wgpu::vertex_attr_array![
            0 => Float32x3, 1 => Float32x3, 2 => Unorm8x4, 3 => Float32
        ];
        let strip = wgpu::PrimitiveTopology::TriangleStrip;
        let triangles = wgpu::PrimitiveTopology::TriangleList;
        let instance = wgpu::VertexStepMode::Instance;
        let corner = wgpu::VertexStepMode::Vertex;
        let part = |vertex, fragment, topology, stride: usize, step_mode, attributes| {
            let spec = PipelineSpec {
                layout: &view_layout,
                shaders: &scene,
                vertex,
                fragment,
                buffer: Some(wgpu::VertexBufferLayout {
                    array_stride: stride as u64,
                    step_mode,
                    attributes,
                }),
                topology,
                format: COLOR,
            };
            spec.pipeline(device)
        };
        Self {
            points: part("point", "paint", strip, Spot::BYTES, instance, &spot),
            lines: part("line", "stroke", strip, Line::BYTES, instance, &line),
            faces: part("face", "paint", triangles, Spot::BYTES, corner, &spot),
            blit: PipelineSpec {
                layout: &blit_layout,
                shaders: &blit,
                vertex: "cover",
                fragment: if target.is_srgb() { "linear" } else { "encoded" },
                buffer: None,
                topology: triangles,
                format: target,
            }
            .pipeline(device),
            view_layout,
            blit_layout,
        }
    }
}

fn layout(
    device: &wgpu::Device,
    visibility: wgpu::ShaderStages,
    ty: wgpu::BindingType,
) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("space"),
        entries: &[wgpu::BindGroupLayoutEntry { binding: 0, visibility, ty, count: None }],
    })
}

/// One pipeline. What has a vertex buffer is drawn into the picture, the rest into the window, which has no
/// depth.
struct PipelineSpec<'a> {
    layout: &'a wgpu::BindGroupLayout,
    shaders: &'a wgpu::ShaderModule,
    vertex: &'a str,
    fragment: &'a str,
    buffer: Option<wgpu::VertexBufferLayout<'a>>,
    topology: wgpu::PrimitiveTopology,
    format: wgpu::TextureFormat,
}

impl PipelineSpec<'_> {
    fn pipeline(self, device: &wgpu::Device) -> wgpu::RenderPipeline {
        let label = Some(self.vertex);
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label,
            bind_group_layouts: &[Some(self.layout)],
            immediate_size: 0,
        });
        let depth = self.buffer.as_ref().map(|_| wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        });
        let buffers: Vec<_> = self.buffer.into_iter().map(Some).collect();
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label,
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: self.shaders,
                entry_point: label,
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &buffers,
            },
            primitive: wgpu::PrimitiveState {
                topology: self.topology,
                ..wgpu::PrimitiveState::default()
            },
            multisample: wgpu::MultisampleState::default(),
            depth_stencil: depth,
            fragment: Some(wgpu::FragmentState {
                module: self.shaders,
                entry_point: Some(self.fragment),
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
