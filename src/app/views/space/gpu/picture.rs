//! One view's picture on the graphics card.

use std::sync::Arc;

use super::frame::{Frame, Points};
use super::guard::guarded;
use super::pipelines::{COLOR, DEPTH, PipelineSet, Pipelines, SAMPLES};

/// The picture and what is needed to draw it anew.
#[derive(Default)]
pub(super) struct Picture {
    target: Option<RenderTarget>,
    cloud: Option<UploadedCloud>,
    /// What the picture shows, and how many pixels one of egui's points has.
    shown: Option<(Frame, f32)>,
    trouble: Option<String>,
    /// How often it was drawn, how often the points in it, and how often a cloud was uploaded.
    #[cfg(test)]
    pub(super) drawn: usize,
    #[cfg(test)]
    pub(super) points_drawn: usize,
    #[cfg(test)]
    pub(super) uploaded: usize,
}

/// Textures of the size of the pane.
///
/// The points have a layer of their own, which stays while only lines and faces change: a hundred
/// thousand of them take a software adapter longer than all the rest.
struct RenderTarget {
    size: [u32; 2],
    cloud_color: wgpu::TextureView,
    cloud_depth: wgpu::TextureView,
    backdrop: wgpu::BindGroup,
    samples: wgpu::TextureView,
    depth: wgpu::TextureView,
    resolved: wgpu::Texture,
    bind_group: wgpu::BindGroup,
}

/// A cloud on the graphics card, with the points that it was made from: they stay alive, so that
/// their address stays their own.
struct UploadedCloud {
    points: Arc<Points>,
    buffer: wgpu::Buffer,
}

impl Picture {
    pub(super) fn trouble(&self) -> Option<String> {
        self.trouble.clone()
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
        let is_current = self.target.as_ref().is_some_and(|t| t.size == size)
            && self
                .shown
                .as_ref()
                .is_some_and(|(shown, at)| shown == frame && *at == scale);
        let Some(made) = pipelines.made() else { return };
        if is_current || self.trouble.is_some() || pipelines.trouble().is_some() {
            return;
        }
        let drawn = guarded(device, || {
            self.submit(made, device, queue, frame, size, scale);
        });
        match drawn {
            Ok(()) => self.shown = Some((frame.clone(), scale)),
            Err(why) => {
                *self = Self {
                    trouble: Some(why),
                    ..Self::default()
                };
            }
        }
    }

    fn submit(
        &mut self,
        made: &PipelineSet,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &Frame,
        size: [u32; 2],
        scale: f32,
    ) {
        let target = match self.target.take() {
            Some(target) if target.size == size => target,
            _ => {
                self.shown = None;
                RenderTarget::new(device, made, size)
            }
        };
        let cloud = match self.cloud.take() {
            Some(cloud) if Arc::ptr_eq(&cloud.points, &frame.points) => cloud,
            _ => {
                #[cfg(test)]
                {
                    self.uploaded += 1;
                }
                UploadedCloud {
                    points: Arc::clone(&frame.points),
                    buffer: filled(
                        device,
                        queue,
                        &frame.points.bytes,
                        wgpu::BufferUsages::VERTEX,
                    ),
                }
            }
        };
        // The rest is a few kilobytes: made anew it needs no bookkeeping of capacities.
        let packed = |write: &dyn Fn(&mut Vec<u8>)| {
            let mut bytes = Vec::new();
            write(&mut bytes);
            filled(device, queue, &bytes, wgpu::BufferUsages::VERTEX)
        };
        let lines = packed(&|bytes| frame.lines.iter().for_each(|line| line.write(bytes)));
        let faces = packed(&|bytes| frame.faces.iter().for_each(|corner| corner.write(bytes)));
        let view = filled(
            device,
            queue,
            &frame.view(size, scale),
            wgpu::BufferUsages::UNIFORM,
        );
        let view = bind(device, &made.view_layout, [view.as_entire_binding()]);

        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let has_points = self.shown.as_ref().is_some_and(|(shown, at)| {
            *at == scale
                && shown.view_camera == frame.view_camera
                && shown.background == frame.background
                && Arc::ptr_eq(&shown.points, &frame.points)
        });
        if !has_points {
            let mut pass = target.begin_cloud(&mut encoder, frame);
            pass.set_bind_group(0, &view, &[]);
            pass.set_pipeline(&made.points);
            pass.set_vertex_buffer(0, cloud.buffer.slice(..));
            pass.draw(0..4, 0..frame.points.len() as u32);
            #[cfg(test)]
            {
                self.points_drawn += 1;
            }
        }
        {
            let mut pass = target.begin(&mut encoder, frame);
            pass.set_pipeline(&made.backdrop);
            pass.set_bind_group(0, &target.backdrop, &[]);
            pass.draw(0..3, 0..1);
            pass.set_bind_group(0, &view, &[]);
            pass.set_pipeline(&made.faces);
            pass.set_vertex_buffer(0, faces.slice(..));
            pass.draw(0..frame.faces.len() as u32, 0..1);
            pass.set_pipeline(&made.lines);
            pass.set_vertex_buffer(0, lines.slice(..));
            pass.draw(0..4, 0..frame.lines.len() as u32);
        }
        queue.submit([encoder.finish()]);
        (self.target, self.cloud) = (Some(target), Some(cloud));
        #[cfg(test)]
        {
            self.drawn += 1;
        }
    }

