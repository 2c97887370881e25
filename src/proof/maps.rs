//! Proofs of methods that minimise a cost: the map of costs, and what the map looks like from two poses.

use image::{GrayImage, Rgb, RgbImage};

use super::{ColorScale, Panel, ProofCase, ProofPicture, Thing, is_near, photos, responsible};
use crate::cost::Explanation;
use crate::diagnosis::MapOverlay;
use crate::estimator::{self, Estimator};
use crate::event::PhaseSearched;
use crate::geometry::Pose;
use crate::grid::{Lattice, Offset, Phase, ScoredLattice};
use crate::localize::QueryResult;
use crate::method::Method;
use crate::palette;
use crate::picture;
use crate::render::Comparison;

/// Poses that are tried between two poses, and beyond each of them at the same distances.
const BETWEEN: usize = 40;
const BEYOND: usize = 8;
/// Size of the curve of costs \[px\].
const CURVE: (u32, u32) = (640, 170);
/// What is nearer to the reference than this has one label with it \[cells\].
const SAME_CELLS: f32 = 0.4;

/// What the cost says at a pose.
struct Seen {
    comparison: Comparison,
    label: &'static str,
    world_from_query: Pose,
}

/// The costs around the reference with truth and result, the query, and the map seen from both.
pub(super) fn cost_map(case: &ProofCase<'_>, overlay: MapOverlay) -> Option<ProofPicture> {
    let method = responsible(case.result)?;
    let estimator = estimator::find(method)?.make(case.params);
    let seen = |label, pose: Option<Pose>| Seen::at(case, estimator.as_ref(), label, pose?);
    let result = seen("result", case.pose());
    let truth = seen("truth", case.truth.copied());
    let mut beside: Vec<Panel> = Vec::new();
    let query = &case.problem.query().photo().gray;
    match (overlay, &truth, &result) {
        (MapOverlay::Preference, Some(truth), Some(result)) => {
            let parts = picture::preference(query, &result.comparison, &truth.comparison);
            let title = "Orange prefers the result, blue the truth";
            beside.extend(parts.map(|parts| Panel::new(title, parts)));
        }
        (MapOverlay::Flat, ..) => beside.extend(histogram(truth.as_ref().or(result.as_ref()))),
        _ => {}
    }
    if beside.is_empty() {
        beside.push(Panel::photo("Query", case.problem.query().photo()));
    }
    if overlay == MapOverlay::Light {
        let reference = case.problem.reference();
        let title = format!("Reference {}", reference.name());
        beside.push(Panel::photo(title, reference.photo()));
    }
    for seen in result.iter().chain(&truth) {
        beside.push(view_panel(query, seen));
    }
    if matches!(overlay, MapOverlay::Preference | MapOverlay::Ranks) {
        beside.push(photos::reference_cloud(case));
    }
    let below = result.as_ref().zip(truth.as_ref());
    // On the way to a heading that was not searched, the cost says nothing of the search.
    let below = below.filter(|_| overlay != MapOverlay::Reach || too_far_turned(case).is_none());
    let below = below.and_then(|(result, truth)| curve(case, estimator.as_ref(), result, truth));
    let coarse = case.all::<PhaseSearched>().map(|event| &event.surface);
    let coarse = coarse.rev().find(|surface| surface.lattice.phase == Phase::PositionCoarse);
    let large = match coarse {
        Some(surface) => map(case, surface, overlay, result.as_ref(), truth.as_ref()),
        // Without a grid, the view from the result is what decided.
        None if beside.len() > 1 => beside.remove(1),
        None => return None,
    };
    Some(ProofPicture { large, below, beside })
}

/// The true place with the height, pitch and roll of the reference, as the search knows it, against the truth itself;
/// cut out where the map is seen.
pub(super) fn freed_views(case: &ProofCase<'_>) -> Option<ProofPicture> {
    let (pose, truth) = (case.pose()?, case.truth?);
    let method = responsible(case.result)?;
    let estimator = estimator::find(method)?.make(case.params);
    let reference_from_truth = case.problem.reference_from_query(truth);
    let on_plane = Offset::of(&reference_from_truth).reference_from_camera();
    let query = &case.problem.query().photo().gray;
    let seen = |label, pose: Pose| Seen::at(case, estimator.as_ref(), label, pose);
    let frozen = seen(
        "true place, with the reference's height, pitch and roll",
        case.problem.world_from_query(&on_plane),
    )?;
    let free = seen("truth", *truth)?;
    let cut = centre_of(&free.comparison.view);
    let frozen = cut_out(view_panel(query, &frozen), cut);
    let freed = on_plane.inverse() * reference_from_truth;
    let turned = freed.rotation.scaled_axis();
    let mut large = cut_out(view_panel(query, &free), cut);
    large.title += &format!(
        "; it is {:.2} m higher, pitched by {:.2}° and rolled by {:.2}°",
        -freed.translation.y,
        turned.x.to_degrees(),
        turned.z.to_degrees(),
    );
    let result = seen("result", pose).map(|result| view_panel(query, &result));
    Some(ProofPicture { large, below: None, beside: [frozen].into_iter().chain(result).collect() })
}

