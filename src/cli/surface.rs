//! `posescope run --surface`: the cost over a dense grid of positions and headings.

use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

use image::imageops::{self, FilterType};
use posescope::cost;
use posescope::estimator;
use posescope::geometry::{Pose, PoseError};
use posescope::grid::{
    DenseSurface, GridParams, LatticeTooLarge, MAX_CELLS, Offset, least_covered,
};
use posescope::method::Method;
use posescope::picture;
use posescope::problem::Problem;
use posescope::render::Scorer;
use posescope::run::refuse_to_replace;

use super::args::RunArgs;
use super::failure::CliError;
use super::opened::{self, OpenedTask};
use super::output;
use super::terminal::Terminal;

/// Side of the square that shows a position \[px\].
const CELL_PX: u32 = 3;

pub fn surface(args: &RunArgs, out: &Path, terminal: &Terminal) -> Result<(), CliError> {
    let is_table = is_table(out)?;
    refuse_to_replace("--surface", out, &["png", "csv"], [args.scene.as_str()])?;
    let OpenedTask { task, scenes, queries, .. } =
        opened::open(&args.task, &args.scene, &args.query, &|| false)?;
    let method = method(args.task.protocol.has("methods"), &task.protocol.methods)?;
    let (references, queried) = (scenes.references.as_ref(), scenes.queries.as_ref());
    let named: Vec<&str> = task.protocol.named_references().collect();
    let (&[query], &[reference]) = (queries.as_slice(), named.as_slice()) else {
        return Err(CliError::Usage(
            "--surface needs exactly one query and one reference; name them with --query and --reference"
                .to_owned(),
        ));
    };
    let reference = references.reference(references.find(reference)?)?;
    let problem = Problem::new(queried.query(query)?, reference, task.radius_m())
        .map_err(|error| CliError::Usage(error.to_string()))?
        .with_seed(task.protocol.seed);
    let mut grid = task.params.grid.clone();
    grid.coarse_step_m = task.params.surface.step_m;
    grid.yaw_step_deg = task.params.surface.yaw_step_deg;
    // A wrong folder fails before the work.
    if let Some(folder) = out.parent() {
        std::fs::create_dir_all(folder).map_err(CliError::io(folder))?;
    }
    let estimator = estimator::entry(method).make(&task.params);
    let start = Instant::now();
    let scorer = estimator.scorer(&problem).ok_or_else(|| no_cost(method))?;
    let surface = fill(&scorer, task.radius_m(), &grid, terminal)?;
    let seconds = start.elapsed().as_secs_f64();
    let write = if is_table { write_csv } else { write_png };
    write(&surface, out)?;
    if !terminal.is_quiet {
        let truth = queried.pose(query);
        let words = described(&surface, &problem, truth.as_ref());
        output::print(&task.params.scale.unit().words(&words))?;
    }
    terminal.say(|| {
        let (hypotheses, out) = (surface.hypotheses(), out.display());
        let per_second = hypotheses as f64 / seconds;
        format!("{hypotheses} hypotheses in {seconds:.1} s, {per_second:.0} per second; {out}")
    });
    Ok(())
}

/// The method whose cost is shown: mi, or the named one.
fn method(is_named: bool, methods: &[Method]) -> Result<Method, CliError> {
    let method = match (is_named, methods) {
        (false, _) => Method::MI,
        (true, [one]) => *one,
        (true, _) => {
            return Err(CliError::Usage(
                "--surface needs exactly one method; name one with --method".to_owned(),
            ));
        }
    };
    let has_cost = cost::ALL.iter().any(|cost| cost.name == method.name());
    if has_cost { Ok(method) } else { Err(no_cost(method)) }
}

fn no_cost(method: Method) -> CliError {
    let names: Vec<&str> = cost::ALL.iter().map(|cost| cost.name).collect();
    CliError::Usage(format!(
        "--surface: {method} has no cost on a grid; use --method {}",
        names.join(" or ")
    ))
}

