//! One view's picture on the graphics card.

use std::sync::Arc;

use super::frame::{Frame, Points};
use super::guarded;
use super::pipelines::{COLOR, DEPTH, Pipelines};
use crate::app::memo::Same;

/// The picture and what is needed to draw it anew.
#[derive(Default)]
pub(super) struct Picture {
    target: Option<RenderTarget>,
    /// A cloud on the card, with the points that it was made from.
    cloud: Option<(Same<Points>, wgpu::Buffer)>,
    /// What the picture shows, and how many pixels one of egui's points has.
    shown: Option<(Frame, f32)>,
    trouble: Option<String>,
}

/// Textures of the size of the pane.
struct RenderTarget {
    size: [u32; 2],
    color: wgpu::Texture,
    depth: wgpu::TextureView,
    bind_group: wgpu::BindGroup,
}

impl Picture {
    /// What the graphics card refused, after which nothing is drawn.
    pub(super) fn trouble(&self) -> Option<&String> {
        self.trouble.as_ref()
    }

    /// Whether the picture shows this frame.
    pub(super) fn shows(&self, frame: &Frame, size: [u32; 2], scale: f32) -> bool {
        let has_size = self.target.as_ref().is_some_and(|target| target.size == size);
        let shown = self.shown.as_ref();
        has_size && shown.is_some_and(|(shown, at)| shown == frame && *at == scale)
    }

    /// Draws a frame, unless the picture shows it already.
    pub(super) fn draw(
        &mut self,
        pipelines: &Pipelines,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &Frame,
        size: [u32; 2],
        scale: f32,
    ) {
        if self.shows(frame, size, scale) || self.trouble.is_some() {
            return;
        }
        let drawn = guarded(device, || {
            self.submit(pipelines, device, queue, frame, size, scale);
        });
        match drawn {
            Ok(()) => self.shown = Some((frame.clone(), scale)),
            Err(why) => {
                *self = Self { trouble: Some(why), ..Self::default() };
            }
        }
    }

    fn submit(
        &mut self,
        pipelines: &Pipelines,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &Frame,
        size: [u32; 2],
        scale: f32,
    ) {
        let target = self.target.take().filter(|target| target.size == size);
        let target = target.unwrap_or_else(|| RenderTarget::new(device, pipelines, size));
        let buffer = |bytes: &[u8], usage| filled(device, queue, bytes, usage);
        let of = Same(Arc::clone(&frame.points));
        let known = self.cloud.take().filter(|(known, _)| *known == of);
        let cloud =
            known.unwrap_or_else(|| (of, buffer(&frame.points.bytes, wgpu::BufferUsages::VERTEX)));
        // The rest is a few kilobytes: made anew it needs no bookkeeping of capacities.
        let mut lines = Vec::new();
        frame.lines.iter().for_each(|line| line.write(&mut lines));
        let lines = buffer(&lines, wgpu::BufferUsages::VERTEX);
        let view = buffer(&frame.view(size, scale), wgpu::BufferUsages::UNIFORM);
        let [points, strokes] = [frame.points.len(), frame.lines.len()].map(|count| count as u32);

        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = target.begin(&mut encoder, frame);
            for (pipeline, buffer, instances) in
                [(&pipelines.points, &cloud.1, points), (&pipelines.lines, &lines, strokes)]
            {
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &bind(device, pipeline, view.as_entire_binding()), &[]);
                pass.set_vertex_buffer(0, buffer.slice(..));
                pass.draw(0..4, 0..instances);
            }
        }
        queue.submit([encoder.finish()]);
        (self.target, self.cloud) = (Some(target), Some(cloud));
    }

    /// Copies the picture into the pane, which is the viewport of the pass.
    pub(super) fn show(&self, pipelines: &Pipelines, pass: &mut wgpu::RenderPass<'static>) {
        if let Some(target) = &self.target {
            pass.set_pipeline(&pipelines.blit);
            pass.set_bind_group(0, &target.bind_group, &[]);
            pass.draw(0..3, 0..1);
        }
    }

    #[cfg(test)]
    pub(super) fn texture(&self) -> Option<&wgpu::Texture> {
        self.target.as_ref().map(|target| &target.color)
    }
}

impl RenderTarget {
    fn new(device: &wgpu::Device, pipelines: &Pipelines, size: [u32; 2]) -> Self {
        let texture = |format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some("space"),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        };
        let attached = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let read = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
        let color = texture(COLOR, attached | read);
        let whole = wgpu::BindingResource::TextureView(&view(&color));
        Self {
            size,
            depth: view(&texture(DEPTH, attached)),
            bind_group: bind(device, &pipelines.blit, whole),
            color,
        }
    }

    /// A pass that begins with the background.
    fn begin<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        frame: &Frame,
    ) -> wgpu::RenderPass<'a> {
        let color = self.color.create_view(&Default::default());
        let background = frame.background.to_array();
        let [r, g, b, a] = background.map(|value| f64::from(value) / 255.0);
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("space"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &color,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..wgpu::RenderPassDescriptor::default()
        })
    }
}

fn bind(
    device: &wgpu::Device,
    pipeline: &wgpu::RenderPipeline,
    resource: wgpu::BindingResource<'_>,
) -> wgpu::BindGroup {
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("space"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[wgpu::BindGroupEntry { binding: 0, resource }],
    })
}

/// A buffer with content; an empty one still has room for something, as wgpu wants it.
///
/// Written through the queue: a buffer that is mapped at its creation panics when the device is lost.
fn filled(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    bytes: &[u8],
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    let bytes = if bytes.is_empty() { &[0; 32] } else { bytes };
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("space"),
        size: bytes.len() as u64,
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    queue.write_buffer(&buffer, 0, bytes);
    buffer
}