/// The map seen from where posescope has the query, and from the pose of another system.
pub(super) fn both_poses(case: &ProofCase<'_>) -> Option<ProofPicture> {
    let better = case.result.opinion.as_ref()?.better.as_ref()?.to_pose()?;
    let estimator = estimator::find(Method::MI)?.make(case.params);
    let seen = |label, pose: Pose| Seen::at(case, estimator.as_ref(), label, pose);
    let given = seen("given pose", case.pose()?)?;
    let better = seen("pose where posescope has it", better)?;
    let query = &case.problem.query().photo().gray;
    let parts = picture::preference(query, &given.comparison, &better.comparison);
    let photo = Panel::photo("Query", case.problem.query().photo());
    // Small panels have little room for words.
    let given = Panel { title: given.label(), ..view_panel(query, &given) };
    let beside = [photo, given];
    let parts = parts.map(|parts| Panel::new("Fits better: given (orange), other (blue)", parts));
    Some(ProofPicture {
        large: view_panel(query, &better),
        below: None,
        beside: beside.into_iter().chain(parts).collect(),
    })
}

/// The mean place of the covered pixels \[px\].
fn centre_of(view: &crate::render::SyntheticView) -> [f64; 2] {
    let count = view.pixels.len().max(1) as f64;
    let sum = view.pixels.iter().fold([0.0; 2], |sum, pixel| {
        let (x, y) = (pixel.index % view.width, pixel.index / view.width);
        [sum[0] + f64::from(x), sum[1] + f64::from(y)]
    });
    sum.map(|sum| sum / count)
}

/// The part of a panel's picture around a place: a third of each side, where small shifts are seen.
fn cut_out(panel: Panel, [x, y]: [f64; 2]) -> Panel {
    let (width, height) = panel.picture.dimensions();
    let part = [(width / 3).max(1), (height / 3).max(1)];
    let corner = |at: f64, part: u32, whole: u32| {
        let from = (at as u32).saturating_sub(part / 2);
        from.min(whole - part)
    };
    let (left, top) = (corner(x, part[0], width), corner(y, part[1], height));
    let cut = image::imageops::crop_imm(panel.picture.as_ref(), left, top, part[0], part[1]);
    Panel { picture: std::sync::Arc::new(cut.to_image()), ..panel }
}