fn too_large(error: &LatticeTooLarge) -> CliError {
    let (step, less) = if error.phase.is_yaw() {
        ("surface.yaw_step", "a smaller grid.yaw_range")
    } else {
        ("surface.step", "a smaller --radius")
    };
    CliError::Usage(format!(
        "{step}: {:.0} cells, at most {MAX_CELLS} can be scored; use a larger step or {less}",
        error.cells
    ))
}

/// Scores every position with every heading.
fn fill(
    scorer: &Scorer<'_>,
    radius_m: f64,
    grid: &GridParams,
    terminal: &Terminal,
) -> Result<DenseSurface, CliError> {
    let at_reference = scorer.score(&[Pose::identity()])[0];
    let least_covered = least_covered(grid.coverage_floor, at_reference.covered);
    let mut surface =
        DenseSurface::new(radius_m, grid, least_covered).map_err(|error| too_large(&error))?;
    terminal.say(|| {
        format!(
            "{} hypotheses to score; larger surface.step and surface.yaw_step need fewer",
            surface.hypotheses()
        )
    });
    let bar = terminal.bar(surface.hypotheses() as u64);
    while !surface.is_complete() {
        surface.score_next(scorer);
        bar.set_position(surface.tried() as u64);
    }
    bar.finish_and_clear();
    Ok(surface)
}

/// Whether a file is a table, and no picture, by its name.
fn is_table(out: &Path) -> Result<bool, CliError> {
    let ending = out.extension().map(|ending| ending.to_ascii_lowercase());
    match ending.as_ref().and_then(|ending| ending.to_str()) {
        Some("csv") => Ok(true),
        Some("png") => Ok(false),
        _ => Err(CliError::Usage(format!(
            "--surface {}: a file name that ends in .csv or .png expected",
            out.display()
        ))),
    }
}

/// The pose of lowest cost as text.
fn described(surface: &DenseSurface, problem: &Problem, truth: Option<&Pose>) -> String {
    let least = surface.minimum().and_then(|(at, score)| Some((at, score.cost?)));
    let Some((offset, cost)) = least else {
        return "no hypothesis covers enough to have a cost; lower grid.coverage_floor".to_owned();
    };
    let mut text = format!(
        "lowest cost {cost:.6} at {:.2} m right, {:.2} m forward, {:.1}° to the left",
        offset.right_m,
        offset.forward_m,
        offset.yaw_rad.to_degrees()
    );
    if let Some(truth) = truth {
        let pose = problem.world_from_query(&offset.reference_from_camera());
        let error = PoseError::between(truth, &pose);
        let _ = write!(text, ", {error} from the truth");
    }
    text
}

/// The hypothesis of lowest cost at each position that has one, by cell.
fn costs(surface: &DenseSurface) -> impl Iterator<Item = (usize, Offset, f64, u32)> + '_ {
    let cells = 0..surface.cheapest().lattice.cells();
    cells.filter_map(|cell| {
        let (offset, score) = surface.at(cell)?;
        let cost = surface.cheapest().eligible_cost(cell)?;
        Some((cell, offset, cost, score.covered))
    })
}

fn write_csv(surface: &DenseSurface, out: &Path) -> Result<(), CliError> {
    let mut text = "right_m,forward_m,yaw_deg,cost,covered_px\n".to_owned();
    for (_, offset, cost, covered) in costs(surface) {
        let (right_m, forward_m) = (offset.right_m, offset.forward_m);
        let yaw_deg = offset.yaw_rad.to_degrees();
        let _ = writeln!(text, "{right_m:.3},{forward_m:.3},{yaw_deg:.3},{cost},{covered}");
    }
    std::fs::write(out, text).map_err(CliError::io(out))
}

fn write_png(surface: &DenseSurface, out: &Path) -> Result<(), CliError> {
    let cells = picture::surface(surface.cheapest());
    let (width, height) = (cells.width() * CELL_PX, cells.height() * CELL_PX);
    let picture = imageops::resize(&cells, width, height, FilterType::Nearest);
    picture.save(out).map_err(CliError::image(out))
}
