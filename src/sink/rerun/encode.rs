//! Pictures as they are recorded: photos as JPEG, synthetic ones as PNG, so that a recording stays
//! small.

use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{DynamicImage, ImageResult};
use rerun::EncodedImage;
use rerun::components::MediaType;

/// An image ready to be recorded, or why there is none.
pub(super) type Encoded = ImageResult<EncodedImage>;

/// 85 halves the size of 95 and shows no blocks at the viewer's magnifications.
const JPEG_QUALITY: u8 = 85;

/// Encodes a picture as a photo, with small losses.
pub(super) fn jpeg(image: &DynamicImage) -> Encoded {
    let mut bytes = Vec::new();
    image.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY))?;
    Ok(EncodedImage::from_file_contents(bytes).with_media_type(MediaType::jpeg()))
}

/// Encodes a picture without losses.
pub(super) fn png(image: impl Into<DynamicImage>) -> Encoded {
    let mut bytes = Vec::new();
    // Scattered pixels have no gradient that a filter could predict.
    let encoder =
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::NoFilter);
    image.into().write_with_encoder(encoder)?;
    Ok(EncodedImage::from_file_contents(bytes).with_media_type(MediaType::png()))
}