fn map(
    case: &ProofCase<'_>,
    surface: &ScoredLattice,
    overlay: MapOverlay,
    result: Option<&Seen>,
    truth: Option<&Seen>,
) -> Panel {
    let lattice = &surface.lattice;
    let mut panel = match overlay {
        MapOverlay::Coverage => coverage_map(surface),
        _ => {
            let mut panel = Panel::new(
                format!("Cost of each position, a cell is {} m, ahead is up", lattice.step),
                picture::surface(surface),
            );
            panel.scale = cost_scale(surface);
            panel
        }
    };
    panel.has_cells = true;
    let place =
        |world_from_query: &Pose| Offset::of(&case.problem.reference_from_query(world_from_query));
    let mut ranked = None;
    match overlay {
        MapOverlay::Ranks => {
            // The verdict ranks the cell nearest to the lowest cost near the truth.
            let named = near_truth(case.result);
            if let Some(right) = named.or_else(|| case.truth.map(place)) {
                ranked = outline_right_cell(&mut panel, surface, &right);
            }
        }
        MapOverlay::Reach | MapOverlay::Rim => {
            let radius_m = case.problem.uncertainty_radius_m();
            let around = (0..=72).map(|step| {
                let angle = f64::from(step) * std::f64::consts::TAU / 72.0;
                let offset = Offset {
                    right_m: radius_m * angle.cos(),
                    forward_m: radius_m * angle.sin(),
                    yaw_rad: 0.0,
                };
                cell_place(lattice, &offset)
            });
            panel.line(palette::ESTIMATE, 2.5, around);
            let turn_deg = case.params.grid.yaw_range_deg;
            panel.title = format!("Searched: {radius_m} m (orange), ±{turn_deg}° (white)");
            let truth = case.truth.map(place);
            if let Some(turned_deg) = too_far_turned(case) {
                panel.title += &format!("; truth turned by {turned_deg:.0}° (green)");
            }
            // Headings: those that are searched, from the reference, and that of the truth.
            let heading = |from: &Offset, yaw_rad: f64| {
                let tip = Offset {
                    right_m: from.right_m - 0.4 * radius_m * yaw_rad.sin(),
                    forward_m: from.forward_m + 0.4 * radius_m * yaw_rad.cos(),
                    yaw_rad: 0.0,
                };
                [cell_place(lattice, from), cell_place(lattice, &tip)]
            };
            for side in [-1.0, 1.0] {
                let edge = heading(&Offset::default(), side * turn_deg.to_radians());
                panel.line([0xFF; 3], 1.5, edge);
            }
            if let Some(truth) = &truth {
                panel.line(palette::TRUTH, 2.5, heading(truth, truth.yaw_rad));
            }
        }
        MapOverlay::Preference | MapOverlay::Light | MapOverlay::Coverage | MapOverlay::Flat => {}
    }
    let label = |seen: &Seen| match overlay {
        MapOverlay::Coverage => {
            format!("{} covers {} px", seen.label, seen.comparison.score.covered)
        }
        _ => seen.label(),
    };
    let at_reference = cell_place(lattice, &Offset::default());
    let at_truth = truth.map(|truth| cell_place(lattice, &place(&truth.world_from_query)));
    let is_same = at_truth.is_some_and(|at| is_near(at, at_reference, SAME_CELLS));
    let label_of_reference = if is_same { "" } else { "reference" };
    panel.mark(Thing::Reference, at_reference, label_of_reference);
    if let Some(result) = result {
        let at = cell_place(lattice, &place(&result.world_from_query));
        panel.marks.push(case.result_mark(at, label(result)));
    }
    if let (Some(truth), Some(at)) = (truth, at_truth) {
        let label = label(truth);
        let mut label = label + &ranked.unwrap_or_default();
        if is_same {
            label += ", at the reference";
        }
        // Beyond the map, the mark is at the edge that is nearest to the truth.
        let (right, bottom) = (lattice.columns as f32, lattice.rows as f32);
        let edge = [at[0].clamp(0.0, right), at[1].clamp(0.0, bottom)];
        let beyond = (at[0] - edge[0]).hypot(at[1] - edge[1]);
        if beyond > 0.0 {
            label += &format!(", {:.1} m beyond this edge", f64::from(beyond) * lattice.step);
        }
        panel.mark(Thing::Truth, edge, label);
    }
    panel
}

/// The angle between the headings of truth and reference, where it is more than is searched \[°\].
fn too_far_turned(case: &ProofCase<'_>) -> Option<f64> {
    let turned = Offset::of(&case.problem.reference_from_query(case.truth?)).yaw_rad;
    let turned_deg = turned.to_degrees().abs();
    (turned_deg > case.params.grid.yaw_range_deg).then_some(turned_deg)
}

/// The pose near the truth that the verdict speaks of.
fn near_truth(result: &QueryResult) -> Option<Offset> {
    let place = result.diagnosis.first()?.evidence.get("near_truth")?;
    let metres = |key: &str| place.get(key)?.as_f64();
    Some(Offset { right_m: metres("right_m")?, forward_m: metres("forward_m")?, yaw_rad: 0.0 })
}

/// Outlines the coarse cell at the truth. What its cost is, and its rank among all that may win.
fn outline_right_cell(
    panel: &mut Panel,
    surface: &ScoredLattice,
    truth: &Offset,
) -> Option<String> {
    let lattice = &surface.lattice;
    let [x, y] = cell_place(lattice, truth);
    let (left, top) = (x.floor(), y.floor());
    if left < 0.0 || top < 0.0 || left >= lattice.columns as f32 || top >= lattice.rows as f32 {
        return None;
    }
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
    let corners = corners.map(|[across, down]| [left + across, top + down]);
    panel.line(palette::TRUTH, 2.0, corners);
    let cell = (lattice.rows - 1 - top as usize) * lattice.columns + left as usize;
    let Some(own) = surface.eligible_cost(cell) else {
        panel.title += ", the right cell covers too little to be ranked";
        return None;
    };
    let costs = (0..surface.scores.len()).filter_map(|cell| surface.eligible_cost(cell));
    let costs: Vec<f64> = costs.collect();
    let rank = 1 + costs.iter().filter(|cost| **cost < own).count();
    panel.title += &format!(", the right cell is number {rank} of {}", costs.len());
    Some(format!(" (cell {})", number(own)))
}

