//! The normalised information distance of gradient orientations: light changes how strong an edge is,
//! and which side of it is the brighter one, but not where it points.
//!
//! NID, the distance that Pascoe, Maddern, Tanner, Piniés and Newman search with in *NID-SLAM: Robust
//! Monocular SLAM using Normalised Information Distance*, CVPR 2017, taken over orientations instead
//! of grey values.

use std::f32::consts::PI;

use image::Luma;

use super::{Cost, Entropies, Entry, MIN_ENTROPY, Similarity, Statistic};
use crate::describe::parameters;
use crate::image::{FloatImage, GrayImage, gaussian_smoothed};
use crate::memo::{Key, key};

/// NID among all costs.
pub(super) const ENTRY: Entry = Entry {
    name: "nid",
    about: "normalised information distance of gradient orientations",
    sees: "orientation",
    is_smooth: false,
    similarity: Some(Similarity { name: "shared information", formula: "I(Q,S) / H(Q,S)" }),
    make: || Box::new(Orientation::default()),
};

parameters! {
    /// NID = (H(S,Q) − I(S,Q)) / H(S,Q) of the orientations, modulo 180°.
    #[derive(Clone, Debug, PartialEq)]
    pub struct Orientation {
        /// Standard deviation of the Gaussian that smooths both photos before they are
        /// differentiated.
        pub sigma_px: f64 = 1.5 => number("sigma", "px", 0.0..=20.0),
        /// Bins per axis of the joint histogram. The first one holds what has no orientation.
        pub bins: usize = 9 => count("bins", "", 3..=64),
        /// Least gradient that has an orientation.
        pub least_gradient: f64 = 2.0 => number("least_gradient", "grey values per px", 0.0..=100.0),
    }
}

impl Orientation {
    /// The orientation of the smoothed photo's gradient as a value 0 … 255: flat places fall into the
    /// first of [`Self::bins`] equal intervals, angles from 0 to 180° into the others.
    fn channel(&self, photo: &GrayImage) -> FloatImage {
        let smooth = gaussian_smoothed(photo, self.sigma_px);
        let (width, height) = smooth.dimensions();
        let first = 256.0 / self.bins as f32;
        let least = self.least_gradient as f32;
        let at = |x: u32, y: u32| smooth.get_pixel(x, y).0[0];
        FloatImage::from_fn(width, height, |x, y| {
            let (left, right) = (x.saturating_sub(1), (x + 1).min(width - 1));
            let (up, down) = (y.saturating_sub(1), (y + 1).min(height - 1));
            let across = 0.5 * (at(right, y) - at(left, y));
            let along = 0.5 * (at(x, down) - at(x, up));
            if across.hypot(along) < least {
                return Luma([0.5 * first]);
            }
            let turn = along.atan2(across).rem_euclid(PI) / PI;
            Luma([(first + turn * (256.0 - first)).min(255.0)])
        })
    }
}

impl Cost for Orientation {
    fn query_channel(&self, photo: &GrayImage) -> FloatImage {
        self.channel(photo)
    }

    fn query_channel_key(&self) -> Key {
        self.reference_channel_key()
    }

    /// Between two orientations lies no third that the photo shows: that of the nearest pixel counts.
    fn reference_channel<'a>(
        &self,
        photo: &'a GrayImage,
    ) -> Box<dyn Fn(f32, f32) -> f32 + Sync + 'a> {
        let channel = self.channel(photo);
        let (last_x, last_y) = (channel.width() - 1, channel.height() - 1);
        Box::new(move |x, y| {
            let nearest = |value: f32, last: u32| (value.round().max(0.0) as u32).min(last);
            channel.get_pixel(nearest(x, last_x), nearest(y, last_y)).0[0]
        })
    }

    fn reference_channel_key(&self) -> Key {
        key(self)
    }

    fn statistic(&self) -> Statistic<'_> {
        Statistic::Histogram { bins: self.bins, cost: distance }
    }
}

/// NID in 0 … 1; `None` where an image is constant.
fn distance(entropies: &Entropies) -> Option<f64> {
    let share = entropies.mutual_information() / entropies.joint;
    let smaller = entropies.query.min(entropies.synthetic);
    (smaller > MIN_ENTROPY).then(|| 1.0 - share.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::IntensityPair;

    fn stripes(angle: f32, contrast: f32) -> GrayImage {
        let (sin, cos) = angle.sin_cos();
        GrayImage::from_fn(64, 64, |x, y| {
            let phase = 0.4 * (x as f32 * cos + y as f32 * sin);
            Luma([(128.0 + contrast * phase.sin()) as u8])
        })
    }

    fn bin_of(photo: &GrayImage) -> usize {
        let cost = Orientation::default();
        let channel = cost.channel(photo);
        let mut counts = [0; 9];
        for y in 8..56 {
            for x in 8..56 {
                counts[(channel.get_pixel(x, y).0[0] * 9.0 / 256.0) as usize] += 1;
            }
        }
        let oriented = (1..9).max_by_key(|&bin| counts[bin]);
        oriented.expect("there are bins")
    }

    #[test]
    fn stripes_point_where_they_change_whatever_their_contrast() {
        // Eight bins of 22.5°, from 0 on.
        for (degrees, bin) in [(10.0_f32, 1), (55.0, 3), (100.0, 5), (170.0, 8)] {
            for contrast in [100.0, -100.0, 30.0] {
                let photo = stripes(degrees.to_radians(), contrast);
                assert_eq!(bin_of(&photo), bin, "{degrees} {contrast}");
            }
        }
    }

    #[test]
    fn a_flat_photo_has_no_orientation_and_no_cost() {
        let cost = Orientation::default();
        let flat = GrayImage::from_pixel(20, 10, Luma([77]));
        let channel = cost.channel(&flat);
        let pairs: Vec<_> = channel
            .pixels()
            .map(|pixel| IntensityPair { query: pixel.0[0], synthetic: pixel.0[0] })
            .collect();
        assert!(pairs.iter().all(|pair| pair.query < 256.0 / 9.0));
        assert_eq!(cost.statistic().cost(&pairs), None);
    }
}
