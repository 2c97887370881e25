//! Scenes at a glance: how many photos, how far the camera went, and the way that it took; the paper's
//! tables 1 and 2 and its maps of routes.

use std::path::Path;

use nalgebra::{Point2, Point3, Vector3};
use plotters::coord::Shift;
use plotters::prelude::*;

use super::paper::{self, FigureKey};
use super::report::{write, write_table};
use super::table::Table;
use super::tables::slug;
use crate::geometry::Pose;
use crate::run::FolderError;
use crate::scene::Scene;

/// What stands where there is no figure.
const NOTHING: &str = "–";
/// The longer side of a map \[px\], what stands around it, and the least of the other side.
const SIDE: f64 = 520.0;
const AROUND: (f64, f64) = (72.0, 60.0);
const LEAST_SIDE: f64 = 140.0;
/// The way, its beginning and its end: told apart by shape too.
const WAY: RGBColor = RGBColor(0x00, 0x72, 0xB2);
const BEGINNING: RGBColor = RGBColor(0x00, 0x9E, 0x73);
const END: RGBColor = RGBColor(0xD5, 0x5E, 0x00);

/// The way of a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// Where it was \[m\], frame by frame, without those whose pose nobody knows: to the right of the
    /// first frame, and ahead of it, seen from above.
    pub places: Vec<Point2<f64>>,
    /// Its length \[m\], in space.
    pub length_m: f64,
    /// The mean distance between consecutive frames \[m\].
    pub spacing_m: f64,
    /// The names of the first and the last of these frames.
    pub ends: [String; 2],
}

impl Route {
    /// The way of a scene's frames; `None` where fewer than two poses are known.
    pub fn of(scene: &dyn Scene) -> Option<Self> {
        let names = scene.frames();
        let known: Vec<(usize, Pose)> = (0..names.len())
            .filter_map(|frame| Some((frame, scene.pose(frame)?)))
            .collect();
        let [(first, start), .., (last, _)] = known.as_slice() else {
            return None;
        };
        let at = |pose: &Pose| Point3::from(pose.translation.vector);
        let steps = known.windows(2);
        let length_m: f64 = steps
            .map(|pair| (at(&pair[1].1) - at(&pair[0].1)).norm())
            .sum();
        // The world's axes are anybody's choice: what is down, the cameras know best.
        let down: Vector3<f64> = known
            .iter()
            .map(|(_, pose)| pose.rotation * Vector3::y())
            .sum();
        let down = down
            .try_normalize(1e-9)
            .unwrap_or(start.rotation * Vector3::y());
        let right = start.rotation * Vector3::x();
        let right = (right - down * down.dot(&right)).try_normalize(1e-9)?;
        let ahead = right.cross(&down);
        let origin = at(start);
        let places = known.iter().map(|(_, pose)| {
            let way = at(pose) - origin;
            Point2::new(right.dot(&way), ahead.dot(&way))
        });
        Some(Self {
            places: places.collect(),
            length_m,
            spacing_m: length_m / (known.len() - 1) as f64,
            ends: [names[*first].clone(), names[*last].clone()],
        })
    }

    /// The way from above, as SVG, as long a metre to the right as ahead.
    ///
    /// # Errors
    /// What the drawing failed at.
    pub fn map(&self, caption: &str) -> Result<String, String> {
        let mut svg = String::new();
        let bounds = Bounds::of(&self.places);
        {
            let area = SVGBackend::with_string(&mut svg, bounds.picture()).into_drawing_area();
            self.draw(&area, &bounds, caption)
                .map_err(|error| error.to_string())?;
            area.present().map_err(|error| error.to_string())?;
        }
        Ok(svg)
    }

