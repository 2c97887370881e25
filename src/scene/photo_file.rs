//! Photo files. Their content decides the format, not their names.

mod gray_range;

use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};

use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder as _, ImageReader};
use posescope_core::files;
use posescope_core::image::MAX_PIXELS;

pub(super) use self::gray_range::{GrayRange, photo};
use super::SceneError;
use super::exif::Exif;

/// The photos whose headers decide a size.
const SAMPLE: usize = 9;

/// The size of an image \[px\], from its header alone.
pub(super) fn dimensions(path: &Path) -> Result<(u32, u32), SceneError> {
    let size = reader(path)?.into_dimensions().map_err(SceneError::image(path))?;
    expect_few_pixels(path, size)
}

/// The size that most of some photos have, and the first photo of this size. A few others may be broken.
/// There must be one at least.
pub(super) fn common_size<'a>(photos: &'a [PathBuf]) -> Result<((u32, u32), &'a Path), SceneError> {
    let steps = photos.len().div_ceil(SAMPLE).max(1);
    let sizes = |path: &'a PathBuf| Some((dimensions(path).ok()?, path.as_path()));
    let read: Vec<((u32, u32), &Path)> = photos.iter().step_by(steps).filter_map(sizes).collect();
    let count = |size: (u32, u32)| read.iter().filter(|(other, _)| *other == size).count();
    let most = read.iter().map(|(size, _)| count(*size)).max();
    match read.iter().find(|(size, _)| Some(count(*size)) == most) {
        Some(found) => Ok(*found),
        None => Ok((dimensions(&photos[0])?, &photos[0])),
    }
}

/// Whether the content of a file is an image.
pub(super) fn is_image(path: &Path) -> bool {
    reader(path).is_ok()
}

/// Refuses an image that would take more memory than any photo: a small file may have a billion pixels.
fn expect_few_pixels(path: &Path, (width, height): (u32, u32)) -> Result<(u32, u32), SceneError> {
    if u64::from(width) * u64::from(height) <= MAX_PIXELS {
        return Ok((width, height));
    }
    let expected = format!(
        "a photo of at most {MAX_PIXELS} pixels expected, {width}x{height} found; scale the photos and their camera"
    );
    Err(SceneError::expected(path, expected))
}

/// Decodes an image with values of any kind.
pub(super) fn decode_any(path: &Path) -> Result<DynamicImage, SceneError> {
    let error = SceneError::image(path);
    let decoder = reader(path)?.into_decoder().map_err(error)?;
    expect_few_pixels(path, decoder.dimensions())?;
    // Eight bytes for each pixel: four values of 16 bits.
    if decoder.total_bytes() > 8 * MAX_PIXELS {
        let expected =
            format!("an image of at most {} bytes expected when decoded", 8 * MAX_PIXELS);
        return Err(SceneError::expected(path, expected));
    }
    DynamicImage::from_decoder(decoder).map_err(SceneError::image(path))
}

/// Decodes a photo.
pub(super) fn decode(path: &Path) -> Result<DynamicImage, SceneError> {
    let image = decode_any(path)?;
    if matches!(image, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_)) {
        let expected = "a photo with values of 8 or 16 bits expected, floating-point values found; \
                        convert it, for example by `magick a.tif -depth 16 a.png`";
        return Err(SceneError::expected(path, expected));
    }
    Ok(image)
}

fn reader(path: &Path) -> Result<ImageReader<BufReader<File>>, SceneError> {
    let io = SceneError::io(path);
    let mut file = BufReader::new(files::open(path).map_err(io)?);
    if let Some((format, command)) = unread_format(file.fill_buf().map_err(io)?) {
        let expected = format!(
            "a photo in PNG, JPEG, TIFF or WebP format expected, {format} found; convert it, for example by `{command}`"
        );
        return Err(SceneError::expected(path, expected));
    }
    let reader = ImageReader::new(file).with_guessed_format().map_err(io)?;
    if reader.format().is_none() {
        let expected = "a photo in PNG, JPEG, TIFF or WebP format expected, other content found";
        return Err(SceneError::expected(path, expected));
    }
    Ok(reader)
}

/// The name of a common format that is not read, and a command that converts it.
fn unread_format(start: &[u8]) -> Option<(&'static str, &'static str)> {
    let is_at = |at: usize, what: &[u8]| start.get(at..).is_some_and(|rest| rest.starts_with(what));
    let brands = ["heic", "heix", "heim", "heis", "hevc", "mif1", "msf1"];
    if is_at(4, b"ftypavif") {
        Some(("AVIF", "avifdec a.avif a.png"))
    } else if brands.iter().any(|brand| is_at(4, b"ftyp") && is_at(8, brand.as_bytes())) {
        Some(("HEIC", "heif-convert a.heic a.jpg"))
    } else {
        None
    }
}

/// How to turn the image of a file upright, as its EXIF data say.
pub(super) fn orientation(path: &Path) -> Orientation {
    Exif::read(path).orientation()
}

/// The size of an image after it was turned \[px\], or before.
pub(super) fn turned_size((width, height): (u32, u32), orientation: Orientation) -> (u32, u32) {
    match orientation {
        Orientation::Rotate90
        | Orientation::Rotate270
        | Orientation::Rotate90FlipH
        | Orientation::Rotate270FlipH => (height, width),
        _ => (width, height),
    }
}

/// An error if an image has another size than its camera.
pub(super) fn expect_size(
    path: &Path,
    found: (u32, u32),
    expected: (u32, u32),
) -> Result<(), SceneError> {
    if found == expected {
        return Ok(());
    }
    Err(SceneError::expected(
        path,
        format!(
            "{}x{} pixels expected by its camera, {}x{} found",
            expected.0, expected.1, found.0, found.1
        ),
    ))
}
