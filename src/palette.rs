//! The colours of recordings and of the window. Those of the cameras and states stay apart for
//! colour-blind eyes (after Okabe and Ito), and nothing is told by hue alone: names, labels and
//! shapes say the same.

use crate::features::FeatureState;

/// An RGB triple.
pub(crate) type Rgb = [u8; 3];

pub(crate) const REFERENCE: Rgb = [0x00, 0x72, 0xB2];
pub(crate) const ESTIMATE: Rgb = [0xD5, 0x5E, 0x00];
pub(crate) const TRUTH: Rgb = [0x00, 0x9E, 0x73];
/// What is not decided yet.
pub(crate) const UNDECIDED: Rgb = [0xCC, 0x79, 0xA7];
/// Where a picture shows nothing.
pub(crate) const NOTHING: Rgb = [0x18, 0x18, 0x18];

/// The colour of a state, by its position in [`FeatureState::NAMES`].
pub(crate) const STATES: [Rgb; FeatureState::NAMES.len()] = [
    [0x80, 0x80, 0x80],
    [0x56, 0xB4, 0xE9],
    [0xF0, 0xE4, 0x42],
    ESTIMATE,
    TRUTH,
];

/// A tint that can be read as text on a dark ground.
pub(crate) fn light(color: Rgb) -> Rgb {
    mix(color, [255; 3], 0.5)
}

/// Viridis, for costs and shares: from dark blue (0) over green to yellow (1).
pub(crate) fn viridis(value: f64) -> Rgb {
    on(colorous::VIRIDIS, value)
}

/// Turbo, for depths and heights: from dark blue (0) over green to dark red (1).
#[cfg(feature = "app")]
pub(crate) fn turbo(value: f64) -> Rgb {
    on(colorous::TURBO, value)
}

/// The nearest and the farthest depth that have colours of their own \[m\].
#[cfg(feature = "app")]
const DEPTH_RANGE_M: (f64, f64) = (2.0, 80.0);

/// The place of a depth \[m\] among the colours of depths, 0 … 1: by its logarithm, because a metre
/// means less far away.
#[cfg(feature = "app")]
pub(crate) fn depth_share(depth_m: f64) -> f64 {
    let (near, far) = DEPTH_RANGE_M;
    (depth_m.clamp(near, far) / near).ln() / (far / near).ln()
}

/// The colour of a depth \[m\] in the pictures of a run.
#[cfg(feature = "app")]
pub(crate) fn depth(depth_m: f64) -> Rgb {
    turbo(depth_share(depth_m))
}

/// From blue (−1) over white (0) to vermillion (1).
pub(crate) fn diverging(value: f64) -> Rgb {
    let end = if value < 0.0 { REFERENCE } else { ESTIMATE };
    mix([255; 3], end, value.abs().min(1.0))
}

/// The colour at a place 0 … 1 of a gradient; black for NaN.
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

    #[cfg(feature = "app")]
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
        assert_eq!(diverging(-3.0), REFERENCE);
        assert_eq!(diverging(1.0), ESTIMATE);
    }
}
