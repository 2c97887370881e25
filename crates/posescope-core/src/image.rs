//! Photographs: loading, smoothing, interpolation.

mod degrade;

use std::io::BufReader;
use std::ops::Range;
use std::path::Path;

#[doc(hidden)]
pub use degrade::{Degradation, DegradationError};
use image::error::{LimitError, LimitErrorKind};
pub use image::{GrayImage, RgbImage};
use image::{ImageBuffer, ImageDecoder as _, Luma};
use rayon::prelude::*;

use crate::files;
use crate::input::InputError;

/// The most pixels of a photo that is read from a file: 8,192 × 8,192.
#[doc(hidden)]
pub const MAX_PIXELS: u64 = 1 << 26;

/// A grey image of real values in 0 … 255.
pub type FloatImage = ImageBuffer<Luma<f32>, Vec<f32>>;

/// A photograph: the grey values that the estimators work on, and its colours where it has any.
#[derive(Clone, Debug)]
pub struct Photo {
    /// Grey values.
    pub gray: GrayImage,
    /// Colours, for display only; `None` for a grey camera.
    pub color: Option<RgbImage>,
}

impl Photo {
    /// A photo with colours; its grey values are their luma (Rec. 601), as of Matlab's `rgb2gray`, which the
    /// paper's authors used.
    pub fn from_color(color: RgbImage) -> Self {
        let (width, height) = color.dimensions();
        let gray = GrayImage::from_fn(width, height, |x, y| Luma([luma(color.get_pixel(x, y).0)]));
        Self { gray, color: Some(color) }
    }

    /// A photo of a grey camera from its values, row by row from the top left.
    ///
    /// # Errors
    /// [`InputError::PixelCount`] when the values are not as many as the image has pixels.
    pub fn from_gray_values(width: u32, height: u32, values: Vec<u8>) -> Result<Self, InputError> {
        let given = values.len();
        let is_whole = u64::from(width) * u64::from(height) == given as u64;
        GrayImage::from_raw(width, height, values)
            .filter(|_| is_whole)
            .map(Self::from_gray)
            .ok_or(InputError::PixelCount { width, height, given })
    }

    /// A photo of a grey camera.
    pub fn from_gray(gray: GrayImage) -> Self {
        Self { gray, color: None }
    }

    /// Reads an image file of any supported format; the content decides, not the file's name.
    ///
    /// # Errors
    /// When the file cannot be read, is not an image, or has more than 67 million pixels.
    pub fn read(path: &Path) -> image::ImageResult<Self> {
        let file = BufReader::new(files::open(path)?);
        let decoder = image::ImageReader::new(file).with_guessed_format()?.into_decoder()?;
        let (width, height) = decoder.dimensions();
        if u64::from(width) * u64::from(height) > MAX_PIXELS {
            let kind = LimitErrorKind::DimensionError;
            return Err(image::ImageError::Limits(LimitError::from_kind(kind)));
        }
        let image = image::DynamicImage::from_decoder(decoder)?;
        Ok(if image.color().has_color() {
            Self::from_color(image.into_rgb8())
        } else {
            Self::from_gray(image.into_luma8())
        })
    }

    /// Width and height \[px\].
    pub fn dimensions(&self) -> (u32, u32) {
        self.gray.dimensions()
    }

    /// Memory that the pixels take \[bytes\].
    pub fn bytes(&self) -> usize {
        let color = self.color.as_ref().map_or(0, |color| color.as_raw().len());
        self.gray.as_raw().len() + color
    }
}

/// The luma of a colour (Rec. 601), rounded.
fn luma([red, green, blue]: [u8; 3]) -> u8 {
    let [red, green, blue] = [red, green, blue].map(u32::from);
    ((299 * red + 587 * green + 114 * blue + 500) / 1000) as u8
}

/// The image convolved with a Gaussian of `sigma` \[px\]; `sigma` 0 returns it as it is.
pub fn gaussian_smoothed(image: &GrayImage, sigma: f64) -> FloatImage {
    /// Rows of a band as a multiple of those it needs around it: large bands compute fewer rows twice,
    /// small ones stay in the second-level cache.
    const ROWS_A_BAND: usize = 12;
    let rows = ROWS_A_BAND * rows_around(sigma);
    let bands = (image.height() as usize).div_ceil(rows);
    smoothed_in_bands(image, sigma, bands.max(rayon::current_num_threads()))
}

