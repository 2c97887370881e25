//! The methods beside the paper's: what they say of their decisions, and what they keep.

use image::{GrayImage, Luma};
use posescope_core::diagnosis::Code;
use posescope_core::estimator::{self, Failure, Outcome};
use posescope_core::event::{
    CandidatesJudged, DescentStepped, Moment, PhaseSearched, StartsRefined, ViewRendered,
};
use posescope_core::geometry::{Pose, PoseError};
use posescope_core::history::History;
use posescope_core::judge::{Channels, Judge, JudgeParams};
use posescope_core::method::Method;
use posescope_core::params::Params;
use posescope_core::problem::Problem;
use posescope_core::render::{Objective as _, RenderParams};
use posescope_core::search::{Freedoms, Refined};
use posescope_core::trace::Trace;

use crate::conformance::within;
use crate::two_walls::{cloud_of_the_walls, photo, problem, solvable};

/// A query and a reference of different walls.
fn problem_of_strangers() -> Problem {
    problem(photo(1.0, 9), photo(0.0, 5), cloud_of_the_walls())
}

fn params(changes: &[&str]) -> Params {
    let mut params = Params::default();
    for change in changes {
        params.assign(change).expect("a good value");
    }
    params
}

fn told(method: &str, problem: &Problem, params: &Params) -> (Outcome, History) {
    let method: Method = method.parse().expect("a method");
    let mut history = History::default();
    let estimator = estimator::entry(method).make(params);
    let outcome = estimator.estimate(problem, &mut Trace::to(&mut history));
    (outcome.expect("nobody cancels"), history)
}

fn error(problem: &Problem, outcome: &Outcome) -> PoseError {
    let truth = problem.world_from_query(&Pose::translation(0.0, 0.0, 1.0));
    PoseError::between(&truth, outcome.pose.as_ref().expect("a pose"))
}

/// The same query in another light: darker to one side, and its tones bent.
fn in_other_light(query: &GrayImage) -> GrayImage {
    GrayImage::from_fn(query.width(), query.height(), |x, y| {
        let value = f64::from(query.get_pixel(x, y).0[0]) / 255.0;
        let light = 0.25 + 0.75 * f64::from(x) / f64::from(query.width());
        Luma([(255.0 * light * value.powf(1.6)) as u8])
    })
}

#[test]
fn the_truth_costs_less_than_what_is_beside_it_in_any_channel_and_light() {
    let query = in_other_light(&photo(1.0, 5));
    for problem in [solvable(), problem(query, photo(0.0, 5), cloud_of_the_walls())] {
        for channels in
            [Channels::Intensity, Channels::Contrast, Channels::Gradient, Channels::Three]
        {
            let mut params = JudgeParams::default();
            params.channels = channels;
            let judge = Judge::new(&problem, &RenderParams::default(), &params, 1);
            let poses = [
                Pose::translation(0.0, 0.0, 1.0),
                Pose::translation(0.4, 0.0, 1.0),
                Pose::translation(0.0, 0.3, 1.0),
                Pose::translation(0.0, 0.0, 2.5),
            ];
            let costs: Vec<f64> =
                judge.score(&poses).iter().map(|score| score.cost.expect("textured")).collect();
            assert!(costs[1..].iter().all(|cost| costs[0] < *cost), "{channels:?} {costs:?}");
            let shuffled = judge.shuffled(&poses[0], 3).expect("textured");
            assert!((shuffled - 1.0).abs() < 0.02, "less chance: {shuffled}");
        }
    }
}

#[test]
fn six_freedoms_are_searched_at_several_yaws_and_end_below_every_lattice() {
    let problem = solvable();
    let photos_alone = ["mi6.yaws=3", "mi6.coarse_shrink=1"];
    let (outcome, history) = told("mi6", &problem, &params(&photos_alone));
    assert!(error(&problem, &outcome).translation_m < 0.1);
    let best = outcome.cost.expect("it searched").best;
    let surfaces: Vec<_> = history.all::<PhaseSearched>().collect();
    assert_eq!(surfaces.len(), 3);
    for (_, searched) in surfaces {
        let cell = searched.surface.minimum().expect("textured");
        assert!(best < searched.surface.eligible_cost(cell).expect("a cost"));
    }
    let refined: Vec<_> = history.all::<StartsRefined>().collect();
    assert_eq!(refined.len(), 2);
    assert_eq!(refined[1].1.refinements[0].cost, best);
    for (_, refined) in refined {
        for one in refined.refinements.iter() {
            assert!(one.cost <= one.start.cost);
        }
    }
}

