use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::Arc;

use image::imageops::flip_horizontal;
use posescope::depth::LiftedMatch;
use posescope::diagnosis::{Evidence, Subject, Tolerance};
use posescope::estimator;
use posescope::geometry::{Pose, PoseError};
use posescope::image::Photo;
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::Problem;
use posescope::robust::mlesac;
use posescope::scene::street::{Size, Street};
use posescope::scene::{self, FrameStore, Scene, SceneError};
use posescope::solver::Correspondence;
use posescope::trace::Trace;

use crate::Failure;
use crate::cases::Plan;
use crate::numbers::{at_places, print_table};

/// Which poses should `fb2` answer, and which refuse?
///
/// Finds the consensus of `fb2` on pairs of a real drive, of the street, and of photos that show different places, where
/// each pose is wrong. For each rule, prints how many right poses + wrong poses it answers.
#[derive(clap::Args)]
pub struct Options {
    /// Look at the frames and places that were set aside: queries of odd number of the drives, and another seed of the
    /// street.
    #[arg(long)]
    aside: bool,
}

const METHOD: Method = Method::named("fb2");

/// The uncertainty of the reference's position on the drives \[m\].
const DRIVE_RADIUS_M: f64 = 25.0;

/// Places of the street, those of queries that do not show the reference's place, and how far these are apart at
/// least \[m\].
const PLACES: usize = 6;
const UNRELATED_PLACES: usize = 50;
const UNRELATED_M: f64 = 60.0;

/// What is looked at.
#[derive(Clone, Copy)]
struct Share {
    /// Whether the numbers of the drives' queries are even or odd.
    parity: usize,
    /// The seed of the street's places.
    seed: u64,
    /// That of queries that do not show the reference's place.
    unrelated_seed: u64,
}

/// What the limit was chosen on.
const TUNED_ON: Share = Share { parity: 0, seed: 3, unrelated_seed: 7 };

/// What was set aside.
const ASIDE: Share = Share { parity: 1, seed: 5003, unrelated_seed: 5003 };

/// A scene whose photos are mirrored.
struct Mirrored(Arc<dyn Scene>);

impl Scene for Mirrored {
    posescope::inner_scene!(0: name, frames, intrinsics, pose, time_s, has_cloud, cloud);

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        let photo = self.0.photo(frame)?;
        let mirrored = photo.color.as_ref().map(flip_horizontal);
        Ok(mirrored
            .map_or_else(|| Photo::from_gray(flip_horizontal(&photo.gray)), Photo::from_color))
    }
}

/// What an estimate leaves behind.
struct Found {
    is_right: bool,
    is_beyond_chance: bool,
    /// Probability of being right.
    probability: f64,
    inliers: usize,
    /// Inliers of a second consensus, among the matches that the first does not explain.
    second_inliers: usize,
    /// Parts of the photo, of 8 × 3, with an inlier.
    parts: usize,
    /// Probability that chance alone makes as many of the features agree that are found again near where the pose says.
    second_look: f64,
}