/// Rows that a row depends on, to each side: more than half a kernel of `blur`, which goes 3.4 sigma to each side.
fn rows_around(sigma: f64) -> usize {
    (4.0 * sigma).ceil() as usize + 2
}

/// As [`gaussian_smoothed`], in bands of rows. Each is computed with the rows around it that it depends on,
/// so the result does not depend on their number.
fn smoothed_in_bands(image: &GrayImage, sigma: f64, bands: usize) -> FloatImage {
    let [width, height] = [image.width(), image.height()].map(|side| side as usize);
    let some_rows = |rows: Range<usize>| {
        let values = &image.as_raw()[rows.start * width..rows.end * width];
        let float = values.iter().copied().map(f32::from).collect();
        FloatImage::from_raw(width as u32, rows.len() as u32, float).expect("as many values")
    };
    if sigma <= 0.0 || width == 0 || height == 0 {
        return some_rows(0..height);
    }
    if bands <= 1 {
        return image::imageops::blur(&some_rows(0..height), sigma as f32);
    }
    let around = rows_around(sigma);
    let rows = height.div_ceil(bands);
    let mut smoothed = vec![0.0; width * height];
    let bands = smoothed.par_chunks_mut(rows * width).enumerate();
    bands.for_each(|(band, smoothed)| {
        let begin = band * rows;
        let end = begin + smoothed.len() / width;
        let first = begin.saturating_sub(around);
        let blurred =
            image::imageops::blur(&some_rows(first..(end + around).min(height)), sigma as f32);
        let own = (begin - first) * width..(end - first) * width;
        smoothed.copy_from_slice(&blurred.as_raw()[own]);
    });
    FloatImage::from_raw(width as u32, height as u32, smoothed).expect("as many values")
}

/// The grey value between pixels by cubic convolution (Catmull-Rom, a = −0.5), clamped to 0 … 255.
///
/// Beyond the border the outermost pixel is repeated; an image without pixels is black. This is the paper's
/// interpolation f of appendix B, "generation of synthetic views".
pub fn cubic_interpolated(image: &GrayImage, x: f32, y: f32) -> f32 {
    if image.is_empty() {
        return 0.0;
    }
    let (left, top) = (x.floor(), y.floor());
    let weights_x = catmull_rom_weights(x - left);
    let weights_y = catmull_rom_weights(y - top);
    let (last_x, last_y) = (image.width() as i32 - 1, image.height() as i32 - 1);
    let mut value = 0.0;
    for (row, weight_y) in weights_y.iter().enumerate() {
        let v = (top as i32).saturating_add(row as i32 - 1).clamp(0, last_y) as u32;
        for (column, weight_x) in weights_x.iter().enumerate() {
            let u = (left as i32).saturating_add(column as i32 - 1).clamp(0, last_x) as u32;
            value += weight_x * weight_y * f32::from(image.get_pixel(u, v).0[0]);
        }
    }
    value.clamp(0.0, 255.0)
}

