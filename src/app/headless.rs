//! The window's content painted where there is no window.

use std::time::Duration;

use eframe::egui_wgpu::{RenderState, RendererOptions, ScreenDescriptor};
use egui::FullOutput;
use image::RgbImage;

use super::adapter;
use super::window::{WindowError, one_line};

/// Beyond this a graphics adapter that does not answer is taken for lost.
const PATIENCE: Duration = Duration::from_secs(60);

/// A graphics adapter, and what it draws into.
pub(super) struct Painter {
    state: RenderState,
    size_px: [u32; 2],
}

impl Painter {
    /// Finds an adapter for pictures of a size \[px\].
    pub(super) fn new(size_px: [u32; 2]) -> Result<Self, WindowError> {
        // OpenGL looks for a display, and complains where there is none: it is asked last.
        let found = Self::on(wgpu::Backends::PRIMARY, size_px);
        found.or_else(|_| Self::on(wgpu::Backends::all(), size_px))
    }

    fn on(backends: wgpu::Backends, size_px: [u32; 2]) -> Result<Self, WindowError> {
        let configuration = adapter::configuration(backends);
        let instance = pollster::block_on(configuration.wgpu_setup.new_instance());
        let state =
            RenderState::create(&configuration, &instance, None, RendererOptions::default());
        let state = pollster::block_on(state)
            .map_err(|why| WindowError::NoAdapter(one_line(&why.to_string())))?;
        Ok(Self { state, size_px })
    }

    /// The greatest side of a texture \[px\].
    pub(super) fn max_side(&self) -> usize {
        self.state.device.limits().max_texture_dimension_2d as usize
    }

    /// Takes over the pictures that a frame has put on the card. Has to be done for every frame.
    pub(super) fn take_textures(&self, output: &mut FullOutput) {
        let mut renderer = self.state.renderer.write();
        let (device, queue) = (&self.state.device, &self.state.queue);
        for (id, changes) in output.textures_delta.set.drain() {
            for change in changes {
                renderer.update_texture(device, queue, id, &change);
            }
        }
        for id in output.textures_delta.free.drain() {
            renderer.free_texture(&id);
        }
    }

    /// Paints a frame.
    pub(super) fn paint(
        &self,
        ctx: &egui::Context,
        output: FullOutput,
    ) -> Result<RgbImage, String> {
        let (device, queue) = (&self.state.device, &self.state.queue);
        let screen = ScreenDescriptor {
            size_in_pixels: self.size_px,
            pixels_per_point: output.pixels_per_point,
        };
        let shapes = ctx.tessellate(output.shapes, output.pixels_per_point);
        let mut encoder = device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("window") });
        let mut renderer = self.state.renderer.write();
        let prepared = renderer.update_buffers(device, queue, &mut encoder, &shapes, &screen);
        let texture = self.texture();
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("window"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
                depth_slice: None,
            })],
            ..wgpu::RenderPassDescriptor::default()
        });
        renderer.render(&mut pass.forget_lifetime(), &shapes, &screen);
        queue.submit(prepared.into_iter().chain([encoder.finish()]));
        self.read(&texture)
    }

    fn texture(&self) -> wgpu::Texture {
        let [width, height] = self.size_px;
        self.state.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("window"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.state.target_format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        })
    }

    /// The pixels of a texture.
    fn read(&self, texture: &wgpu::Texture) -> Result<RgbImage, String> {
        const BYTES: u32 = 4;
        let (device, queue) = (&self.state.device, &self.state.queue);
        let [width, height] = self.size_px;
        let row = (width * BYTES).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: u64::from(row) * u64::from(height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("picture") });
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
                    rows_per_image: None,
                },
            },
            texture.size(),
        );
        let submitted = queue.submit([encoder.finish()]);
        let (tell, told) = std::sync::mpsc::channel();
        let all = buffer.slice(..);
        all.map_async(wgpu::MapMode::Read, move |mapped| {
            // Nobody listens any more where the device was lost meanwhile.
            let _ = tell.send(mapped);
        });
        let lost =
            |why: &dyn std::fmt::Display| format!("the graphics adapter gave no picture: {why}");
        let wait =
            wgpu::PollType::Wait { submission_index: Some(submitted), timeout: Some(PATIENCE) };
        device.poll(wait).map_err(|why| lost(&why))?;
        let mapped = told.recv().map_err(|why| lost(&why))?;
        mapped.map_err(|why| lost(&why))?;
        let bytes = all.get_mapped_range().map_err(|why| lost(&why))?;
        let is_blue_first = matches!(
            self.state.target_format,
            wgpu::TextureFormat::Bgra8Unorm | wgpu::TextureFormat::Bgra8UnormSrgb
        );
        let picture = RgbImage::from_fn(width, height, |x, y| {
            let at = (y * row + x * BYTES) as usize;
            let [a, b, c] = [bytes[at], bytes[at + 1], bytes[at + 2]];
            image::Rgb(if is_blue_first { [c, b, a] } else { [a, b, c] })
        });
        Ok(picture)
    }
}
