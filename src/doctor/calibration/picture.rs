//! Depth edges on a photo, as stated and as found, and how the measure changes with each value.

use image::imageops;
use nalgebra::Point2;

use super::search::{Frame, POSE, Values, mean, units};
use crate::doctor::picture::dot;
use crate::image::RgbImage;
use crate::palette;
use crate::proof::{Line, Mark, Panel, ProofPicture, Thing};
use crate::scene::Scene;

/// The width of the whole picture \[px\].
const WIDTH: u32 = 1400;

/// The photo of the frame with the most depth edges: with the edges as stated above, and as found below. Beside them is
/// a curve for each value.
pub(super) fn before_and_after(scene: &dyn Scene, frames: &[Frame], found: &Values) -> RgbImage {
    let most = frames.iter().max_by_key(|frame| frame.edges.len());
    let Some((frame, photo)) = most.and_then(|most| Some((most, scene.photo(most.at).ok()?)))
    else {
        return RgbImage::default();
    };
    let dark = image::DynamicImage::ImageLuma8(imageops::brighten(&photo.gray, -40)).into_rgb8();
    let radius = i64::from(dark.width() / 900);
    let with_edges = |title: &str, values: &Values| {
        let mut canvas = dark.clone();
        for (pixel, depth) in frame.seen(values) {
            let at: Point2<i64> = pixel.map(|part| part.round() as i64);
            dot(&mut canvas, at, radius, palette::turbo(1.0 - (depth / 40.0).clamp(0.0, 1.0)));
        }
        Panel::new(title, canvas)
    };
    let name = &scene.frames()[frame.at];
    let picture = ProofPicture {
        large: with_edges(&format!("Depth edges on {name} as stated"), &Values::zeros()),
        below: Some(with_edges("As found", found)),
        beside: curves(frames, found),
    };
    let sentence = "The depth edges of the clouds (near ones red, far ones blue) should lie on edges of the photo. The \
                    curves show how strong these edges are there if one value changes: orange as stated, blue as found.";
    picture.raster(WIDTH, sentence)
}

/// The strength of the photos' edges at the depth edges by each value, the others as found.
fn curves(frames: &[Frame], found: &Values) -> Vec<Panel> {
    /// To each side of what is found, in values that move edges by a pixel.
    const REACH: f64 = 8.0;
    const STEPS: i32 = 24;
    const SIZE: [u32; 2] = [200, 70];
    const GROUND: image::Rgb<u8> = image::Rgb([0x16, 0x18, 0x1C]);
    let frames: Vec<&Frame> = frames.iter().collect();
    let unit = units(&frames);
    let degree = 1.0_f64.to_radians();
    let axes = [
        ("Turn x", "°", degree),
        ("Turn y", "°", degree),
        ("Turn z", "°", degree),
        ("Shift x", " cm", 0.01),
        ("Shift y", " cm", 0.01),
        ("Shift z", " cm", 0.01),
    ];
    let curve = |(&at, (name, symbol, one)): (&usize, (&str, &str, f64))| {
        // What was found and what is stated are both inside.
        let reach = (REACH * unit[at]).max(1.3 * found[at].abs());
        let values =
            (-STEPS..=STEPS).map(|step| found[at] + reach * f64::from(step) / f64::from(STEPS));
        let scores: Vec<(f64, f64)> = values
            .map(|value| {
                let mut changed = *found;
                changed[at] = value;
                (value, mean(&frames, &changed))
            })
            .collect();
        let least = scores.iter().map(|one| one.1).fold(f64::INFINITY, f64::min);
        let most = scores.iter().map(|one| one.1).fold(f64::NEG_INFINITY, f64::max);
        let [width, height] = SIZE.map(f64::from);
        let x = |value: f64| ((value - found[at] + reach) / (2.0 * reach) * (width - 1.0)) as f32;
        let y = |score: f64| {
            ((1.0 - (score - least) / (most - least).max(f64::MIN_POSITIVE)) * (height - 20.0)
                + 10.0) as f32
        };
        let upright = |value: f64, color| Line {
            points: vec![[x(value), 0.0], [x(value), height as f32]],
            color,
            width: 1.0,
        };
        let title =
            format!("{name} {:+.2}{symbol} (± {:.1}{symbol})", found[at] / one, reach / one);
        let mut panel = Panel::new(title, RgbImage::from_pixel(SIZE[0], SIZE[1], GROUND));
        panel.is_plain = true;
        panel.lines = vec![
            upright(0.0, STATED),
            upright(found[at], FOUND),
            Line {
                points: scores.iter().map(|&(value, score)| [x(value), y(score)]).collect(),
                color: [0xE8; 3],
                width: 2.0,
            },
        ];
        panel.marks = vec![Mark {
            at: [x(0.0), height as f32 - 4.0],
            thing: Thing::Words,
            label: "stated".to_owned(),
        }];
        panel
    };
    POSE.iter().zip(axes).map(curve).collect()
}

/// Orange and blue, which differ for everybody.
const STATED: palette::Rgb = [0xE6, 0x9F, 0x00];
const FOUND: palette::Rgb = [0x56, 0xB4, 0xE9];