fn cost_scale(surface: &ScoredLattice) -> Option<ColorScale> {
    let costs = || (0..surface.scores.len()).filter_map(|cell| surface.eligible_cost(cell));
    let (least, most) = (costs().reduce(f64::min)?, costs().reduce(f64::max)?);
    Some(ColorScale { dark: number(most), bright: format!("{} (lowest cell)", number(least)) })
}

/// How much of the image each position covers.
fn coverage_map(surface: &ScoredLattice) -> Panel {
    let lattice = &surface.lattice;
    let covered = |cell: usize| surface.scores[cell].map(|score| score.covered);
    let most = (0..surface.scores.len()).filter_map(covered).max().unwrap_or(1).max(1);
    let cells = RgbImage::from_fn(lattice.columns as u32, lattice.rows as u32, |x, y| {
        let cell = (lattice.rows - 1 - y as usize) * lattice.columns + x as usize;
        Rgb(covered(cell).map_or(palette::NOTHING, |covered| {
            palette::viridis(f64::from(covered) / f64::from(most))
        }))
    });
    let mut panel = Panel::new(
        format!("What each position covers, a cell is {} m, ahead is up", lattice.step),
        cells,
    );
    panel.scale = Some(ColorScale { dark: "nothing".to_owned(), bright: format!("{most} px") });
    panel
}

/// Where an offset is on a map of a lattice.
fn cell_place(lattice: &Lattice, offset: &Offset) -> [f32; 2] {
    let along = |metres: f64, centre: f64, count: usize| {
        (metres - centre) / lattice.step + count as f64 / 2.0
    };
    let x = along(offset.right_m, lattice.centre.right_m, lattice.columns);
    let y = along(offset.forward_m, lattice.centre.forward_m, lattice.rows);
    [x as f32, (lattice.rows as f64 - y) as f32]
}

impl Seen {
    fn at(
        case: &ProofCase<'_>,
        estimator: &dyn Estimator,
        label: &'static str,
        world_from_query: Pose,
    ) -> Option<Self> {
        let comparison = estimator.compare_at(case.problem, &world_from_query)?;
        Some(Self { comparison, label, world_from_query })
    }

    fn words(&self) -> String {
        match self.comparison.score.cost {
            Some(cost) => format!("{}: cost {}", self.label, number(cost)),
            None => self.label.to_owned(),
        }
    }

    fn label(&self) -> String {
        match self.comparison.score.cost {
            Some(cost) => format!("{} {}", self.label, number(cost)),
            None if self.comparison.score.covered == 0 => {
                format!("{}, where the map is out of view", self.label)
            }
            None => format!("{}: what is in view gives no cost", self.label),
        }
    }
}

fn view_panel(query: &GrayImage, seen: &Seen) -> Panel {
    let view = &seen.comparison.view;
    let covered = view.pixels.len();
    let title = format!("Map seen from the {}, {covered} px", seen.words());
    Panel::new(title, picture::over(query, view))
}

fn histogram(seen: Option<&Seen>) -> Option<Panel> {
    let seen = seen?;
    match seen.comparison.explanation.as_ref()? {
        Explanation::JointHistogram(histogram) => {
            let title =
                format!("Grey values at the {}: query upwards, map to the right", seen.label);
            let mut panel = Panel::new(title, picture::joint_histogram(histogram));
            panel.has_cells = true;
            Some(panel)
        }
        _ => None,
    }
}

