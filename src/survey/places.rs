//! Where photos will be localised along a map.

use super::answers::Surveyed;
use super::parts::expected;
use crate::chart::{Chart, GroundAxes, Mark, Shape};
use crate::geometry::{Pose, PoseError};
use crate::method::Method;
use crate::palette;
use crate::route::from_above;
use crate::scene::Scene;
use crate::table::Table;

/// More frames say nothing new on a page.
const MOST: usize = 400;

/// A frame of the map, as if it were a query.
pub(super) struct Place<'a> {
    pub frame: &'a str,
    pub pose: Pose,
    /// The frame from which it would be localised.
    pub reference: &'a str,
    /// How far that is away \[m\].
    pub away_m: f64,
    /// How likely each method localises it.
    pub chances: Vec<(Method, f64)>,
}

impl Place<'_> {
    /// The greatest chance, and whose it is.
    pub fn best(&self) -> Option<(Method, f64)> {
        // The first of equal ones.
        let chances = self.chances.iter().rev().copied();
        chances.max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// What the methods will find along the map, of at most [`MOST`] frames; nothing where no photo was tried.
pub(super) fn predicted<'a>(
    scene: &'a dyn Scene,
    radius_m: f64,
    spacing_m: Option<f64>,
    methods: &[Surveyed],
) -> Vec<Place<'a>> {
    let tried = methods.iter().filter(|one| !one.tried.is_empty());
    let predictions: Vec<_> = tried.map(|one| (one.method, one.prediction(radius_m))).collect();
    let of = |(frame, reference): (usize, usize)| {
        let (pose, from) = (scene.pose(frame)?, scene.pose(reference)?);
        let chances = predictions.iter().map(|(method, one)| (*method, one.chance(&pose, &from)));
        let name = |frame: usize| scene.frames()[frame].as_str();
        Some(Place {
            frame: name(frame),
            pose,
            reference: name(reference),
            away_m: PoseError::between(&pose, &from).translation_m,
            chances: chances.collect(),
        })
    };
    let places = expected(scene, radius_m, spacing_m, MOST).into_iter().filter_map(of);
    places.filter(|place| !place.chances.is_empty()).collect()
}

/// A table of the places: a row for each frame, a column for each method.
pub(super) fn table(places: &[Place<'_>]) -> Table {
    let methods = places.first().map_or(&[][..], |place| &place.chances);
    let names = methods.iter().map(|(method, _)| method.to_string());
    let header = ["frame", "reference", "distance"].map(str::to_owned).into_iter().chain(names);
    let mut table = Table::new("places", "How likely photos are localised along the map", header);
    for Place { frame, reference, away_m, chances, .. } in places {
        let mut cells = vec![(*frame).to_owned(), (*reference).to_owned(), format!("{away_m:.3}")];
        cells.extend(chances.iter().map(|(_, chance)| format!("{chance:.3}")));
        table.push(cells);
    }
    table
}

/// How far the expected reference is away.
pub(super) fn from_where(spacing_m: Option<f64>, radius_m: f64) -> String {
    match spacing_m {
        Some(spacing_m) => format!("the nearest that is at least {spacing_m} m away"),
        None => format!("about {} m away", 0.5 * radius_m),
    }
}

/// From here on, a photo is likely to be localised, and from here on it may be.
const LIKELY: [f64; 2] = [0.8, 0.5];

/// The map from above, by how likely the best method localises photos. `None` for fewer than two frames.
pub(super) fn chart(places: &[Place<'_>], scene: &dyn Scene) -> Option<Chart> {
    let poses: Vec<Pose> = places.iter().map(|place| place.pose).collect();
    let at = from_above(&poses)?;
    let axes = GroundAxes::of(&at)?;
    let marks = places.iter().zip(&at).filter_map(|(place, at)| {
        let (_, chance) = place.best()?;
        let (color, filled) = match chance {
            chance if chance >= LIKELY[0] => (palette::TRUTH, true),
            chance if chance >= LIKELY[1] => (palette::TRUTH, false),
            _ => (palette::ESTIMATE, true),
        };
        let of = place.chances.iter();
        let of: Vec<String> = of
            .map(|(method, chance)| format!("{} {:.0} %", method.label(), 100.0 * chance))
            .collect();
        let Place { frame, reference, away_m, .. } = place;
        let words = format!("{frame} from {reference}, {away_m:.1} m away: {}", of.join(", "));
        Some(Mark::new(Shape::Dot { at: axes.place(at), filled }, color).titled(words))
    });
    let legend = [
        ("from 80 % on", palette::TRUTH),
        ("from 50 % (hollow)", palette::TRUTH),
        ("less", palette::ESTIMATE),
    ];
    Some(Chart {
        title: format!("How likely photos of {} are localised", scene.name()),
        marks: marks.collect(),
        x: axes.x,
        y: axes.y,
        legend: legend.map(|(name, color)| (name.to_owned(), color)).to_vec(),
    })
}

/// How many frames each method is likely to localise, and at how many it is the best.
pub(super) fn summary(places: &[Place<'_>]) -> Table {
    let header = ["method", "frames", "from 80 % on", "from 50 % on", "best of all"];
    let mut rows = Table::new("likely", "Frames by how likely they are localised", header);
    let methods = places.first().map_or(&[][..], |place| &place.chances);
    for (at, (method, _)) in methods.iter().enumerate() {
        let from = |least: f64| places.iter().filter(|one| one.chances[at].1 >= least).count();
        let best = places.iter().filter(|one| one.best().is_some_and(|best| best.0 == *method));
        rows.push([
            method.label(),
            places.len().to_string(),
            from(LIKELY[0]).to_string(),
            from(LIKELY[1]).to_string(),
            best.count().to_string(),
        ]);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_method_has_its_column_and_the_best_of_a_frame_is_counted_once() {
        let place = |frame, chances: [f64; 2]| Place {
            frame,
            pose: Pose::identity(),
            reference: "r",
            away_m: 4.5,
            chances: [Method::FB, Method::MI].into_iter().zip(chances).collect(),
        };
        let places = [
            place("a", [0.9, 0.6]),
            place("b", [0.2, 0.55]),
            // Equal ones belong to the first.
            place("c", [0.3, 0.3]),
        ];
        let csv = table(&places).to_csv();
        let expected = "frame,reference,distance,fb,mi\n\
                        a,r,4.500,0.900,0.600\n\
                        b,r,4.500,0.200,0.550\n\
                        c,r,4.500,0.300,0.300\n";
        assert_eq!(csv, expected);
        let expected = "method,frames,from 80 % on,from 50 % on,best of all\n\
                        FB,3,1,1,2\n\
                        MI,3,0,2,1\n";
        assert_eq!(summary(&places).to_csv(), expected);
        assert!(table(&[]).to_csv().starts_with("frame,reference,distance"));
    }
}
