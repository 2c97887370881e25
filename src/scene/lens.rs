//! Lens distortion, removed when a photo is read: everything else assumes pinhole cameras.

mod distortion;

use std::sync::Arc;

use nalgebra::Point2;
use rayon::prelude::*;

pub(super) use self::distortion::Distortion;
use super::PixelMap;
use super::file_scene::Develop;
use crate::camera::Intrinsics;
use crate::image::{GrayImage, Photo, RgbImage, cubic_interpolated};

/// A camera with distortion, and the pinhole camera of its undistorted photos.
#[derive(Clone, Debug)]
pub(super) struct Lens {
    source: Intrinsics,
    distortion: Distortion,
    pinhole: Intrinsics,
}

impl Lens {
    /// The greatest magnification of a photo to avoid a blank border.
    const MAX_ZOOM: f64 = 2.0;

    /// The pinhole camera has the photo's size and principal point. Its focal length is that of the photo, or a greater
    /// one to avoid a blank border, which would be an edge that the world does not have. So the middle of a fisheye photo
    /// keeps its scale, and its border is cut off.
    ///
    /// # Errors
    /// Why the coefficients are invalid.
    pub fn new(source: Intrinsics, distortion: Distortion) -> Result<Self, String> {
        let with_zoom = |zoom: f64| Self {
            source,
            distortion,
            pinhole: Intrinsics { fx: source.fx * zoom, fy: source.fy * zoom, ..source },
        };
        let (mut blank, mut full) = (1.0, Self::MAX_ZOOM);
        let widest = with_zoom(full);
        if !widest.has_no_blank() {
            return Err(format!("a distortion that can be removed expected, {distortion} found"));
        }
        if with_zoom(blank).has_no_blank() {
            return Ok(with_zoom(blank));
        }
        // Accurate to a hundredth of a pixel at the border.
        while full - blank > 1e-6 {
            let middle = f64::midpoint(blank, full);
            if with_zoom(middle).has_no_blank() {
                full = middle;
            } else {
                blank = middle;
            }
        }
        Ok(with_zoom(full))
    }

    /// The pixel of the original photo for one of the undistorted photo.
    fn source_pixel(&self, pixel: Point2<f64>) -> Point2<f64> {
        let direction = self.pinhole.unproject(&pixel, 1.0);
        let seen = self.distortion.distorted(direction.xy());
        let source = &self.source;
        Point2::new(source.fx * seen.x + source.cx, source.fy * seen.y + source.cy)
    }

    /// Whether every pixel of the undistorted photo is inside the original photo. Testing the border is enough.
    fn has_no_blank(&self) -> bool {
        let Intrinsics { width, height, .. } = self.source;
        let (right, bottom) = (f64::from(width) - 1.0, f64::from(height) - 1.0);
        let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)];
        let slant = |(x, y)| {
            let ray = self.pinhole.unproject(&Point2::new(x, y), 1.0);
            ray.xy().coords.norm()
        };
        let radius = corners.map(slant).into_iter().fold(0.0, f64::max);
        let steps = |last: f64| (0..=256).map(move |i| last * f64::from(i) / 256.0);
        let horizontal = steps(right).flat_map(|x| [(x, 0.0), (x, bottom)]);
        let vertical = steps(bottom).flat_map(|y| [(0.0, y), (right, y)]);
        self.distortion.is_sound_within(radius)
            && horizontal.chain(vertical).all(|(x, y)| {
                let pixel = self.source_pixel(Point2::new(x, y));
                self.source.contains(&pixel)
            })
    }

    fn resampled(&self, image: &GrayImage) -> GrayImage {
        let (width, height) = image.dimensions();
        let mut values = vec![0; width as usize * height as usize];
        let rows = values.par_chunks_mut(width.max(1) as usize);
        rows.enumerate().for_each(|(y, row)| {
            for (x, value) in row.iter_mut().enumerate() {
                let pixel = self.source_pixel(Point2::new(x as f64, y as f64));
                let gray = cubic_interpolated(image, pixel.x as f32, pixel.y as f32);
                *value = gray.round() as u8;
            }
        });
        GrayImage::from_raw(width, height, values).unwrap_or_default()
    }
}

impl PixelMap for Lens {
    fn to_photo(&self, in_file: Point2<f64>) -> Option<Point2<f64>> {
        let Intrinsics { fx, fy, cx, cy, .. } = self.source;
        let seen = Point2::new((in_file.x - cx) / fx, (in_file.y - cy) / fy);
        let direction = self.distortion.direction(seen)?;
        let pinhole = &self.pinhole;
        Some(Point2::new(
            pinhole.fx * direction.x + pinhole.cx,
            pinhole.fy * direction.y + pinhole.cy,
        ))
    }

    fn to_file(&self, in_photo: Point2<f64>) -> Point2<f64> {
        self.source_pixel(in_photo)
    }
}

impl Develop for Lens {
    /// The undistorted photo, by cubic convolution.
    fn developed(&self, image: Photo) -> Photo {
        match &image.color {
            Some(color) => {
                let channel = |c: usize| {
                    let values = color.pixels().map(|pixel| pixel.0[c]).collect();
                    GrayImage::from_raw(color.width(), color.height(), values)
                };
                let channels =
                    [0, 1, 2].map(|c| self.resampled(&channel(c).unwrap_or_default()).into_raw());
                let [red, green, blue] = &channels;
                let values = red.iter().zip(green).zip(blue);
                let values = values.flat_map(|((r, g), b)| [*r, *g, *b]).collect();
                let color = RgbImage::from_raw(color.width(), color.height(), values);
                Photo::from_color(color.unwrap_or_default())
            }
            None => Photo::from_gray(self.resampled(&image.gray)),
        }
    }

    fn pixel_map(&self) -> Option<Arc<dyn PixelMap>> {
        Some(Arc::new(self.clone()))
    }
}

/// The camera `fx fy cx cy` \[px\] of photos of a size, with pixel centres at integers.
pub(super) fn pinhole(
    [fx, fy, cx, cy]: [f64; 4],
    (width, height): (u32, u32),
) -> Result<Intrinsics, String> {
    let is_length = |length: f64| length.is_finite() && length > 0.0;
    if !is_length(fx) || !is_length(fy) || !(cx + cy).is_finite() {
        return Err(format!(
            "positive focal lengths fx, fy and a centre cx, cy expected, {fx} {fy} {cx} {cy} found"
        ));
    }
    Ok(Intrinsics { fx, fy, cx, cy, width, height })
}

/// The camera of undistorted photos, and what undistorts them; `None` without distortion.
pub(super) fn developed_camera(
    taken: Intrinsics,
    distortion: Distortion,
) -> Result<(Intrinsics, Option<Arc<dyn Develop>>), String> {
    if distortion == Distortion::None {
        return Ok((taken, None));
    }
    let lens = Lens::new(taken, distortion)?;
    if distortion.is_fisheye() {
        let across = 2.0 * (f64::from(taken.width) / 2.0 / lens.pinhole.fx).atan().to_degrees();
        log::info!(
            "a fisheye camera ({distortion}): its photos become those of a pinhole camera of {across:.0}° across; what \
             is farther to the side is cut off"
        );
    }
    Ok((lens.pinhole, Some(Arc::new(lens))))
}

#[cfg(test)]
mod tests;
