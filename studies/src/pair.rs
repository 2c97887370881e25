//! The pair of frames that is measured on, and what the direct methods make of it.

use std::error::Error;
use std::sync::{Arc, LazyLock};

use posescope::cost::{self, Cost};
use posescope::geometry::Pose;
use posescope::grid::{GridParams, Lattice, Offset, Phase};
use posescope::image::FloatImage;
use posescope::params::Params;
use posescope::problem::Problem;
use posescope::render::ColoredCloud;
use posescope::scene;

/// Two frames of the street, 8 m apart, or those that the environment names: `POSESCOPE_SCENE=PATH` and
/// `POSESCOPE_PAIR=QUERY,REFERENCE`, the indices of two of its frames.
pub static PAIR: LazyLock<Problem> = LazyLock::new(|| {
    let variable = |name: &str, default: &str| std::env::var(name).unwrap_or(default.to_owned());
    let scene = variable("POSESCOPE_SCENE", "street");
    let indices = variable("POSESCOPE_PAIR", "70,62");
    named_pair(&scene, &indices).unwrap_or_else(|error| {
        eprintln!("error: {scene}, POSESCOPE_PAIR={indices}: {error}");
        std::process::exit(2);
    })
});

fn named_pair(scene: &str, indices: &str) -> Result<Problem, Box<dyn Error>> {
    let scene = scene::open(scene, None)?;
    let index = |text: &str| text.trim().parse().ok().filter(|&index| index < scene.frames().len());
    let pair = indices
        .split_once(',')
        .and_then(|(query, reference)| Some((index(query)?, index(reference)?)));
    let (query, reference) =
        pair.ok_or("the indices of a query and a reference expected, as 70,62")?;
    Ok(Problem::new(scene.query(query)?, scene.reference(reference)?, 15.0)?)
}

/// The cost of the method of this name, as it is by default.
///
/// # Panics
/// Where no method is called so.
pub fn registered_cost(name: &str) -> Box<dyn Cost> {
    let entry = cost::ALL.iter().find(|entry| entry.name == name);
    (entry.expect("the name of a direct method").make)()
}

/// The query of the pair and the cloud of its reference, as a cost looks at them.
pub fn seen_by(cost: &dyn Cost) -> (Arc<FloatImage>, Arc<ColoredCloud>) {
    let (query, reference) = (PAIR.query(), PAIR.reference());
    let visible = reference.visible_cloud(&Params::default().render);
    let cloud = visible.colored_by(cost.reference_channel().of(&reference.photo().gray));
    (Arc::new(cost.query_channel().of(&query.photo().gray)), Arc::new(cloud))
}

/// The cameras of the coarse search in a disc of 10 m.
pub fn poses_of_a_disc() -> Vec<Pose> {
    let centre = Offset::default();
    let lattice = Lattice::new(Phase::PositionCoarse, centre, 10.0, &GridParams::default());
    let lattice = lattice.expect("a small lattice");
    let offsets = lattice.hypotheses().map(|(_, offset)| offset);
    offsets.map(|offset| offset.reference_from_camera()).collect()
}
