//! Drawing on the graphics card: a picture of its own, with a depth buffer, which egui's render pass
//! does not have.
//!
//! [`Painter::paint`] hands a [`Frame`] to egui as a callback. The picture is drawn before egui's
//! pass, and only if something in it has changed; within the pass it is copied into the pane.

mod frame;
mod picture;
mod pipelines;
#[cfg(test)]
mod tests;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use eframe::egui_wgpu::{
    Callback, CallbackResources, CallbackTrait, RenderState, ScreenDescriptor,
};
use egui::{PaintCallbackInfo, Rect};

pub(super) use frame::{Frame, Line, Points, Spot};
use picture::Picture;
use pipelines::Pipelines;

/// Draws one view's frames. Errors of the graphics card stay inside and can be asked for.
#[derive(Clone)]
pub(super) struct Painter {
    /// `Err` says what the device refused.
    pipelines: Arc<Result<Pipelines, String>>,
    picture: Arc<Mutex<Picture>>,
}

impl Painter {
    /// The pipelines are made once and shared by all painters of a window.
    pub(super) fn new(state: &RenderState) -> Self {
        let mut renderer = state.renderer.write();
        let shared = &mut renderer.callback_resources;
        let pipelines = shared
            .entry::<Arc<Result<Pipelines, String>>>()
            .or_insert_with(|| Arc::new(Pipelines::new(&state.device, state.target_format)));
        Self { pipelines: Arc::clone(pipelines), picture: Arc::default() }
    }

    fn picture(&self) -> MutexGuard<'_, Picture> {
        self.picture.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Why nothing can be drawn, if so.
    pub(super) fn trouble(&self) -> Option<String> {
        let refused = self.pipelines.as_ref().as_ref().err();
        refused.or(self.picture().trouble()).cloned()
    }

    /// Puts a frame into the pane.
    pub(super) fn paint(&self, painter: &egui::Painter, rect: Rect, frame: Frame) {
        let callback = PaintCallback { painter: self.clone(), rect, frame };
        painter.add(Callback::new_paint_callback(rect, callback));
    }
}

/// A frame on its way to the screen.
struct PaintCallback {
    painter: Painter,
    rect: Rect,
    frame: Frame,
}

impl CallbackTrait for PaintCallback {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        screen: &ScreenDescriptor,
        _encoder: &mut wgpu::CommandEncoder,
        _resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        let info = PaintCallbackInfo {
            viewport: self.rect,
            clip_rect: self.rect,
            pixels_per_point: screen.pixels_per_point,
            screen_size_px: screen.size_in_pixels,
        };
        let viewport = info.viewport_in_pixels();
        let size = [viewport.width_px, viewport.height_px].map(|side| side.max(0) as u32);
        if let Ok(pipelines) = self.painter.pipelines.as_ref()
            && !size.contains(&0)
        {
            let scale = screen.pixels_per_point;
            self.painter.picture().draw(pipelines, device, queue, &self.frame, size, scale);
        }
        // Submitted already: an error in it then belongs to this view and not to all of egui.
        Vec::new()
    }

    fn paint(
        &self,
        _info: PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        _resources: &CallbackResources,
    ) {
        if let Ok(pipelines) = self.painter.pipelines.as_ref() {
            self.painter.picture().show(pipelines, pass);
        }
    }
}

/// Runs something whose errors are wanted as values instead of a panic.
fn guarded<T>(device: &wgpu::Device, run: impl FnOnce() -> T) -> Result<T, String> {
    let filters = [
        wgpu::ErrorFilter::Internal,
        wgpu::ErrorFilter::OutOfMemory,
        wgpu::ErrorFilter::Validation,
    ];
    let scopes = filters.map(|filter| device.push_error_scope(filter));
    let value = run();
    let mut error = None;
    for scope in scopes.into_iter().rev() {
        error = error.or(pollster::block_on(scope.pop()));
    }
    error.map_or(Ok(value), |error| Err(one_line(&error.to_string())))
}

/// An error of wgpu in one line: what caused it, without the headings.
fn one_line(text: &str) -> String {
    let causes = text.split_once("Caused by:").map_or(text, |(_, causes)| causes);
    let lines = causes.lines().map(str::trim).filter(|line| !line.is_empty());
    lines.collect::<Vec<_>>().join(": ")
}