    fn draw(
        &self,
        area: &DrawingArea<SVGBackend<'_>, Shift>,
        bounds: &Bounds,
        caption: &str,
    ) -> Result<(), Box<dyn std::error::Error>> {
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .caption(caption, ("sans-serif", 14))
            .x_label_area_size(36)
            .y_label_area_size(48)
            .build_cartesian_2d(bounds.least.x..bounds.most.x, bounds.least.y..bounds.most.y)?;
        chart
            .configure_mesh()
            .x_desc("right of the first frame (m)")
            .y_desc("ahead (m)")
            .x_labels(6)
            .y_labels(6)
            .light_line_style(WHITE)
            .draw()?;
        let places: Vec<(f64, f64)> = self.places.iter().map(|place| (place.x, place.y)).collect();
        chart.draw_series(LineSeries::new(places.iter().copied(), WAY.stroke_width(2)))?;
        let [first, last] = &self.ends;
        let text = ("sans-serif", 12).into_font().color(&BLACK);
        if let (Some(&start), Some(&end)) = (places.first(), places.last()) {
            chart.draw_series([Circle::new(start, 5, BEGINNING.filled())])?;
            chart.draw_series([TriangleMarker::new(end, 7, END.filled())])?;
            // One above and one below: a way may end where it began.
            let words = |name: &str, place, down_px| {
                EmptyElement::at(place) + Text::new(name.to_owned(), (8, down_px), text.clone())
            };
            chart.draw_series([words(first, start, -16)])?;
            chart.draw_series([words(last, end, 4)])?;
        }
        Ok(())
    }
}

/// What a map shows \[m\].
struct Bounds {
    least: Point2<f64>,
    most: Point2<f64>,
}

impl Bounds {
    /// All places with some air around them; a straight way gets a strip.
    fn of(places: &[Point2<f64>]) -> Self {
        let (mut least, mut most) = (Point2::origin(), Point2::origin());
        for place in places {
            least = least.inf(place);
            most = most.sup(place);
        }
        let middle = nalgebra::center(&least, &most);
        let longer = (most - least).max().max(1.0);
        let half = (most - least).map(|side| 0.5 * 1.12 * side.max(longer * LEAST_SIDE / SIDE));
        Self {
            least: middle - half,
            most: middle + half,
        }
    }

    /// The size of the picture \[px\] in which a metre is as long to the right as ahead.
    fn picture(&self) -> (u32, u32) {
        let sides = self.most - self.least;
        let scale = SIDE / sides.max();
        let size = |side: f64, around: f64| (side * scale + around).round() as u32;
        (size(sides.x, AROUND.0), size(sides.y, AROUND.1 + 24.0))
    }
}

/// A line for each scene, with the paper's figures where it has them.
pub fn overview(scenes: &[&dyn Scene]) -> Table {
    let papers = |scene: &dyn Scene| {
        ["images", "length_km", "spacing_m"].map(|measure| {
            let table = if scene.name().starts_with("kitti") {
                1
            } else {
                2
            };
            paper::figure(&FigureKey {
                table,
                scene: scene.name(),
                query_scene: None,
                method: "",
                radius_m: None,
                references: 1,
                fusion: None,
                measure,
            })
        })
    };
    let has_papers = scenes
        .iter()
        .any(|scene| papers(*scene).iter().any(Option::is_some));
    let mut header = vec![
        "scene",
        "images",
        "with a cloud",
        "total length (km)",
        "mean distance between consecutive images (m)",
    ];
    if has_papers {
        header.extend([
            "images (paper)",
            "total length (km) (paper)",
            "mean distance (m) (paper)",
        ]);
    }
    let mut table = Table::new("scenes", "Overview of the scenes", header);
    let number = |value: Option<f64>, decimals: usize| {
        value.map_or(NOTHING.to_owned(), |value| format!("{value:.decimals$}"))
    };
    for scene in scenes {
        let frames = scene.frames().len();
        let route = Route::of(*scene);
        let clouds = (0..frames).filter(|&frame| scene.has_cloud(frame)).count();
        let mut cells = vec![
            scene.name().to_owned(),
            frames.to_string(),
            clouds.to_string(),
            number(route.as_ref().map(|route| route.length_m / 1000.0), 3),
            number(route.as_ref().map(|route| route.spacing_m), 2),
        ];
        if has_papers {
            let [images, length_km, spacing_m] = papers(*scene);
            cells.extend([
                number(images, 0),
                number(length_km, 1),
                number(spacing_m, 1),
            ]);
        }
        table.push(cells);
    }
    table
}

