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
    pub(super) blit: wgpu::RenderPipeline,
}

impl Pipelines {
    /// Pipelines for a device whose window has this format; an error says what the device refused.
    pub(super) fn new(device: &wgpu::Device, target: wgpu::TextureFormat) -> Result<Self, String> {
        guarded(device, || Self::on(device, target))
    }

    fn on(device: &wgpu::Device, target: wgpu::TextureFormat) -> Self {
        use wgpu::PrimitiveTopology::{TriangleList, TriangleStrip};
        let scene = device.create_shader_module(wgpu::include_wgsl!("../scene.wgsl"));
        let blit = device.create_shader_module(wgpu::include_wgsl!("../blit.wgsl"));
        let spot = wgpu::vertex_attr_array![0 => Float32x3, 1 => Unorm8x4];
        let line = wgpu::vertex_attr_array![
            0 => Float32x3, 1 => Float32x3, 2 => Unorm8x4, 3 => Float32
        ];
        let part = |entry_points, stride: usize, attributes| {
            let (array_stride, step_mode) = (stride as u64, wgpu::VertexStepMode::Instance);
            let buffer = wgpu::VertexBufferLayout { array_stride, step_mode, attributes };
            pipeline(device, &scene, entry_points, TriangleStrip, Some(buffer), COLOR)
        };
        let copy = if target.is_srgb() { "linear" } else { "encoded" };
        Self {
            points: part(["point", "paint"], Spot::BYTES, &spot),
            lines: part(["line", "stroke"], Line::BYTES, &line),
            blit: pipeline(device, &blit, ["cover", copy], TriangleList, None, target),
        }
    }
}

/// One pipeline from a vertex and a fragment shader. What has a vertex buffer is drawn into the picture, the rest into
/// the window, which has no depth.
fn pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    [vertex, fragment]: [&str; 2],
    topology: wgpu::PrimitiveTopology,
    buffer: Option<wgpu::VertexBufferLayout<'_>>,
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    let depth_stencil = buffer.as_ref().map(|_| wgpu::DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(true),
        depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    });
    let buffers: Vec<_> = buffer.into_iter().map(Some).collect();
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(vertex),
        layout: None,
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &buffers,
        },
        primitive: wgpu::PrimitiveState { topology, ..wgpu::PrimitiveState::default() },
        multisample: wgpu::MultisampleState::default(),
        depth_stencil,
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format,
                blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
