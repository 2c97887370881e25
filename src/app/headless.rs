//! The window's content painted where there is no window.

use std::time::Duration;

use eframe::egui_wgpu::capture::CaptureState;
use eframe::egui_wgpu::{RenderState, RendererOptions, ScreenDescriptor};
use egui::{FullOutput, ScreenshotCallback};
use image::RgbImage;

use super::adapter;
use super::textures::rgb_image;
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
        let [width, height] = self.size_px;
        let screen = ScreenDescriptor {
            size_in_pixels: self.size_px,
            pixels_per_point: output.pixels_per_point,
        };
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        let mut capture = CaptureState::new(device, size, self.state.target_format);
        let view = capture.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let shapes = ctx.tessellate(output.shapes, output.pixels_per_point);
        let mut encoder = device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("window") });
        let mut renderer = self.state.renderer.write();
        let prepared = renderer.update_buffers(device, queue, &mut encoder, &shapes, &screen);
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
        let buffer = capture.copy_textures(device, None, &mut encoder);
        let submitted = queue.submit(prepared.into_iter().chain([encoder.finish()]));
        let (tell, told) = std::sync::mpsc::channel();
        let take = ScreenshotCallback::new(move |image| {
            // Nobody listens any more where the device was lost meanwhile.
            let _ = tell.send(image);
        });
        capture.read_screen_rgba(buffer, vec![take]);
        let lost =
            |why: &dyn std::fmt::Display| format!("the graphics adapter gave no picture: {why}");
        let wait =
            wgpu::PollType::Wait { submission_index: Some(submitted), timeout: Some(PATIENCE) };
        device.poll(wait).map_err(|why| lost(&why))?;
        let image = told.recv().map_err(|why| lost(&why))?;
        rgb_image(&image).ok_or_else(|| lost(&"it has another size"))
    }
}