#[test]
fn smaller_copies_lead_to_starts_and_one_surface_says_what_costs_are_worth() {
    let problem = solvable();
    let (outcome, history) = told("mi6", &problem, &Params::default());
    assert!(error(&problem, &outcome).translation_m < 0.1);
    assert_eq!(history.all::<PhaseSearched>().count(), 1);
    let refined: Vec<_> = history.all::<StartsRefined>().collect();
    let [(_, refined)] = refined[..] else { panic!("{} refinements", refined.len()) };
    let best = refined.refinements[0];
    assert_eq!(
        (refined.freedoms, best.cost),
        (Freedoms::Six, outcome.cost.expect("searched").best)
    );
    // The copies are coarse: what they lead to is near, and refined further.
    let from = PoseError::between(&Pose::translation(0.0, 0.0, 1.0), &best.start.pose);
    assert!(from.translation_m < 0.5 && best.cost < best.start.cost, "{from}");
}

#[test]
fn copies_are_searched_with_all_channels_and_samples_gather_around_what_they_lead_to() {
    let problem = solvable();
    let refined = |channels: &str| {
        let (_, history) = told("mi6", &problem, &params(&[channels]));
        history.last::<StartsRefined>().expect("refined").refinements.to_vec()
    };
    let starts = |refined: &[Refined]| {
        let at = |one: &Refined| <[f64; 3]>::from(one.start.pose.translation.vector);
        let mut starts: Vec<[f64; 3]> = refined.iter().map(at).collect();
        starts.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
        starts
    };
    let [contrast, edges] = ["judge.channels=contrast", "judge.channels=gradient"].map(refined);
    assert_eq!(starts(&contrast), starts(&edges), "whatever decides later");
    assert_ne!(contrast[0].cost, edges[0].cost);
    // One to four rounds of 64, before the first step.
    assert!(contrast.iter().all(|one| one.evaluations > 64));
    assert!(contrast[0].evaluations > 256);
}

#[test]
fn a_search_whose_minima_all_lead_out_of_the_disc_says_so() {
    // The query is 1 m away.
    let problem = within(solvable(), 0.05);
    let (outcome, _) = told("mi6", &problem, &Params::default());
    let failure = outcome.pose.expect_err("its basin has its foot outside");
    assert!(matches!(failure, Failure::LedOutside { minima, .. } if minima > 1), "{failure}");
    assert_eq!(Code::of(&failure), Code::D8);
}

#[test]
fn refinements_take_no_steps_beyond_the_next_coarse_position() {
    let problem = within(solvable(), 1.25);
    let photos_alone = "mi6.coarse_shrink=1";
    let (outcome, history) =
        told("mi6", &problem, &params(&["grid.coarse_step=0.25", photos_alone]));
    assert!(error(&problem, &outcome).translation_m < 0.1);
    let (_, refined) = history.all::<StartsRefined>().next().expect("in the plane");
    let moved = |one: &Refined| PoseError::between(&one.start.pose, &one.pose).translation_m;
    let usual = told("mi6", &problem, &params(&[photos_alone])).1;
    let (_, usual) = usual.all::<StartsRefined>().next().expect("in the plane");
    let farthest = |of: &StartsRefined| of.refinements.iter().map(moved).fold(0.0, f64::max);
    assert!(farthest(refined) < farthest(usual));
}

#[test]
fn any_cost_is_searched_from_many_starts_where_that_is_asked_for() {
    let problem = solvable();
    for (method, setting) in [("pm", "pm.search=starts"), ("mi", "mi.search=starts")] {
        let (outcome, history) = told(method, &problem, &params(&[setting]));
        let off = error(&problem, &outcome);
        assert!(off.translation_m < 0.1, "{method}: {off}");
        let cost = outcome.cost.expect("it searched");
        assert!(cost.shuffled.expect("textured") > cost.best, "{method}");
        for (_, searched) in history.all::<PhaseSearched>() {
            let cell = searched.surface.minimum().expect("textured");
            let on_lattice = searched.surface.eligible_cost(cell).expect("a cost");
            assert!(cost.best < on_lattice, "{method}");
        }
        let (_, last) = history.all::<StartsRefined>().last().expect("refined");
        assert_eq!(last.refinements[0].cost, cost.best, "{method}");
        // The cost is the method's own.
        let estimator = estimator::entry(method.parse().expect("a method"));
        let estimator = estimator.make(&Params::default());
        let pose = outcome.pose.as_ref().expect("a pose");
        let compared = estimator.compare_at(&problem, pose).expect("a cost").score.cost;
        assert!((compared.expect("textured") - cost.best).abs() < 1e-3, "{method}");
    }
}

