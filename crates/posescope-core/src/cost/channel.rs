//! What a cost looks at in a photo.

use std::fmt;

use crate::image::{FloatImage, GrayImage, cubic_interpolated, gaussian_smoothed};
use crate::memo::{Key, key};

/// What a cost looks at in the query.
///
/// How the image is made and what it depends on belong together: images are cached by the latter.
pub struct QueryChannel<'a> {
    pub(crate) key: Key,
    make: Box<dyn Fn(&GrayImage) -> FloatImage + 'a>,
}

impl<'a> QueryChannel<'a> {
    /// The image that `make` makes of a photo, each pixel 0 … 255. `depends_on` names it and holds all
    /// that it depends on beside the photo: costs for which it is equal share one image.
    pub fn new(depends_on: impl fmt::Debug, make: impl Fn(&GrayImage) -> FloatImage + 'a) -> Self {
        Self { key: key(depends_on), make: Box::new(make) }
    }

    /// The grey values, smoothed by a Gaussian of this standard deviation \[px\].
    pub fn smoothed(sigma_px: f64) -> Self {
        Self::new(("grey", sigma_px), move |photo| gaussian_smoothed(photo, sigma_px))
    }

    /// That of a photo.
    pub fn of(&self, photo: &GrayImage) -> FloatImage {
        (self.make)(photo)
    }
}

/// The value 0 … 255 at a place between the pixels of a photo \[px\].
pub type ValueAt<'p> = Box<dyn Fn(f32, f32) -> f32 + Sync + 'p>;

/// What a cost colours the cloud with before views of it are rendered.
///
/// How it is made and what it depends on belong together: coloured clouds are cached by the latter.
pub struct ReferenceChannel<'a> {
    pub(crate) key: Key,
    make: Box<dyn for<'p> Fn(&'p GrayImage) -> ValueAt<'p> + 'a>,
}

impl<'a> ReferenceChannel<'a> {
    /// The values that `make` makes of the reference photo. `depends_on` names them and holds all that
    /// they depend on beside the photo: costs for which it is equal share one coloured cloud.
    pub fn new(
        depends_on: impl fmt::Debug,
        make: impl for<'p> Fn(&'p GrayImage) -> ValueAt<'p> + 'a,
    ) -> Self {
        Self { key: key(depends_on), make: Box::new(make) }
    }

    /// The grey values, by cubic convolution between the pixels.
    pub fn grey() -> Self {
        Self::new("grey", |photo| Box::new(move |x, y| cubic_interpolated(photo, x, y)))
    }

    /// That of a photo.
    pub fn of<'p>(&self, photo: &'p GrayImage) -> ValueAt<'p> {
        (self.make)(photo)
    }
}
