//! Drawing on the graphics card: a picture of its own, with a depth buffer, which egui's render pass
//! does not have.
//!
//! [`Painter::paint`] hands a [`Frame`] to egui as a callback. The picture is drawn before egui's
//! pass, and only if something in it has changed; within the pass it is copied into the pane.

mod picture;
mod pipelines;
#[cfg(test)]
mod tests;

use std::sync::{Arc, Mutex, PoisonError};

use eframe::egui_wgpu::{
    Callback, CallbackResources, CallbackTrait, RenderState, ScreenDescriptor,
};
use egui::{Color32, PaintCallbackInfo, Rect};

use super::lens::{Lens, NEAR_M};
use picture::Picture;
use pipelines::Pipelines;

/// A corner of a face, or a point of the cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    /// In the scene \[m\].
    pub(super) at: [f32; 3],
    pub(super) color: Color32,
}

/// A stroke from one place to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    /// Both ends, in the scene \[m\].
    pub(super) ends: [[f32; 3]; 2],
    pub(super) color: Color32,
    /// In egui's points.
    pub(super) width: f32,
}

/// Points that stay as they are, in the layout of the graphics card.
#[derive(Debug, Default)]
pub(super) struct Points {
    bytes: Vec<u8>,
}

impl Points {
    pub(super) fn new(spots: impl Iterator<Item = Spot>) -> Self {
        let mut bytes = Vec::new();
        spots.for_each(|spot| spot.write(&mut bytes));
        Self { bytes }
    }

    pub(super) fn len(&self) -> usize {
        self.bytes.len() / Spot::BYTES
    }
}

impl Spot {
    const BYTES: usize = 16;

    fn write(&self, bytes: &mut Vec<u8>) {
        write_floats(bytes, &self.at);
        bytes.extend(self.color.to_array());
    }
}

impl Line {
    const BYTES: usize = 32;

    fn write(&self, bytes: &mut Vec<u8>) {
        write_floats(bytes, self.ends.as_flattened());
        bytes.extend(self.color.to_array());
        write_floats(bytes, &[self.width]);
    }
}

fn write_floats(bytes: &mut Vec<u8>, floats: &[f32]) {
    bytes.extend(floats.iter().flat_map(|float| float.to_le_bytes()));
}

/// All that one picture shows.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    pub(super) lens: Lens,
    pub(super) background: Color32,
    /// The cloud. It is uploaded again only when it is another one.
    pub(super) points: Arc<Points>,
    pub(super) lines: Vec<Line>,
    /// Three corners each.
    pub(super) faces: Vec<Spot>,
}

impl PartialEq for Frame {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.points, &other.points)
            && self.lens == other.lens
            && self.background == other.background
            && self.lines == other.lines
            && self.faces == other.faces
    }
}

impl Frame {
    /// What the shaders know as `View`.
    fn view(&self, size_px: [u32; 2], scale: f32) -> Vec<u8> {
        /// Least and greatest size of a point, in egui's points.
        const POINT: [f32; 2] = [1.5, 3.0];
        /// Size of a point of the cloud \[m\], where it comes out between the two.
        const POINT_M: f32 = 0.06;
        let focal_px = self.lens.focal[0] as f32 * scale;
        let mut bytes = Vec::new();
        write_floats(&mut bytes, self.lens.clip_from_scene().as_flattened());
        write_floats(&mut bytes, &size_px.map(|side| side as f32));
        write_floats(&mut bytes, &POINT.map(|side| side * scale));
        write_floats(&mut bytes, &[POINT_M * focal_px, scale, NEAR_M as f32, 0.0]);
        bytes
    }
}

/// Draws one view's frames. Errors of the graphics card stay inside and can be asked for.
pub(super) struct Painter {
    pipelines: Arc<Pipelines>,
    picture: Arc<Mutex<Picture>>,
}

impl Painter {
    /// The pipelines are made once and shared by all painters of a window.
    pub(super) fn new(state: &RenderState) -> Self {
        let mut renderer = state.renderer.write();
        let shared = &mut renderer.callback_resources;
        let pipelines = shared
            .entry::<Arc<Pipelines>>()
            .or_insert_with(|| Arc::new(Pipelines::new(&state.device, state.target_format)));
        Self {
            pipelines: Arc::clone(pipelines),
            picture: Arc::default(),
        }
    }

    /// Why nothing can be drawn, if so.
    pub(super) fn trouble(&self) -> Option<String> {
        let drawn = self.picture.lock().unwrap_or_else(PoisonError::into_inner);
        self.pipelines.trouble().or_else(|| drawn.trouble())
    }

    /// Forgets the trouble of the last picture, to try again.
    pub(super) fn try_again(&self) {
        *self.picture.lock().unwrap_or_else(PoisonError::into_inner) = Picture::default();
    }

    /// Puts a frame into the pane.
    pub(super) fn paint(&self, painter: &egui::Painter, rect: Rect, frame: Frame) {
        painter.add(Callback::new_paint_callback(
            rect,
            Job {
                pipelines: Arc::clone(&self.pipelines),
                picture: Arc::clone(&self.picture),
                rect,
                frame,
            },
        ));
    }
}

/// A frame on its way to the screen.
struct Job {
    pipelines: Arc<Pipelines>,
    picture: Arc<Mutex<Picture>>,
    rect: Rect,
    frame: Frame,
}

impl CallbackTrait for Job {
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
        if size.contains(&0) {
            return Vec::new();
        }
        let mut picture = self.picture.lock().unwrap_or_else(PoisonError::into_inner);
        let scale = screen.pixels_per_point;
        picture.draw(&self.pipelines, device, queue, &self.frame, size, scale);
        // Submitted already: an error in it then belongs to this view and not to all of egui.
        Vec::new()
    }

    fn paint(
        &self,
        _info: PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        _resources: &CallbackResources,
    ) {
        if self.pipelines.trouble().is_none() {
            let picture = self.picture.lock().unwrap_or_else(PoisonError::into_inner);
            picture.show(&self.pipelines, pass);
        }
    }
}

/// Runs something whose errors are wanted as values instead of a panic.
fn guarded<T>(device: &wgpu::Device, run: impl FnOnce() -> T) -> Result<T, String> {
    let scopes = [
        wgpu::ErrorFilter::Internal,
        wgpu::ErrorFilter::OutOfMemory,
        wgpu::ErrorFilter::Validation,
    ]
    .map(|filter| device.push_error_scope(filter));
    let value = run();
    let mut error = None;
    for scope in scopes.into_iter().rev() {
        error = error.or(at_once(scope.pop()).flatten());
    }
    match error {
        Some(error) => Err(one_line(&error.to_string())),
        None => Ok(value),
    }
}

/// The value of a future that is ready, as those of the error scopes are outside of browsers.
fn at_once<T>(future: impl Future<Output = T>) -> Option<T> {
    let mut context = std::task::Context::from_waker(std::task::Waker::noop());
    match std::pin::pin!(future).poll(&mut context) {
        std::task::Poll::Ready(value) => Some(value),
        std::task::Poll::Pending => None,
    }
}

/// An error of wgpu in one line: what caused it, without the headings.
fn one_line(text: &str) -> String {
    let causes = text
        .split_once("Caused by:")
        .map_or(text, |(_, causes)| causes);
    let lines: Vec<_> = causes
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .collect();
    lines.join(": ")
}