/// A rule that accepts a pose that chance does not explain, or refuses it.
type Rule = (&'static str, fn(&Found) -> bool);

const RULES: [Rule; 9] = [
    ("chance alone", |_| true),
    ("… and twice the inliers of a second consensus", |one| {
        one.inliers >= 2 * one.second_inliers
    }),
    ("… and inliers in 6 of 24 parts of the photo", |one| one.parts >= 6),
    ("… and a second look, chance 1 %", |one| one.second_look <= 0.01),
    ("… and a second look, chance 0.1 %", |one| one.second_look <= 0.001),
    ("… and a probability of 0.3", |one| one.probability >= 0.3),
    ("… and a probability of 0.5", |one| one.probability >= 0.5),
    ("… and a probability of 0.7", |one| one.probability >= 0.7),
    ("… and a probability of 0.9", |one| one.probability >= 0.9),
];

pub fn run(options: &Options) -> Result<(), Failure> {
    let root = std::env::var_os("POSESCOPE_DATA")
        .ok_or("the drives need POSESCOPE_DATA, the folder with the sample data")?;
    let open = |path: &str| -> Result<Arc<dyn Scene>, Failure> {
        let path = PathBuf::from(&root).join(path);
        Ok(scene::open(&path.to_string_lossy(), None)?.into())
    };
    let drive = open("kitti_raw_dense/2011_09_26/2011_09_26_drive_0013_sync")?;
    let mirrored: Arc<dyn Scene> = Arc::new(Mirrored(Arc::clone(&drive)));
    let [zero, six] = [open("kitti/sequences/00")?, open("kitti/sequences/06")?];
    let share = if options.aside { ASIDE } else { TUNED_ON };
    let mut foreign = Vec::new();
    for [references, queries] in [[&drive, &six], [&zero, &six], [&drive, &zero], [&zero, &drive]] {
        foreign.extend(on_drives(references, queries, share)?);
    }
    let plan = |seed, radius_m| Plan { seed, radius_m, from_m: 0.0, unrelated_m: None };
    let unrelated = Plan { unrelated_m: Some(UNRELATED_M), ..plan(share.unrelated_seed, 10.0) };
    let sets = [
        ("drive 0013 at 25 m", on_drives(&drive, &drive, share)?),
        ("street at 10 m", on_street(&plan(share.seed, 10.0), PLACES)?),
        ("street at 25 m", on_street(&plan(share.seed, 25.0), PLACES)?),
        ("other drives", foreign),
        ("mirrored drive", on_drives(&drive, &mirrored, share)?),
        ("other streets", on_street(&unrelated, UNRELATED_PLACES)?),
    ];
    let names: String = sets.iter().map(|(name, _)| format!(",{name}")).collect();
    let row = |name: &str, cell: &dyn Fn(&[Option<Found>]) -> String| {
        let cells = sets.iter().map(|(_, found)| cell(found));
        [name.to_owned()].into_iter().chain(cells).collect()
    };
    let rights = |one: &&Found| one.is_right;
    let mut rows: Vec<Vec<String>> = vec![row("pairs", &|found| found.len().to_string())];
    rows.push(row("right poses found", &|found| {
        found.iter().flatten().filter(rights).count().to_string()
    }));
    rows.extend(RULES.iter().map(|(name, rule)| {
        row(name, &|found| {
            let answered = found.iter().flatten().filter(|one| one.is_beyond_chance && rule(one));
            let answered: Vec<&Found> = answered.collect();
            let right = answered.iter().filter(|one| one.is_right).count();
            format!("{right} + {}", answered.len() - right)
        })
    }));
    print_table(&format!("right + wrong{names}"), &rows);
    Ok(())
}

/// Each query of a share against each reference with a cloud: in one drive those within the radius. Mirrored photos, and
/// those of different drives, show no place of the references.
fn on_drives(
    references: &Arc<dyn Scene>,
    queries: &Arc<dyn Scene>,
    share: Share,
) -> Result<Vec<Option<Found>>, Failure> {
    let shows_place = Arc::ptr_eq(references, queries);
    let is_one = references.name() == queries.name();
    let store = Arc::<FrameStore>::default();
    let [of_references, of_queries] = [references, queries].map(|scene| store.of(scene));
    let found = at_places(queries.frames().len(), |at| {
        let truth = queries.pose(at);
        let is_paired = |other: &usize| {
            let apart_m = || {
                let pose = references.pose(*other)?;
                Some(PoseError::between(&pose, truth.as_ref()?).translation_m)
            };
            let is_near = || *other != at && apart_m().is_some_and(|m| m <= DRIVE_RADIUS_M);
            references.has_cloud(*other) && (!is_one || is_near())
        };
        let mut found = Vec::new();
        for other in (0..references.frames().len()).filter(is_paired) {
            if at % 2 == share.parity {
                let (query, reference) = (of_queries.query(at)?, of_references.reference(other)?);
                let problem = Problem::new(query, reference, DRIVE_RADIUS_M)?.with_seed(share.seed);
                found.push(consensus(&problem, truth.as_ref().filter(|_| shows_place))?);
            }
        }
        Ok(found)
    })?;
    Ok(found.into_iter().flatten().collect())
}

/// Each pair of conditions at so many places of the street; each condition with itself where the reference is of another
/// place.
fn on_street(plan: &Plan, places: usize) -> Result<Vec<Option<Found>>, Failure> {
    let street =
        |name| Ok::<_, Failure>(Arc::new(Street::new(name, Size::Full)?) as Arc<dyn Scene>);
    let scenes: Vec<_> = Street::conditions().map(street).collect::<Result<_, _>>()?;
    let pairs = scenes.iter().flat_map(|a| scenes.iter().map(move |b| [a, b].map(Arc::clone)));
    let is_asked = |[a, b]: &[Arc<dyn Scene>; 2]| plan.unrelated_m.is_none() || Arc::ptr_eq(a, b);
    let pairs: Vec<_> = pairs.filter(is_asked).collect();
    let found = at_places(places, |place| {
        let cases = plan.at_place(place, places, &pairs)?;
        let one = |case: &crate::cases::Case| {
            consensus(&case.problem, Some(&case.truth).filter(|_| plan.unrelated_m.is_none()))
        };
        cases.iter().map(one).collect::<Result<Vec<_>, _>>()
    })?;
    Ok(found.into_iter().flatten().collect())
}

/// What is found on a pair, if there is a consensus. Without a truth it is wrong.
fn consensus(problem: &Problem, truth: Option<&Pose>) -> Result<Option<Found>, Failure> {
    let params = Params::default();
    let mut evidence = Evidence::default();
    let outcome =
        estimator::entry(METHOD).make(&params).estimate(problem, &mut Trace::to(&mut evidence))?;
    let subject = Subject::new(problem, METHOD, &params, &outcome, &evidence);
    let probability = subject.confidence.as_ref().map_or(0.0, |one| one.probability);
    let Evidence { query: Some(features), lifted: Some(free), refined: Some(refined), .. } =
        &evidence
    else {
        return Ok(None);
    };
    let camera = problem.query().intrinsics();
    let of = |matches: &[LiftedMatch]| -> Vec<Correspondence> {
        let pixel = |one: &LiftedMatch| features.keypoints[one.query].pixel();
        let matched = |one| Some(Correspondence { pixel: pixel(one), point: one.point? });
        matches.iter().filter_map(matched).collect()
    };
    let camera_from_reference = refined.reference_from_query.inverse();
    let residual_px = |one: &Correspondence| {
        let seen = camera.project(&(camera_from_reference * one.point));
        seen.map_or(f64::INFINITY, |pixel| (pixel - one.pixel).norm())
    };
    let (inlier_px, window_px) = (params.fb2.mlesac.inlier_threshold_px, params.fb2.window_px);
    let free = of(free);
    let (inliers, rest): (Vec<_>, Vec<_>) =
        free.iter().partition(|one| residual_px(one) <= inlier_px);
    let second = mlesac(&rest, camera, &params.fb2.mlesac, problem.seed(), |_| Ok::<_, ()>(()));
    let part = |one: &Correspondence| {
        let share = |at: f64, all: u32, parts: f64| (at / f64::from(all) * parts) as usize;
        (share(one.pixel.x, camera.width, 8.0), share(one.pixel.y, camera.height, 3.0))
    };
    // Those of the first matching agree by construction, and chance spreads the others evenly over the window.
    let again = evidence.rematched.as_ref().map_or(Vec::new(), |matches| of(matches));
    let within = |reach_px| again.iter().filter(|one| residual_px(one) <= reach_px).count();
    let more = |count: usize| count.saturating_sub(inliers.len());
    Ok(Some(Found {
        is_right: truth.is_some_and(|truth| {
            let pose = problem.world_from_query(&refined.reference_from_query);
            Tolerance::default().contains(&PoseError::between(truth, &pose))
        }),
        is_beyond_chance: outcome.pose.is_ok(),
        probability,
        second_inliers: second.map_or(0, |second| second.inliers.len()),
        parts: inliers.iter().map(part).collect::<HashSet<_>>().len(),
        second_look: tail(
            more(within(inlier_px)),
            more(within(window_px)),
            (inlier_px / window_px).powi(2),
        ),
        inliers: inliers.len(),
    }))
}

/// Probability of at least `least` successes in `trials` of probability `p` each.
fn tail(least: usize, trials: usize, p: f64) -> f64 {
    let mut exactly = (1.0 - p).powi(trials as i32);
    let mut below = 0.0;
    for successes in 0..least {
        below += exactly;
        exactly *= (trials - successes.min(trials)) as f64 / (successes + 1) as f64 * p / (1.0 - p);
    }
    (1.0 - below).max(0.0)
}
