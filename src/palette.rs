//! The colours of the window, recordings, plots and reports. Each has one meaning everywhere. They are
//! distinguishable for colour-blind readers (after Okabe and Ito), and a name, label or shape always carries the
//! same information.

use crate::diagnosis::Grade;
use crate::estimator;
use crate::features::FeatureState;
use crate::method::Method;

/// An RGB triple.
pub type Rgb = [u8; 3];

/// A reference.
pub const REFERENCE: Rgb = [0x00, 0x72, 0xB2];
/// An estimate, and wrong results.
pub const ESTIMATE: Rgb = [0xE4, 0x57, 0x2E];
/// The truth, and right results.
pub const TRUTH: Rgb = [0x1F, 0xB5, 0x8A];
/// A result without a pose or without a measured error.
pub const NO_POSE: Rgb = [0x80; 3];
/// Undecided matches and references.
pub const UNDECIDED: Rgb = [0xCC, 0x79, 0xA7];
/// What is selected or can be clicked, and nothing else.
pub const ACCENT: Rgb = [0x8F, 0x8C, 0xF0];
/// Empty parts of a picture.
pub const NOTHING: Rgb = [0x18, 0x18, 0x18];

/// A position whose view covers too little to be eligible.
pub const INELIGIBLE: Rgb = [70; 3];

/// The colour of a state, by its position in [`FeatureState::NAMES`].
pub const STATES: [Rgb; FeatureState::NAMES.len()] =
    [[0x80, 0x80, 0x80], [0x56, 0xB4, 0xE9], [0xF0, 0xE4, 0x42], ESTIMATE, TRUTH];

/// The colours of methods, in the order of the registry; those after the paper's repeat.
const METHODS: [Rgb; 6] = [
    [0x56, 0xB4, 0xE9],
    [0xE6, 0x9F, 0x00],
    [0xCC, 0x79, 0xA7],
    [0x80, 0x80, 0x80],
    [0xF0, 0xE4, 0x42],
    [0x8D, 0xD3, 0xC7],
];

/// The colours of verdicts in bars, pale enough for black text; neighbours differ in lightness.
const VERDICTS: [Rgb; 6] = [
    [0x8C, 0xC5, 0xE3],
    [0xF0, 0xC5, 0x71],
    [0x59, 0xA8, 0x9C],
    [0xF2, 0xA0, 0x8D],
    [0xC8, 0xC8, 0xC8],
    [0xB0, 0x9C, 0xD8],
];

/// The colour of a method. Other systems come after all built-in methods.
pub fn method(method: Method) -> Rgb {
    let place = estimator::methods().position(|known| known == method);
    let place = place.unwrap_or_else(|| estimator::all().len());
    let paper = Method::PAPER.len();
    match METHODS.get(place) {
        Some(&color) => color,
        None => METHODS[paper + (place - paper) % (METHODS.len() - paper)],
    }
}

/// The colour of a grade.
pub fn grade(grade: Grade) -> Rgb {
    match grade {
        Grade::Right => TRUTH,
        Grade::Wrong => ESTIMATE,
        Grade::NoPose | Grade::Unmeasured => NO_POSE,
    }
}

/// The colour of the nth verdict of a plot.
pub fn verdict(number: usize) -> Rgb {
    VERDICTS[number % VERDICTS.len()]
}

/// A shade that is readable as text on a light background.
pub fn dark(color: Rgb) -> Rgb {
    mix(color, [0; 3], 0.4)
}

/// A tint that is readable as text on a dark background.
pub fn light(color: Rgb) -> Rgb {
    mix(color, [255; 3], 0.5)
}

/// Viridis, for costs and shares: dark blue (0), green, yellow (1).
pub fn viridis(value: f64) -> Rgb {
    on(colorous::VIRIDIS, value)
}

/// Turbo, for depths and heights: dark blue (0), green, dark red (1).
pub fn turbo(value: f64) -> Rgb {
    on(colorous::TURBO, value)
}

/// The range of depths with distinct colours \[m\].
const DEPTH_RANGE_M: (f64, f64) = (2.0, 80.0);

/// The position of a depth \[m\] on the colour scale, 0 … 1, by logarithm.
pub fn depth_share(depth_m: f64) -> f64 {
    let (near, far) = DEPTH_RANGE_M;
    (depth_m.clamp(near, far) / near).ln() / (far / near).ln()
}

/// The colour of a depth \[m\] in the pictures of a run.
pub fn depth(depth_m: f64) -> Rgb {
    turbo(depth_share(depth_m))
}