/// The cost on the line from the result to the truth.
fn curve(
    case: &ProofCase<'_>,
    estimator: &dyn Estimator,
    result: &Seen,
    truth: &Seen,
) -> Option<Panel> {
    let (from, to) = (result.world_from_query, truth.world_from_query);
    let steps = BETWEEN as isize + 2 * BEYOND as isize;
    let share = |step: isize| (step - BEYOND as isize) as f64 / BETWEEN as f64;
    let poses: Vec<Pose> = (0..=steps)
        .map(|step| case.problem.reference_from_query(&between(&from, &to, share(step))))
        .collect();
    let scores = estimator.scorer(case.problem)?.score(&poses);
    let costs: Vec<Option<f64>> = scores.into_iter().map(|score| score.cost).collect();
    let known = || costs.iter().flatten().copied();
    let (least, most) = (known().reduce(f64::min)?, known().reduce(f64::max)?);
    let (width, height) = (CURVE.0 as f32, CURVE.1 as f32);
    let x = |step: f64| 70.0 + (width - 150.0) * (step / steps as f64) as f32;
    let y = |cost: f64| {
        let share = (cost - least) / (most - least).max(f64::MIN_POSITIVE);
        height - 44.0 - (height - 72.0) * share as f32
    };
    let length_m = (to.translation.vector - from.translation.vector).norm().max(f64::MIN_POSITIVE);
    let title =
        format!("Cost on the way from the result to the truth ({length_m:.2} m), lower is better");
    let mut panel = Panel::plain(title, CURVE.0, CURVE.1);
    let at_metres = |metres: f64| x(BEYOND as f64 + BETWEEN as f64 * metres / length_m);
    for metres in ticks(length_m * (BEYOND + BETWEEN) as f64 / BETWEEN as f64) {
        let at = at_metres(metres);
        let (top, bottom) = (height - 36.0, height - 30.0);
        panel.line([0x90; 3], 1.0, [[at, top], [at, bottom]]);
        panel.mark(Thing::Words, [at - 8.0, height - 16.0], format!("{metres} m"));
    }
    let ends = [(BEYOND, palette::grade(case.result.grade)), (BEYOND + BETWEEN, palette::TRUTH)];
    for (step, color) in ends {
        let at = x(step as f64);
        panel.line(color, 1.0, [[at, 12.0], [at, height - 33.0]]);
    }
    for cost in [least, most] {
        panel.line([0x50; 3], 1.0, [[x(0.0), y(cost)], [x(steps as f64), y(cost)]]);
        panel.mark(Thing::Words, [6.0, y(cost)], number(cost));
    }
    let mut piece: Vec<[f32; 2]> = Vec::new();
    for (step, cost) in costs.iter().enumerate() {
        match cost {
            Some(cost) => piece.push([x(step as f64), y(*cost)]),
            None => panel.line([0xE0; 3], 2.0, std::mem::take(&mut piece)),
        }
    }
    panel.line([0xE0; 3], 2.0, piece);
    let ends = [(BEYOND, result), (BEYOND + BETWEEN, truth)];
    for (step, seen) in ends {
        let Some(cost) = costs.get(step).copied().flatten() else {
            continue;
        };
        let at = [x(step as f64), y(cost)];
        if step == BEYOND {
            panel.marks.push(case.result_mark(at, seen.label()));
        } else {
            panel.mark(Thing::Truth, at, seen.label());
        }
    }
    Some(panel)
}

/// Round distances from 0 up to this one \[m\], at most seven.
pub(super) fn ticks(most_m: f64) -> Vec<f64> {
    const STEPS_M: [f64; 15] =
        [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0];
    let Some(step_m) = STEPS_M.into_iter().find(|step| most_m / step <= 6.0) else {
        return Vec::new();
    };
    let count = (most_m / step_m).floor() as u32;
    // In whole centimetres: 3 · 0.1 would read 0.30000000000000004.
    let round = |metres: f64| (metres * 100.0).round() / 100.0;
    (0..=count).map(|step| round(f64::from(step) * step_m)).collect()
}

/// A cost with three digits that count.
fn number(cost: f64) -> String {
    match cost.abs() {
        100.0.. => format!("{cost:.0}"),
        10.0.. => format!("{cost:.1}"),
        _ => format!("{cost:.3}"),
    }
}

/// The pose at a share of the way; below 0 and above 1 it goes on in the same direction.
pub(crate) fn between(from: &Pose, to: &Pose, share: f64) -> Pose {
    /// Below this sine of the angle between two rotations they are taken for equal.
    const PARALLEL: f64 = 1e-12;
    // To the last bit, so that the costs there are those of the poses themselves.
    if share == 0.0 {
        return *from;
    }
    if share == 1.0 {
        return *to;
    }
    let translation = from.translation.vector.lerp(&to.translation.vector, share);
    let rotation = from.rotation.try_slerp(&to.rotation, share, PARALLEL);
    Pose::from_parts(translation.into(), rotation.unwrap_or(from.rotation))
}
