//! A cloud on its photo.

use image::imageops;

use super::agreement::Seen;
use crate::image::{GrayImage, RgbImage};

/// The photo, darkened, with the points on it: near ones red, far ones blue.
pub(super) fn cloud_on(photo: &GrayImage, seen: &[Seen]) -> RgbImage {
    let mut canvas = image::DynamicImage::ImageLuma8(imageops::brighten(photo, -30)).into_rgb8();
    let mut depths: Vec<f64> = seen.iter().map(|seen| seen.depth).collect();
    depths.sort_by(f64::total_cmp);
    let at = |share: f64| depths.get((share * depths.len() as f64) as usize).copied();
    let (near, far) = (at(0.05).unwrap_or(1.0), at(0.95).unwrap_or(2.0));
    let radius = i64::from(photo.width() / 900);
    let mut far_first: Vec<&Seen> = seen.iter().collect();
    far_first.sort_by(|a, b| b.depth.total_cmp(&a.depth));
    for seen in far_first {
        let share = ((seen.depth / near).ln() / (far / near).ln().max(1e-6)).clamp(0.0, 1.0);
        let color = image::Rgb(warm_to_cold(share));
        let (x, y) = (seen.pixel.x.round() as i64, seen.pixel.y.round() as i64);
        for (x, y) in
            (y - radius..=y + radius).flat_map(|y| (x - radius..=x + radius).map(move |x| (x, y)))
        {
            let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else {
                continue;
            };
            if let Some(pixel) = canvas.get_pixel_mut_checked(x, y) {
                *pixel = color;
            }
        }
    }
    canvas
}

/// From red over yellow and green to blue.
fn warm_to_cold(share: f64) -> [u8; 3] {
    const STOPS: [[f64; 3]; 4] = [
        [230.0, 60.0, 40.0],
        [240.0, 220.0, 60.0],
        [60.0, 200.0, 120.0],
        [50.0, 90.0, 230.0],
    ];
    let place = share * (STOPS.len() - 1) as f64;
    let first = (place as usize).min(STOPS.len() - 2);
    let along = place - first as f64;
    let mixed =
        |channel: usize| STOPS[first][channel] * (1.0 - along) + STOPS[first + 1][channel] * along;
    [0, 1, 2].map(|channel| mixed(channel).round() as u8)
}
