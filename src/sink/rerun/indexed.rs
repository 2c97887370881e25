//! Pictures of few colours, stored as palette indices: a third of the bytes to compress. In full colour, a
//! recording of the paper's four methods is 7 % larger.

use crate::cost::{IntensityPair, PhotometricWeights};
use crate::palette::{self, Rgb};
use crate::picture::{Painter, RESIDUAL_RANGE, WEIGHT_GRAYS};

/// A picture with palette indices as pixels.
pub(super) struct Indexed {
    pub(super) width: u32,
    pub(super) height: u32,
    /// At most 256 colours.
    pub(super) palette: Vec<Rgb>,
    /// Row by row.
    pub(super) indices: Vec<u8>,
}

/// The number of colour steps to either side of zero.
const STEPS: u8 = 32;

/// Query minus synthetic view, blue where the query is darker, orange where it is brighter, in steps of two grey
/// values. The scale is the same in all pictures.
pub(super) fn residual(painter: &Painter<'_>, pairs: &[IntensityPair]) -> Indexed {
    let steps = f64::from(STEPS);
    let level = |pair: &IntensityPair| {
        let share = f64::from(pair.query - pair.synthetic) / RESIDUAL_RANGE;
        // NaN gets the background colour.
        (1.0 + steps + (share.clamp(-1.0, 1.0) * steps).round()) as u8
    };
    let colors = (0..=2 * STEPS).map(|level| palette::diverging(f64::from(level) / steps - 1.0));
    Indexed {
        width: painter.view.width,
        height: painter.view.height,
        palette: std::iter::once(palette::NOTHING).chain(colors).collect(),
        indices: painter.paint(0, pairs.iter().map(level)),
    }
}

/// The pixels that the photometric cost counted (white) and ignored (grey).
pub(super) fn weights(painter: &Painter<'_>, weights: &PhotometricWeights) -> Indexed {
    let [ignored, counted] = WEIGHT_GRAYS.map(|gray| [gray; 3]);
    let levels = weights.counted.iter().map(|&counts| 1 + u8::from(counts));
    Indexed {
        width: painter.view.width,
        height: painter.view.height,
        palette: vec![[0; 3], ignored, counted],
        indices: painter.paint(0, levels),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::Power;
    use crate::render::{SplattedPixel, SyntheticView};

    fn view(count: u32) -> SyntheticView {
        let pixel = |index| SplattedPixel { index, depth: 10.0, intensity: 50.0 };
        SyntheticView { width: count, height: 1, pixels: (0..count).map(pixel).collect() }
    }

    #[test]
    fn a_difference_has_the_colour_of_the_nearest_step_and_great_ones_that_of_the_ends() {
        let differences = [-300.0, -64.0, -0.5, 0.0, 0.2, 31.7, 64.0, 300.0];
        let pairs = differences
            .map(|difference| IntensityPair { query: 100.0 + difference, synthetic: 100.0 });
        let picture = residual(&Painter::new(&view(8)), &pairs);
        assert_eq!(picture.palette.len(), 66);
        for (index, difference) in picture.indices.iter().zip(differences) {
            let color = picture.palette[usize::from(*index)];
            let exact = palette::diverging(f64::from(difference) / RESIDUAL_RANGE);
            let apart = color.iter().zip(exact).map(|(a, b)| a.abs_diff(b)).max();
            assert!(apart <= Some(4), "{difference}: {color:?}, not {exact:?}");
        }
    }

    #[test]
    fn a_pixel_that_counts_is_white_and_one_that_is_ignored_grey() {
        let shown = weights(
            &Painter::new(&view(2)),
            &PhotometricWeights { power: Power::One, threshold: 9.0, counted: vec![true, false] },
        );
        let colors = shown.indices.iter().map(|&index| shown.palette[usize::from(index)]);
        assert_eq!(colors.collect::<Vec<_>>(), [[255; 3], [90; 3]]);
    }
}