/// Writes the table and the map of each route into a folder, as a run folder has tables and plots.
///
/// # Errors
/// When a file cannot be written.
pub fn write_overview(
    folder: &Path,
    scenes: &[&dyn Scene],
    table: &Table,
) -> Result<(), FolderError> {
    write_table(folder, table)?;
    for scene in scenes {
        let Some(route) = Route::of(*scene) else {
            continue;
        };
        let name = format!("route-{}.svg", slug(scene.name()));
        let path = folder.join("plots").join(name);
        let svg = route.map(scene.name());
        let svg = svg.map_err(|why| FolderError::io(&path)(std::io::Error::other(why)))?;
        write(&path, svg.as_bytes())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, TAU};

    use nalgebra::{Translation3, UnitQuaternion};

    use super::*;
    use crate::cloud::Cloud;
    use crate::image::Photo;
    use crate::scene::SceneError;
    use crate::scene::street::{Size, Street};

    /// Frames on a way of one's own; the rest is the street's.
    struct OnWay {
        street: Street,
        poses: Vec<Option<Pose>>,
        names: Vec<String>,
    }

    impl Scene for OnWay {
        crate::inner_scene!(street: intrinsics, time_s, has_cloud);

        fn name(&self) -> &str {
            "kitti/04"
        }

        fn frames(&self) -> &[String] {
            &self.names
        }

        fn pose(&self, frame: usize) -> Option<Pose> {
            self.poses[frame]
        }

        fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
            self.street.photo(frame)
        }

        fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
            self.street.cloud(frame)
        }
    }

    fn on_way(poses: Vec<Option<Pose>>) -> OnWay {
        OnWay {
            street: Street::new("overcast", Size::Half).expect("a condition"),
            names: (0..poses.len()).map(|frame| frame.to_string()).collect(),
            poses,
        }
    }

    /// A quarter of a circle to the right with a radius of 100 m, in a world that lies on its side.
    fn quarter() -> Vec<Option<Pose>> {
        let tilted = UnitQuaternion::from_euler_angles(0.4, -0.2, 1.1);
        (0..=50)
            .map(|step| {
                let angle = FRAC_PI_2 * f64::from(step) / 50.0;
                let place =
                    Translation3::new(100.0 * (1.0 - angle.cos()), 0.0, 100.0 * angle.sin());
                let turned = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
                let away = Pose::translation(7.0, -3.0, 2.0);
                Some(away * tilted * Pose::from_parts(place, turned))
            })
            .collect()
    }

    #[test]
    fn a_way_is_as_long_as_its_arc_and_lies_to_the_right_and_ahead() {
        let route = Route::of(&on_way(quarter())).expect("a way");
        assert!(
            (route.length_m - 100.0 * TAU / 4.0).abs() < 0.01,
            "{route:?}"
        );
        assert!((route.spacing_m - route.length_m / 50.0).abs() < 1e-12);
        let end = route.places.last().expect("an end");
        assert!((end - Point2::new(100.0, 100.0)).norm() < 1e-6, "{end}");
        assert_eq!(route.ends, ["0", "50"]);
        let svg = route.map("a quarter").expect("drawn");
        assert!(
            svg.contains("a quarter") && svg.contains("ahead (m)"),
            "{svg}"
        );
        let bounds = Bounds::of(&route.places);
        let (width, height) = bounds.picture();
        assert_eq!(
            f64::from(width) - AROUND.0,
            f64::from(height) - AROUND.1 - 24.0
        );
    }

    #[test]
    fn the_overview_stands_beside_the_papers_and_says_what_it_does_not_know() {
        let mut poses = quarter();
        poses[0] = None;
        poses[50] = None;
        let shorter = on_way(poses);
        let unknown = on_way(vec![None, None]);
        let table = overview(&[&shorter, &unknown]);
        let lines: Vec<String> = table.rows.iter().map(|row| row.join(" | ")).collect();
        assert_eq!(
            lines,
            [
                "kitti/04 | 51 | 51 | 0.151 | 3.14 | 271 | 0.4 | 1.5",
                "kitti/04 | 2 | 2 | – | – | 271 | 0.4 | 1.5",
            ]
        );
        assert_eq!(Route::of(&shorter).expect("a way").ends, ["1", "49"]);
    }
}
