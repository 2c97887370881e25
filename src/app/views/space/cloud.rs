//! The reference's cloud, in colours.

use std::sync::Arc;

use egui::Color32;
use nalgebra::Point3;

use super::gpu::{Points, Spot};
use super::progress::ends;
use super::scene_geometry::{GROUND_M, SceneGeometry};
use crate::app::theme;
use crate::problem::ReferenceTuple;
use crate::render::ColoredCloud;

/// What the colour of a point tells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Coloring {
    /// What the reference photo shows there.
    #[default]
    Photo,
    /// Height above the ground.
    Height,
    /// Distance from the reference camera.
    Depth,
}

impl Coloring {
    pub(super) const ALL: [Self; 3] = [Self::Photo, Self::Height, Self::Depth];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Photo => "photo",
            Self::Height => "height",
            Self::Depth => "depth",
        }
    }
}

/// A cloud that was made ready to be drawn, and what it was made from.
pub(super) struct PreparedCloud {
    reference: Arc<ReferenceTuple>,
    colored: Option<Arc<ColoredCloud>>,
    wanted: Coloring,
    geometry: SceneGeometry,
    pub(super) points: Arc<Points>,
    /// What the colours tell. By height instead of the photo as long as there are no such colours.
    pub(super) coloring: Coloring,
    /// The ends of the colour map \[m\].
    pub(super) range_m: (f64, f64),
}

impl PreparedCloud {
    /// Whether this is what is wanted.
    pub(super) fn is(
        &self,
        geometry: &SceneGeometry,
        reference: &Arc<ReferenceTuple>,
        colored: Option<&Arc<ColoredCloud>>,
        wanted: Coloring,
    ) -> bool {
        let same_colors = match (&self.colored, colored) {
            (Some(mine), Some(other)) => Arc::ptr_eq(mine, other),
            (None, None) => true,
            _ => false,
        };
        let needs_colors = wanted == Coloring::Photo;
        Arc::ptr_eq(&self.reference, reference)
            && self.geometry == *geometry
            && self.wanted == wanted
            && (same_colors || !needs_colors)
    }

    pub(super) fn new(
        geometry: &SceneGeometry,
        reference: &Arc<ReferenceTuple>,
        colored: Option<&Arc<ColoredCloud>>,
        wanted: Coloring,
    ) -> Self {
        let coloring = match (wanted, colored) {
            (Coloring::Photo, None) => Coloring::Height,
            _ => wanted,
        };
        let measure = |point: &Point3<f32>| match coloring {
            Coloring::Photo | Coloring::Height => GROUND_M - f64::from(point.y),
            Coloring::Depth => f64::from(point.coords.norm()),
        };
        let range_m = match coloring {
            Coloring::Photo => (0.0, 0.0),
            _ => inner_range(reference.cloud.points.iter().map(measure)),
        };
        let place = |point: &Point3<f32>| geometry.spot(&point.cast());
        let points = match (coloring, colored) {
            (Coloring::Photo, Some(colored)) => {
                Points::new(by_photo(reference, colored).map(|(point, color)| Spot {
                    at: place(point),
                    color,
                }))
            }
            _ => Points::new(reference.cloud.points.iter().map(|point| Spot {
                at: place(point),
                color: theme::turbo(share(measure(point), range_m)),
            })),
        };
        Self {
            reference: Arc::clone(reference),
            colored: colored.map(Arc::clone),
            wanted,
            geometry: *geometry,
            points: Arc::new(points),
            coloring,
            range_m,
        }
    }
}

/// All points of the scan: in the photo's colours where the photo shows them, else grey.
///
/// The coloured points are those of the scan that were seen, in the same order.
fn by_photo<'a>(
    reference: &'a ReferenceTuple,
    colored: &'a ColoredCloud,
) -> impl Iterator<Item = (&'a Point3<f32>, Color32)> {
    const UNSEEN: Color32 = Color32::from_gray(105);
    let mut seen = colored.points.iter().peekable();
    reference.cloud.points.iter().map(move |point| {
        match seen.next_if(|seen| seen.position == *point) {
            Some(seen) => {
                let gray = seen.intensity.round().clamp(0.0, 255.0) as u8;
                let color = photo_color(reference, point);
                (point, color.unwrap_or(Color32::from_gray(gray)))
            }
            None => (point, UNSEEN),
        }
    })
}

fn photo_color(reference: &ReferenceTuple, point: &Point3<f32>) -> Option<Color32> {
    let photo = reference.photo.color.as_ref()?;
    let pixel = reference.intrinsics.project(&point.cast())?;
    let nearest = |value: f64| value.round().max(0.0) as u32;
    let [r, g, b] = photo
        .get_pixel_checked(nearest(pixel.x), nearest(pixel.y))?
        .0;
    Some(Color32::from_rgb(r, g, b))
}

/// What all but the outermost two per cent lie within: a single point far up must not take the
/// colours from all others.
fn inner_range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    let rank = |values: &mut Vec<f64>, share: f64| {
        let last = values.len().checked_sub(1)?;
        let at = (share * last as f64).round() as usize;
        Some(*values.select_nth_unstable_by(at, f64::total_cmp).1)
    };
    match (rank(&mut values, 0.02), rank(&mut values, 0.98)) {
        (Some(low), Some(high)) => ends([low, high].into_iter()).unwrap_or((0.0, 1.0)),
        _ => (0.0, 1.0),
    }
}

/// How far a value is between the ends of a range; 0 where the range has no width.
pub(super) fn share(value: f64, (least, greatest): (f64, f64)) -> f64 {
    if greatest > least {
        (value - least) / (greatest - least)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stray_point_does_not_take_the_colours_from_the_others() {
        let values = (0..100).map(f64::from).chain([1e6]);
        assert_eq!(inner_range(values), (2.0, 98.0));
        assert_eq!(inner_range(std::iter::empty()), (0.0, 1.0));
        assert_eq!(inner_range([f64::NAN, 3.0].into_iter()), (3.0, 3.0));
        assert_eq!(share(3.0, (3.0, 3.0)), 0.0);
        assert_eq!(share(4.0, (2.0, 6.0)), 0.5);
    }
}
