//! The colours of recordings. They stay apart for colour-blind eyes (after Okabe and Ito), and
//! nothing is told by hue alone: names and labels say the same.

use rerun::Color;

use crate::event::FeatureState;

/// An RGB triple.
pub(super) type Rgb = [u8; 3];

pub(super) const REFERENCE: Rgb = [0x00, 0x72, 0xB2];
pub(super) const ESTIMATE: Rgb = [0xD5, 0x5E, 0x00];
pub(super) const TRUTH: Rgb = [0x00, 0x9E, 0x73];
/// What is not decided yet.
pub(super) const UNDECIDED: Rgb = [0xCC, 0x79, 0xA7];
/// Where a picture shows nothing.
pub(super) const NOTHING: Rgb = [0x18, 0x18, 0x18];

/// The colour of a state, by its position in [`FeatureState::NAMES`].
pub(super) const STATES: [Rgb; FeatureState::NAMES.len()] = [
    [0x80, 0x80, 0x80],
    [0x56, 0xB4, 0xE9],
    [0xF0, 0xE4, 0x42],
    ESTIMATE,
    TRUTH,
];

pub(super) fn color([r, g, b]: Rgb) -> Color {
    Color::from_rgb(r, g, b)
}

/// A tint that can be read as text on a dark ground.
pub(super) fn light(color: Rgb) -> Rgb {
    mix(color, [255; 3], 0.5)
}

/// From dark blue (0) over green to yellow (1): viridis, at nine of its values.
pub(super) fn viridis(value: f64) -> Rgb {
    const STOPS: [Rgb; 9] = [
        [68, 1, 84],
        [71, 44, 122],
        [59, 81, 139],
        [44, 113, 142],
        [33, 144, 141],
        [39, 173, 129],
        [92, 200, 99],
        [170, 220, 50],
        [253, 231, 37],
    ];
    let place = value.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let below = (place as usize).min(STOPS.len() - 2);
    mix(STOPS[below], STOPS[below + 1], place - below as f64)
}

/// From blue (−1) over white (0) to vermillion (1).
pub(super) fn diverging(value: f64) -> Rgb {
    let end = if value < 0.0 { REFERENCE } else { ESTIMATE };
    mix([255; 3], end, value.abs().min(1.0))
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
