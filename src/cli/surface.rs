//! `posescope surface`: the cost over a dense grid of positions and headings.

use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

use image::{Rgb, RgbImage};
use posescope::estimator;
use posescope::geometry::{Pose, PoseError};
use posescope::grid::{GridParams, Lattice, Offset, Phase, least_covered};
use posescope::method::Method;
use posescope::problem::Problem;
use posescope::render::{Score, Scorer};

use super::args::SurfaceArgs;
use super::failure::CliError;
use super::opened::{self, OpenedTask};
use super::output;
use super::run::use_threads;
use super::terminal::Terminal;

/// Side of the square that shows a position \[px\].
const CELL_PX: u32 = 3;
/// Where nothing was scored.
const NOTHING: Rgb<u8> = Rgb([0x18, 0x18, 0x18]);

/// The cheapest heading at a position.
#[derive(Clone, Copy)]
struct Cheapest {
    offset: Offset,
    cost: f64,
    covered: u32,
}

/// A dense surface, while it is being scored.
struct Surface {
    /// The positions, at the heading of the reference.
    positions: Lattice,
    headings: Vec<f64>,
    cheapest: Vec<Option<Cheapest>>,
    least_covered: u32,
}

/// Runs the command.
pub fn surface(args: &SurfaceArgs, terminal: &Terminal) -> Result<(), CliError> {
    use_threads(args.task.protocol.threads)?;
    let method = method(args)?;
    let writer = writer(&args.out)?;
    let OpenedTask {
        task,
        scenes,
        queries,
    } = opened::open(&args.task, &args.scene, std::slice::from_ref(&args.query))?;
    let (references, queried) = (scenes.references.as_ref(), scenes.queries.as_ref());
    let [reference] = args.task.reference.as_slice() else {
        return Err(CliError::Usage(
            "a surface has one reference; name it with --reference".to_owned(),
        ));
    };
    let (query, reference) = (queries[0], references.find(reference)?);
    let problem = Problem {
        query: queried.query(query)?,
        reference: references.reference(reference)?,
        uncertainty_radius_m: task.radius_m,
        prior_m: None,
        seed: task.protocol.seed,
        matches: None,
    };
    let grid = GridParams {
        coarse_step_m: args.step,
        ..task.params.grid.clone()
    };
    let mut surface = Surface::new(&problem, &grid, args.yaw_step)?;
    let bar = terminal.bar(surface.hypotheses() as u64);
    let start = Instant::now();
    let estimator = estimator::entry(method).make(&task.params);
    estimator.with_scorer(&problem, &mut |scorer| {
        let at_reference = scorer.score(&[Pose::identity()])[0];
        surface.least_covered = least_covered(grid.coverage_floor, at_reference.covered);
        surface.score(scorer, &|done| bar.set_position(done as u64));
    });
    let seconds = start.elapsed().as_secs_f64();
    bar.finish_and_clear();
    writer(&surface, &args.out)?;
    if !terminal.is_quiet() {
        let truth = queried.pose(query);
        let said = surface.described(&problem, truth.as_ref());
        output::print(&said)?;
        let hypotheses = surface.hypotheses();
        let per_second = hypotheses as f64 / seconds;
        eprintln!(
            "{hypotheses} hypotheses in {seconds:.1} s, {per_second:.0} per second; {}",
            args.out.display()
        );
    }
    Ok(())
}

/// The method whose cost is shown: mi, or the one that was named.
fn method(args: &SurfaceArgs) -> Result<Method, CliError> {
    let method = match args.task.protocol.method.as_slice() {
        [] => Method::MI,
        [one] => *one,
        _ => return Err(CliError::Usage("a surface is of one method".to_owned())),
    };
    let entry = estimator::find(method);
    match entry.map(|entry| &entry.parts) {
        Some(estimator::Parts::Cost(_)) => Ok(method),
        _ => Err(CliError::Usage(format!(
            "{method} searches no grid of one cost; pm, mi or nid expected"
        ))),
    }
}

type Writer = fn(&Surface, &Path) -> Result<(), CliError>;

/// What writes a file of this name.
fn writer(out: &Path) -> Result<Writer, CliError> {
    match out.extension().and_then(|ending| ending.to_str()) {
        Some("csv") => Ok(Surface::write_csv),
        Some("png") => Ok(Surface::write_png),
        _ => Err(CliError::Usage(format!(
            "--out {}: a name that ends in .csv or .png expected",
            out.display()
        ))),
    }
}