    /// Copies the picture into the pane, which is the viewport of the pass.
    pub(super) fn show(&self, pipelines: &Pipelines, pass: &mut wgpu::RenderPass<'static>) {
        if let (Some(target), Some(made)) = (&self.target, pipelines.made()) {
            pass.set_pipeline(&made.blit);
            pass.set_bind_group(0, &target.bind_group, &[]);
            pass.draw(0..3, 0..1);
        }
    }

    #[cfg(test)]
    pub(super) fn texture(&self) -> Option<&wgpu::Texture> {
        self.target.as_ref().map(|target| &target.resolved)
    }
}

impl RenderTarget {
    fn new(device: &wgpu::Device, made: &PipelineSet, size: [u32; 2]) -> Self {
        let texture = |format, sample_count, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some("space"),
                size: wgpu::Extent3d {
                    width: size[0],
                    height: size[1],
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        };
        let attached = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let read = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
        let resolved = texture(COLOR, 1, attached | read);
        let shown = wgpu::BindingResource::TextureView;
        let sampled = wgpu::TextureUsages::TEXTURE_BINDING;
        let cloud_color = view(&texture(COLOR, 1, attached | sampled));
        let cloud_depth = view(&texture(DEPTH, 1, attached | sampled));
        let nearest = device.create_sampler(&wgpu::SamplerDescriptor::default());
        let nearest = wgpu::BindingResource::Sampler(&nearest);
        let layers = [shown(&cloud_color), shown(&cloud_depth), nearest];
        let backdrop = bind(device, &made.backdrop_layout, layers);
        let whole = view(&resolved);
        let bind_group = bind(device, &made.blit_layout, [shown(&whole)]);
        Self {
            size,
            cloud_color,
            cloud_depth,
            backdrop,
            samples: view(&texture(COLOR, SAMPLES, attached)),
            depth: view(&texture(DEPTH, SAMPLES, attached)),
            resolved,
            bind_group,
        }
    }

    /// The pass that draws the points.
    fn begin_cloud<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        frame: &Frame,
    ) -> wgpu::RenderPass<'a> {
        let store = wgpu::StoreOp::Store;
        pass(
            encoder,
            frame,
            (&self.cloud_color, None),
            &self.cloud_depth,
            store,
        )
    }

    /// The pass that draws everything else in front of them.
    fn begin<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        frame: &Frame,
    ) -> wgpu::RenderPass<'a> {
        let resolved = self.resolved.create_view(&Default::default());
        let store = wgpu::StoreOp::Discard;
        pass(
            encoder,
            frame,
            (&self.samples, Some(&resolved)),
            &self.depth,
            store,
        )
    }
}

/// A pass that begins with nothing but the background. What several samples are resolved to is kept
/// in any case.
fn pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    frame: &Frame,
    (color, resolved): (&wgpu::TextureView, Option<&wgpu::TextureView>),
    depth: &wgpu::TextureView,
    store: wgpu::StoreOp,
) -> wgpu::RenderPass<'a> {
    let [r, g, b, a] = frame
        .background
        .to_array()
        .map(|value| f64::from(value) / 255.0);
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("space"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: color,
            depth_slice: None,
            resolve_target: resolved,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }),
                store,
            },
        })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: depth,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(0.0),
                store,
            }),
            stencil_ops: None,
        }),
        ..wgpu::RenderPassDescriptor::default()
    })
}

fn bind<const N: usize>(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: [wgpu::BindingResource<'_>; N],
) -> wgpu::BindGroup {
    let mut bindings = 0..;
    let entries = resources.map(|resource| wgpu::BindGroupEntry {
        binding: bindings.next().unwrap_or_default(),
        resource,
    });
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("space"),
        layout,
        entries: &entries,
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
