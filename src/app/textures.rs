//! Pictures on the graphics card, made once for each thing that is shown.

use std::any::Any;
use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::Arc;

use egui::{ColorImage, TextureFilter, TextureHandle, TextureOptions};
use image::RgbImage;

use super::theme::rgb;

/// Frames for which an unused picture is kept: blinking must not upload it anew each time.
const KEPT_FRAMES: u64 = 120;

const OPTIONS: TextureOptions =
    TextureOptions { minification: TextureFilter::Linear, ..TextureOptions::NEAREST };

/// Textures by what they show.
#[derive(Default)]
pub struct Textures {
    entries: RefCell<HashMap<(&'static str, usize), Entry>>,
    frame: std::cell::Cell<u64>,
}

struct Entry {
    texture: TextureHandle,
    last_used: u64,
    /// Kept alive, so that its address stays its own.
    _source: Arc<dyn Any + Send + Sync>,
}

impl Textures {
    /// The texture `what` of `source`; `make` is called when it is new. Pixels are magnified as
    /// they are, so that a person can count them, and blended where they are too small to see.
    pub fn of<T: Any + Send + Sync>(
        &self,
        ctx: &egui::Context,
        what: &'static str,
        source: &Arc<T>,
        make: impl FnOnce(&T) -> ColorImage,
    ) -> TextureHandle {
        let key = (what, Arc::as_ptr(source) as usize);
        let mut entries = self.entries.borrow_mut();
        let entry = entries.entry(key).or_insert_with(|| Entry {
            texture: ctx.load_texture(what, make(source), OPTIONS),
            last_used: 0,
            _source: Arc::clone(source) as Arc<dyn Any + Send + Sync>,
        });
        entry.last_used = self.frame.get();
        entry.texture.clone()
    }

    /// Forgets what was not shown for a while.
    pub(super) fn end_frame(&self) {
        let now = self.frame.get() + 1;
        self.frame.set(now);
        self.entries.borrow_mut().retain(|_, entry| now - entry.last_used < KEPT_FRAMES);
    }
}

/// An image as egui takes it.
pub fn color_image(image: &image::DynamicImage) -> ColorImage {
    let size = [image.width() as usize, image.height() as usize];
    let pixels = image.to_rgb8();
    // Not `ColorImage::from_rgb`, which is third-party code and slow where that is not optimised.
    let pixels = pixels.pixels().map(|pixel| rgb(pixel.0)).collect();
    ColorImage::new(size, pixels)
}

/// A picture of the window's pixels; `None` where they are not as many as its size says.
pub(super) fn rgb_image(image: &ColorImage) -> Option<RgbImage> {
    let [width, height] = image.size.map(|side| side as u32);
    let bytes = image.pixels.iter().flat_map(|p| [p.r(), p.g(), p.b()]).collect();
    RgbImage::from_raw(width, height, bytes)
}