/// The ends of [`diverging`].
const DIVERGING: [Rgb; 2] = [[0x00, 0x72, 0xB2], [0xD5, 0x5E, 0x00]];

/// Blue (−1), white (0), vermilion (1).
pub fn diverging(value: f64) -> Rgb {
    let end = DIVERGING[usize::from(value >= 0.0)];
    mix([255; 3], end, value.abs().min(1.0))
}

/// The colour at a position 0 … 1 of a gradient; black for NaN.
fn on(gradient: colorous::Gradient, value: f64) -> Rgb {
    if value.is_nan() {
        return [0; 3];
    }
    gradient.eval_continuous(value.clamp(0.0, 1.0)).as_array()
}

fn mix(from: Rgb, to: Rgb, share: f64) -> Rgb {
    std::array::from_fn(|channel| {
        let (from, to) = (f64::from(from[channel]), f64::from(to[channel]));
        (from + share * (to - from)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_have_colours_by_their_logarithm_and_ends_that_bear_any_depth() {
        assert_eq!(depth(0.1), turbo(0.0));
        assert_eq!(depth(500.0), turbo(1.0));
        assert_eq!(depth_share(-1.0), 0.0);
        assert!((depth_share((2.0_f64 * 80.0).sqrt()) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn the_colour_maps_meet_their_ends_and_bear_any_number() {
        assert_eq!(viridis(0.0), [68, 1, 84]);
        assert_eq!(viridis(7.0), [253, 231, 37]);
        assert_eq!(viridis(f64::NAN), [0; 3]);
        assert_eq!(diverging(0.0), [255; 3]);
        assert_eq!([diverging(-3.0), diverging(1.0)], DIVERGING);
    }

    /// Linear RGB as people without red or green cones see it (Machado, Oliveira, Fernandes 2009, severity 1).
    const COLOUR_BLIND: [[[f64; 3]; 3]; 2] = [
        [
            [0.152_286, 1.052_583, -0.204_868],
            [0.114_503, 0.786_281, 0.099_216],
            [-0.003_882, -0.048_116, 1.051_998],
        ],
        [
            [0.367_322, 0.860_646, -0.227_968],
            [0.280_085, 0.672_501, 0.047_413],
            [-0.011_820, 0.042_940, 0.968_881],
        ],
    ];

    fn times(matrix: &[[f64; 3]; 3], vector: [f64; 3]) -> [f64; 3] {
        matrix.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
    }

    /// CIE L*a*b* of a colour, for a white of D65.
    fn lab(color: Rgb, seen_by: Option<&[[f64; 3]; 3]>) -> [f64; 3] {
        const XYZ: [[f64; 3]; 3] = [
            [0.412_456_4, 0.357_576_1, 0.180_437_5],
            [0.212_672_9, 0.715_152_2, 0.072_175_0],
            [0.019_333_9, 0.119_192_0, 0.950_304_1],
        ];
        let linear = color.map(|channel| {
            let share = f64::from(channel) / 255.0;
            if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
        });
        let seen = seen_by.map_or(linear, |matrix| times(matrix, linear));
        let [x, y, z] = times(&XYZ, seen.map(|channel| channel.clamp(0.0, 1.0)));
        let [x, y, z] = [x / 0.950_47, y, z / 1.088_83].map(|share| {
            if share > 0.008_856 { share.cbrt() } else { 7.787 * share + 16.0 / 116.0 }
        });
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    #[test]
    fn colours_stay_apart_for_colour_blind_eyes() {
        // Four times what can just be seen.
        const MIN: f64 = 9.2;
        let of_methods = Method::PAPER.map(|own| ("method", method(own)));
        let grades = [("right", TRUTH), ("wrong", ESTIMATE), ("selected", ACCENT)];
        let colors = of_methods.into_iter().chain(grades);
        let colors: Vec<(&str, Rgb)> = colors.collect();
        let eyes = COLOUR_BLIND.iter().map(Some).chain([None]);
        for eye in eyes {
            for (at, (name, color)) in colors.iter().enumerate() {
                for (other, second) in &colors[at + 1..] {
                    let (a, b) = (lab(*color, eye), lab(*second, eye));
                    let apart = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
                    assert!(apart >= MIN, "{name} {color:?} and {other} {second:?}: {apart:.1}");
                }
            }
        }
        // White has the lightness 100 by definition.
        assert!((lab([255; 3], None)[0] - 100.0).abs() < 0.01);
    }
}