impl Surface {
    fn new(problem: &Problem, grid: &GridParams, yaw_step_deg: f64) -> Result<Self, CliError> {
        let radius_m = problem.uncertainty_radius_m;
        let too_large = |error| CliError::Usage(format!("{error}"));
        let phase = Phase::PositionCoarse;
        let positions =
            Lattice::new(phase, Offset::default(), radius_m, grid).map_err(too_large)?;
        let turning = GridParams {
            yaw_step_deg,
            ..grid.clone()
        };
        let headings = Lattice::new(Phase::YawCoarse, Offset::default(), radius_m, &turning);
        let headings = headings.map_err(too_large)?;
        Ok(Self {
            cheapest: vec![None; positions.cells()],
            headings: headings
                .hypotheses()
                .map(|(_, offset)| offset.yaw_rad)
                .collect(),
            positions,
            least_covered: 0,
        })
    }

    fn hypotheses(&self) -> usize {
        self.positions.hypotheses().count() * self.headings.len()
    }

    /// Scores heading by heading, and keeps of each position the cheapest.
    fn score(&mut self, scorer: &Scorer<'_>, tell: &dyn Fn(usize)) {
        let cells: Vec<(usize, Offset)> = self.positions.hypotheses().collect();
        let at_a_time = scorer.at_a_time_of(cells.len());
        let mut done = 0;
        for &yaw_rad in &self.headings {
            for some in cells.chunks(at_a_time) {
                let turned = |&(_, offset): &(usize, Offset)| Offset { yaw_rad, ..offset };
                let offsets: Vec<Offset> = some.iter().map(turned).collect();
                let poses: Vec<Pose> = offsets.iter().map(Offset::reference_from_camera).collect();
                let scores = scorer.score(&poses);
                for ((&(cell, _), offset), score) in some.iter().zip(offsets).zip(scores) {
                    keep(&mut self.cheapest[cell], offset, score, self.least_covered);
                }
                done += some.len();
                tell(done);
            }
        }
    }

    fn best(&self) -> Option<&Cheapest> {
        let all = self.cheapest.iter().flatten();
        all.min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    fn described(&self, problem: &Problem, truth: Option<&Pose>) -> String {
        let Some(best) = self.best() else {
            return "no hypothesis has a cost".to_owned();
        };
        let Offset {
            right_m,
            forward_m,
            yaw_rad,
        } = best.offset;
        let mut text = format!(
            "least cost {:.6} at {right_m:.2} m right, {forward_m:.2} m forward, {:.1}° to the left",
            best.cost,
            yaw_rad.to_degrees()
        );
        if let Some(truth) = truth {
            let pose = problem.world_from_query(&best.offset.reference_from_camera());
            let error = PoseError::between(truth, &pose);
            let _ = write!(text, ", {error} from the truth");
        }
        text
    }

    fn write_csv(&self, out: &Path) -> Result<(), CliError> {
        let mut text = "right_m,forward_m,yaw_deg,cost,covered_px\n".to_owned();
        for Cheapest {
            offset,
            cost,
            covered,
        } in self.cheapest.iter().flatten()
        {
            let (right_m, forward_m) = (offset.right_m, offset.forward_m);
            let yaw_deg = offset.yaw_rad.to_degrees();
            let _ = writeln!(
                text,
                "{right_m:.3},{forward_m:.3},{yaw_deg:.3},{cost},{covered}"
            );
        }
        std::fs::write(out, text).map_err(CliError::io(out))
    }

    /// Forward is up; from the least cost, yellow, to the greatest, dark blue.
    fn write_png(&self, out: &Path) -> Result<(), CliError> {
        let (columns, rows) = (self.positions.columns as u32, self.positions.rows as u32);
        let costs = || self.cheapest.iter().flatten().map(|cheapest| cheapest.cost);
        let least = costs().fold(f64::INFINITY, f64::min);
        let most = costs().fold(f64::NEG_INFINITY, f64::max);
        let color = |cheapest: &Cheapest| {
            let share = (most - cheapest.cost) / (most - least).max(f64::MIN_POSITIVE);
            Rgb(colorous::VIRIDIS
                .eval_continuous(share.clamp(0.0, 1.0))
                .as_array())
        };
        let picture = RgbImage::from_fn(columns * CELL_PX, rows * CELL_PX, |x, y| {
            let (column, row) = (x / CELL_PX, rows - 1 - y / CELL_PX);
            let cheapest = &self.cheapest[(row * columns + column) as usize];
            cheapest.as_ref().map_or(NOTHING, color)
        });
        picture.save(out).map_err(|error| match error {
            image::ImageError::IoError(error) => CliError::io(out)(error),
            other => CliError::io(out)(std::io::Error::other(other)),
        })
    }
}

/// The first of equals stays.
fn keep(cheapest: &mut Option<Cheapest>, offset: Offset, score: Score, least_covered: u32) {
    if let Some(cost) = score.eligible_cost(least_covered)
        && cheapest.is_none_or(|before| cost < before.cost)
    {
        *cheapest = Some(Cheapest {
            offset,
            cost,
            covered: score.covered,
        });
    }
}
