//! Choosing references by where they are.

use posescope::scene::Scene;
use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_pcg::Pcg64;

use super::args::Selection;
use super::failure::CliError;

/// Frames with a cloud within `radius_m` of the query's known position, never the query itself.
pub fn choose_references(
    selection: Selection,
    references: &dyn Scene,
    queries: &dyn Scene,
    query: usize,
    same_scene: bool,
    radius_m: f64,
    seed: u64,
) -> Result<Vec<usize>, CliError> {
    let name = &queries.frames()[query];
    let Some(truth) = queries.pose(query) else {
        return Err(CliError::Usage(format!(
            "the position of query {name} is not known; name a frame with --reference"
        )));
    };
    let mut within: Vec<(f64, usize)> = (0..references.frames().len())
        .filter(|&frame| !(same_scene && frame == query))
        .filter_map(|frame| {
            let pose = references.pose(frame)?;
            let distance = (pose.translation.vector - truth.translation.vector).norm();
            (distance <= radius_m && references.has_cloud(frame)).then_some((distance, frame))
        })
        .collect();
    if within.is_empty() {
        return Err(CliError::NoReference(format!(
            "{}: no frame with pose and scan within {radius_m} m of query {name}; \
             raise --radius or name one with --reference",
            references.name()
        )));
    }
    let count = match selection {
        Selection::Nearest(count) => {
            within.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            count
        }
        Selection::Random(count) => {
            // The draw depends on the query's name, not on its place among the queries.
            let text = format!("{seed}/{name}/references");
            let seed = xxhash_rust::xxh3::xxh3_64(text.as_bytes());
            within.shuffle(&mut Pcg64::seed_from_u64(seed));
            count
        }
    };
    Ok(within
        .into_iter()
        .take(count)
        .map(|(_, frame)| frame)
        .collect())
}