/// Weights of the four samples at −1, 0, 1, 2 for a position `t` in 0 … 1 (Keys 1981, a = −0.5).
fn catmull_rom_weights(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        -0.5 * t + t2 - 0.5 * t3,
        1.0 - 2.5 * t2 + 1.5 * t3,
        0.5 * t + 2.0 * t2 - 1.5 * t3,
        -0.5 * t2 + 0.5 * t3,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn grey_values_are_taken_row_by_row_and_must_be_as_many_as_pixels() {
        let photo = Photo::from_gray_values(3, 2, vec![0, 1, 2, 3, 4, 5]).expect("six");
        assert_eq!(photo.gray.get_pixel(1, 1).0, [4]);
        for given in [5, 7] {
            let refused = Photo::from_gray_values(3, 2, vec![0; given]).expect_err("not six");
            let expected = format!("{given} grey values given, 3 x 2 px need 6");
            assert_eq!(refused.to_string(), expected);
        }
    }

    #[test]
    fn grey_values_of_a_colour_are_those_of_rgb2gray() {
        let colors = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255; 3], [0; 3], [10, 20, 30]];
        let image = RgbImage::from_raw(6, 1, colors.concat()).expect("six pixels");
        assert_eq!(Photo::from_color(image).gray.as_raw(), &[76, 150, 29, 255, 0, 18]);
    }

    #[test]
    fn smoothing_keeps_a_constant_and_spreads_a_dot_like_a_gaussian() {
        let constant = GrayImage::from_pixel(31, 21, Luma([200]));
        for pixel in gaussian_smoothed(&constant, 1.5).pixels() {
            assert!((pixel.0[0] - 200.0).abs() < 0.01, "{pixel:?}");
        }
        let mut dot = GrayImage::new(31, 31);
        dot.put_pixel(15, 15, Luma([255]));
        let smooth = gaussian_smoothed(&dot, 1.5);
        let sum: f32 = smooth.pixels().map(|p| p.0[0]).sum();
        assert!((sum - 255.0).abs() < 0.5, "{sum}");
        let ratio = smooth.get_pixel(17, 15).0[0] / smooth.get_pixel(15, 15).0[0];
        let expected = (-4.0_f32 / (2.0 * 1.5 * 1.5)).exp();
        assert!((ratio - expected).abs() < 0.01, "{ratio} {expected}");
    }

    #[test]
    fn cubic_interpolation_reproduces_a_ramp_and_the_pixels_themselves() {
        let ramp = GrayImage::from_fn(12, 9, |x, y| Luma([(10 * x + 5 * y) as u8]));
        assert_eq!(cubic_interpolated(&ramp, 4.0, 3.0), 55.0);
        let between = cubic_interpolated(&ramp, 4.25, 3.5);
        assert!((between - (42.5 + 17.5)).abs() < 1e-4, "{between}");
    }

    #[test]
    fn far_beyond_the_border_the_outermost_pixel_is_repeated_and_no_image_is_black() {
        let image = GrayImage::from_fn(3, 2, |x, y| Luma([(10 * x + 100 * y) as u8]));
        for (x, y, expected) in [(-3e9, -3e9, 0.0), (3e9, 3e9, 120.0), (3e9, -3e9, 20.0)] {
            assert_eq!(cubic_interpolated(&image, x, y), expected, "{x} {y}");
        }
        for (width, height) in [(0, 0), (0, 2), (3, 0)] {
            assert_eq!(cubic_interpolated(&GrayImage::new(width, height), 1.0, 1.0), 0.0);
        }
    }

    proptest! {
        #[test]
        fn smoothing_is_the_same_in_any_number_of_bands(
            width in 1_u32..40,
            height in 1_u32..60,
            seed: u32,
            sigma in prop_oneof![Just(0.0), 0.05..8.0_f64],
            bands in 2_usize..9,
        ) {
            let value = |x: u32, y: u32| (seed ^ (97 * x + y)).wrapping_mul(2_654_435_761) >> 24;
            let photo = GrayImage::from_fn(width, height, |x, y| Luma([value(x, y) as u8]));
            let bits = |image: FloatImage| -> Vec<u32> {
                image.as_raw().iter().copied().map(f32::to_bits).collect()
            };
            let whole = bits(smoothed_in_bands(&photo, sigma, 1));
            prop_assert_eq!(bits(smoothed_in_bands(&photo, sigma, bands)), whole);
        }

        #[test]
        fn catmull_rom_weights_are_a_partition_of_one(t in 0.0_f32..1.0) {
            let sum: f32 = catmull_rom_weights(t).iter().sum();
            prop_assert!((sum - 1.0).abs() < 1e-6);
        }

        #[test]
        fn cubic_interpolation_stays_in_range_anywhere(x in -20.0_f32..40.0, y in -20.0_f32..40.0) {
            let checks = GrayImage::from_fn(9, 7, |x, y| Luma([if (x + y) % 2 == 0 { 0 } else { 255 }]));
            let value = cubic_interpolated(&checks, x, y);
            prop_assert!((0.0..=255.0).contains(&value));
        }
    }
}