#[test]
fn a_descent_tells_each_step_over_the_surface_and_listening_changes_nothing() {
    let problem = problem(photo(0.15, 5), photo(0.0, 5), cloud_of_the_walls());
    let truth = problem.world_from_query(&Pose::translation(0.0, 0.0, 0.15));
    for (method, setting) in [("pm", "pm.search=descent"), ("mi", "mi.search=descent")] {
        let params = params(&[setting]);
        let (outcome, history) = told(method, &problem, &params);
        let silent = estimator::entry(method.parse().expect("a method"))
            .make(&params)
            .estimate(&problem, &mut Trace::off());
        assert_eq!(silent.as_ref(), Ok(&outcome), "{method}");
        let off = PoseError::between(&truth, outcome.pose.as_ref().expect("a pose"));
        assert!(off.translation_m < 0.1, "{method}: {off}");

        let steps: Vec<_> = history.all::<DescentStepped>().map(|(_, step)| *step).collect();
        assert_eq!(steps[0].level, params.descent.levels - 1, "{method}");
        assert_eq!(steps[steps.len() - 1].level, 0, "{method}");
        for pair in steps.windows(2) {
            let goes_on = pair[0].level == pair[1].level && pair[0].step + 1 == pair[1].step;
            let begins = pair[0].level > pair[1].level && pair[1].step == 1;
            assert!(goes_on || begins, "{method}: {pair:?}");
        }
        // The way over the surface that views and recordings draw.
        let way = history.all::<ViewRendered>().filter(|(_, view)| view.moment == Moment::NewBest);
        assert_eq!(way.count(), steps.len(), "{method}");
        assert_eq!(history.all::<PhaseSearched>().count(), 1, "{method}");
        let cost = outcome.cost.expect("a cost was descended");
        assert_eq!(cost.evaluations, 1 + steps.len() as u64, "{method}");
        assert_eq!(Some(cost.best), steps[steps.len() - 1].score.cost, "{method}");
    }
}

#[test]
fn matching_again_where_the_pose_says_adds_inliers() {
    let problem = solvable();
    let inliers = |changes: &[&str]| {
        let (outcome, _) = told("fb2", &problem, &params(changes));
        assert!(error(&problem, &outcome).translation_m < 0.3);
        outcome.counts.expect("it matched").inliers
    };
    // A strict first ratio leaves much to be found the second time.
    let (once, twice) =
        (inliers(&["fb2.ratio=0.7", "fb2.guided=false"]), inliers(&["fb2.ratio=0.7"]));
    assert!(twice > once, "{once} {twice}");
}

#[test]
fn robust_compares_all_families_and_says_what_each_costs() {
    let problem = solvable();
    let costs_alone = params(&["robust.credit=0", "mi6.unlikely=0"]);
    let (outcome, history) = told("robust", &problem, &costs_alone);
    assert!(error(&problem, &outcome).translation_m < 0.1);
    let judged = history.last::<CandidatesJudged>().expect("it decided");
    let costs: Vec<f64> = judged.candidates.iter().map(|c| c.refined.cost).collect();
    assert!(costs.windows(2).all(|pair| pair[0] <= pair[1]), "{costs:?}");
    assert_eq!(outcome.cost.expect("it searched").best, costs[0]);
    for name in ["fb", "fb2", "mi6"] {
        let is_there = judged.candidates.iter().any(|c| c.method.name() == name);
        assert!(is_there && judged.why.contains(name), "{name}: {}", judged.why);
    }
    // A photo of other walls fits nowhere: with a threshold it is refused, and says how far it was.
    let other = problem_of_strangers();
    let (outcome, _) = told("robust", &other, &params(&["robust.deviations=100"]));
    let failure = outcome.pose.expect_err("other walls");
    assert!(failure.to_string().contains("100.0 σ needed"), "{failure}");
}
