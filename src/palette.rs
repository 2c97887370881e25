//! The colours of recordings and of the window. Those of the cameras and states stay apart for
//! colour-blind eyes (after Okabe and Ito), and nothing is told by hue alone: names, labels and
//! shapes say the same.

use crate::event::FeatureState;

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
