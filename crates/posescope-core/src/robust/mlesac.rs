//! MLESAC: the pose under which all residuals are likeliest, found among random samples.

use arrayvec::ArrayVec;
use rand::SeedableRng;
use rand::seq::index;
use rand_pcg::Pcg64;

use super::consensus::{Consensus, Hypothesis, MlesacError, Trial};
use super::likelihood::Likelihood;
use super::local::{LocalOptimum, inliers, locally_optimized, residuals};
use super::params::{MlesacParams, NEEDED, SAMPLE};
use crate::camera::Intrinsics;
use crate::geometry::Pose;
use crate::solver::{Correspondence, MAX_SOLUTIONS, p3p};

/// The pose `camera_from_points` that makes the reprojection errors of all `correspondences`
/// likeliest.
///
/// Torr, Zisserman, *MLESAC: A New Robust Estimator with Application to Estimating Image
/// Geometry*, CVIU 78, 2000, with the reprojection error of a pose as the residual:
///
/// 1. [`p3p()`] gives up to four poses for three random correspondences.
/// 2. Each is scored by the likelihood of a mixture, true and false matches, whose share γ is
///    estimated by expectation–maximisation; the likeliest is the hypothesis of the trial.
/// 3. A hypothesis better than all before is refined on its inliers while the likelihood rises
///    (Chum, Matas, Kittler, *Locally Optimized RANSAC*, DAGM 2003), because with noise the pose
///    of three points alone misses many inliers.
/// 4. The inliers found say how many trials make it likely, at the wanted confidence, that a
///    sample of true matches was among them (Fischler, Bolles 1981).
///
/// The paper draws a fourth correspondence to choose among the poses. Here the likelihood of all of
/// them chooses, because at 90 % false matches the fourth is false nine times out of ten.
/// [`MlesacParams::fourth`] does as the paper.
///
/// The outcome is a function of the input and the seed. The observer hears every trial, in order, and `None` before each
/// refinement within one, which takes long where many agree. It ends the run with an error.
///
/// # Errors
/// [`MlesacError`]: too few correspondences, no pose with at least [`NEEDED`] inliers, or the
/// observer's own.
pub fn mlesac<C>(
    correspondences: &[Correspondence],
    intrinsics: &Intrinsics,
    params: &MlesacParams,
    seed: u64,
    mut observe: impl FnMut(Option<&Trial>) -> Result<(), C>,
) -> Result<Consensus, MlesacError<C>> {
    let found = correspondences.len();
    if found < NEEDED {
        return Err(MlesacError::TooFewCorrespondences { found, needed: NEEDED });
    }
    let bearings: Vec<_> = correspondences
        .iter()
        .map(|correspondence| intrinsics.bearing(&correspondence.pixel))
        .collect();
    let mut likelihood = Likelihood::new(correspondences, intrinsics, params);
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut best: Option<LocalOptimum> = None;
    let mut trials = 0;
    let mut trials_needed = params.max_trials;
    while trials < trials_needed {
        let Some((sample, fourth)) = draw(&mut rng, found, params) else {
            break;
        };
        let mut solutions =
            p3p(&sample.map(|i| bearings[i]), &sample.map(|i| correspondences[i].point));
        if let Some(fourth) = fourth {
            solutions = nearest(&solutions, &correspondences[fourth], intrinsics);
        }
        let hypothesis = likeliest(
            solutions.into_iter().map(|pose| Hypothesis { pose, score: likelihood.score(&pose) }),
        );

        let old = best.map_or(f64::NEG_INFINITY, |best| best.hypothesis.score.log_likelihood);
        let improved = hypothesis.filter(|new| new.score.log_likelihood > old);
        if let Some(hypothesis) = improved {
            let optimum = if params.local {
                let look = || observe(None).map_err(MlesacError::Cancelled);
                let input = (correspondences, intrinsics, params);
                locally_optimized(hypothesis, input, &mut likelihood, look)?
            } else {
                LocalOptimum { hypothesis, refinement: None }
            };
            let inliers = optimum.hypothesis.score.inliers;
            let wanted = trials_for(drawn(params), inliers, found, params.confidence);
            trials_needed = wanted.max(params.min_trials).min(params.max_trials);
            best = Some(optimum);
        }
        observe(Some(&Trial {
            index: trials,
            sample,
            hypothesis,
            is_best: improved.is_some(),
            best: best.map(|best| best.hypothesis),
            trials_needed,
        }))
        .map_err(MlesacError::Cancelled)?;
        trials += 1;
    }
    let no_model = |best_inliers| MlesacError::NoModel { trials, best_inliers };
    let LocalOptimum { hypothesis: Hypothesis { pose, score }, refinement } =
        best.ok_or_else(|| no_model(0))?;
    let residuals_px = residuals(correspondences, intrinsics, &pose);
    let inliers: Vec<_> = inliers(&residuals_px, params.inlier_threshold_px).collect();
    if inliers.len() < NEEDED {
        return Err(no_model(inliers.len()));
    }
    Ok(Consensus {
        pose,
        inliers,
        residuals_px,
        log_likelihood: score.log_likelihood,
        mixing: score.mixing,
        trials,
        refinement,
    })
}

/// Correspondences that a trial draws.
fn drawn(params: &MlesacParams) -> usize {
    SAMPLE + usize::from(params.fourth)
}

/// A random sample of `found` correspondences, and the fourth where it chooses; `None` where there are too few.
fn draw(
    rng: &mut Pcg64,
    found: usize,
    params: &MlesacParams,
) -> Option<([usize; SAMPLE], Option<usize>)> {
    if !params.fourth {
        return Some((index::sample_array(rng, found)?, None));
    }
    let [a, b, c, fourth] = index::sample_array(rng, found)?;
    Some(([a, b, c], Some(fourth)))
}

/// The solution that shows the fourth correspondence nearest to its pixel (the paper, appendix A.4); none where
/// all have it behind the camera.
fn nearest(
    solutions: &[Pose],
    fourth: &Correspondence,
    intrinsics: &Intrinsics,
) -> ArrayVec<Pose, MAX_SOLUTIONS> {
    let error =
        |pose: &&Pose| residuals(std::slice::from_ref(fourth), intrinsics, pose).first().copied();
    let errors = solutions.iter().filter_map(|pose| Some((error(&pose)?, *pose)));
    let in_front = errors.filter(|(error, _)| error.is_finite());
    in_front.min_by(|a, b| f64::total_cmp(&a.0, &b.0)).map(|(_, pose)| pose).into_iter().collect()
}

/// The likeliest of the solutions of one sample, of equally likely ones the last.
///
/// One whose likelihood is not a number says nothing about the others.
fn likeliest(solutions: impl Iterator<Item = Hypothesis>) -> Option<Hypothesis> {
    solutions
        .filter(|solution| !solution.score.log_likelihood.is_nan())
        .max_by(|a, b| f64::total_cmp(&a.score.log_likelihood, &b.score.log_likelihood))
}

/// Trials after which a sample without false matches has been drawn with the given confidence,
/// if `inliers` of `total` matches are true.
///
/// `ln(1 − confidence) / ln(1 − P)`, `P` for drawing without putting back.
fn trials_for(drawn: usize, inliers: usize, total: usize, confidence: f64) -> usize {
    let all_true: f64 =
        (0..drawn).map(|k| inliers.saturating_sub(k) as f64 / (total - k) as f64).product();
    // An `as` cast saturates: no inliers ask for usize::MAX trials.
    ((1.0 - confidence).ln() / (-all_true).ln_1p()).ceil() as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robust::LikelihoodScore;
    use nalgebra::{Point2, Point3, Vector2, Vector3};
    use rand::RngExt;

    const KITTI: Intrinsics = Intrinsics {
        fx: 718.856,
        fy: 718.856,
        cx: 607.1928,
        cy: 185.2157,
        width: 1241,
        height: 376,
    };

    fn truth() -> Pose {
        Pose::new(Vector3::new(1.0, -0.5, 2.0), Vector3::new(0.1, 0.4, -0.05))
    }

    /// Correspondences seen from [`truth`] with up to 1 px of noise; the last `false_matches` of
    /// them have a pixel anywhere.
    fn scene(total: usize, false_matches: usize) -> Vec<Correspondence> {
        let mut rng = Pcg64::seed_from_u64(5);
        let mut pixel = || Point2::new(rng.random_range(0.0..1241.0), rng.random_range(0.0..376.0));
        (0..total)
            .map(|i| {
                let (seen, other) = (pixel(), pixel());
                let depth = 5.0 + other.x / 30.0;
                let point = truth().inverse_transform_point(&KITTI.unproject(&seen, depth));
                let noise = Vector2::new((seen.x * 7.0).sin(), (seen.y * 7.0).sin());
                let is_true = i + false_matches < total;
                let pixel = if is_true { seen + noise } else { other };
                Correspondence { pixel, point }
            })
            .collect()
    }

    type Outcome = Result<Consensus, MlesacError<()>>;

    fn run(correspondences: &[Correspondence], seed: u64) -> (Outcome, Vec<Trial>) {
        let mut trials = Vec::new();
        let params = MlesacParams::default();
        let outcome = mlesac(correspondences, &KITTI, &params, seed, |trial| {
            trials.extend(trial.copied());
            Ok(())
        });
        (outcome, trials)
    }

    #[test]
    fn the_true_matches_are_found_among_as_many_false_ones() {
        let found = run(&scene(100, 50), 1).0.expect("a consensus");
        let error = found.pose * truth().inverse();
        assert!(error.translation.vector.norm() < 0.05, "{error}");
        assert!(found.inliers.iter().take(50).copied().eq(0..50));
        assert!((found.mixing - 0.5).abs() < 0.05);
        assert!(found.refinement.is_some());
    }

    #[test]
    fn inliers_and_residuals_are_those_of_the_pose_returned() {
        let scene = scene(100, 50);
        let found = run(&scene, 1).0.expect("a consensus");
        for (i, Correspondence { pixel, point }) in scene.iter().enumerate() {
            let expected = KITTI
                .project(&(found.pose * point))
                .map_or(f64::INFINITY, |seen| (seen - pixel).norm());
            assert_eq!(found.residuals_px[i], expected);
            assert_eq!(found.inliers.contains(&i), expected <= 3.0);
        }
    }

    #[test]
    fn the_outcome_depends_on_the_input_and_the_seed_alone() {
        let scene = scene(100, 70);
        assert_eq!(run(&scene, 1), run(&scene, 1));
        assert_ne!(run(&scene, 1).1, run(&scene, 2).1);
        let silent = mlesac(&scene, &KITTI, &MlesacParams::default(), 1, |_| Ok(()));
        assert_eq!(silent, run(&scene, 1).0);
    }

    #[test]
    fn a_fourth_correspondence_chooses_the_pose_that_shows_it_nearest() {
        let [one, other] = [0.0, 1.0].map(|x| Pose::translation(x, 0.0, 0.0));
        let behind = Pose::translation(0.0, 0.0, -9.0);
        let point = Point3::new(0.0, 0.0, 5.0);
        let pixel = KITTI.project(&(one * point)).expect("in front");
        let fourth = Correspondence { pixel, point };
        assert_eq!(nearest(&[other, one, behind], &fourth, &KITTI).as_slice(), [one]);
        assert!(nearest(&[behind], &fourth, &KITTI).is_empty());
        assert!(nearest(&[], &fourth, &KITTI).is_empty());
    }

    #[test]
    fn as_the_paper_writes_it_the_pose_is_that_of_a_sample() {
        let scene = scene(100, 50);
        let params = MlesacParams { fourth: true, local: false, ..MlesacParams::default() };
        let found = mlesac(&scene, &KITTI, &params, 1, |_| Ok::<_, ()>(())).expect("a consensus");
        assert!(found.refinement.is_none());
        let refined = run(&scene, 1).0.expect("a consensus");
        let error = |pose: &Pose| (*pose * truth().inverse()).translation.vector.norm();
        assert!(error(&found.pose) < 0.5, "{}", error(&found.pose));
        assert!(error(&refined.pose) < error(&found.pose));
        assert!(found.trials > refined.trials);
    }

    #[test]
    fn a_sample_has_no_index_twice_and_the_best_only_gets_better() {
        let (outcome, trials) = run(&scene(6, 2), 3);
        assert_eq!(outcome.expect("a consensus").trials, trials.len());
        let mut best = f64::NEG_INFINITY;
        for (i, trial) in trials.iter().enumerate() {
            let [a, b, c] = trial.sample;
            assert!(a != b && b != c && c != a);
            assert_eq!(trial.index, i);
            let new = trial.best.map_or(f64::NEG_INFINITY, |best| best.score.log_likelihood);
            assert!(if trial.is_best { new > best } else { new >= best });
            best = new;
        }
    }

    #[test]
    fn too_few_correspondences_or_no_model_is_an_error() {
        let too_few = MlesacError::TooFewCorrespondences { found: 3, needed: 4 };
        assert_eq!(run(&scene(3, 0), 1).0, Err(too_few));
        let outcome = run(&scene(5, 5), 1).0;
        assert!(matches!(outcome, Err(MlesacError::NoModel { best_inliers: 0..=3, .. })));
    }

    #[test]
    fn the_observer_can_stop_at_any_trial() {
        for stop in [0, 1, 50] {
            let outcome = mlesac(&scene(50, 25), &KITTI, &MlesacParams::default(), 1, |trial| {
                trial.filter(|trial| trial.index >= stop).map_or(Ok(()), |trial| Err(trial.index))
            });
            assert_eq!(outcome, Err(MlesacError::Cancelled(stop)));
        }
    }

    #[test]
    fn the_observer_is_asked_before_each_refinement_of_many_matches() {
        let (mut asked, mut bests) = (0, 0);
        let params = MlesacParams::default();
        let scene = scene(10_000, 3000);
        let run = |stop_at: Option<usize>, asked: &mut usize, bests: &mut usize| {
            mlesac(&scene, &KITTI, &params, 1, |trial| {
                match trial {
                    Some(trial) => *bests += usize::from(trial.is_best),
                    None => *asked += 1,
                }
                if stop_at == Some(*asked) { Err(*asked) } else { Ok(()) }
            })
        };
        run(None, &mut asked, &mut bests).expect("a consensus");
        // The likelihood rises once at least, and then no more.
        assert!(asked >= 2 * bests && bests > 0, "{asked} {bests}");
        for stop in 1..=asked {
            let outcome = run(Some(stop), &mut 0, &mut 0);
            assert_eq!(outcome, Err(MlesacError::Cancelled(stop)));
        }
    }

    #[test]
    fn correspondences_without_shape_do_not_upset_it() {
        let at = |i: usize| scene(30, 0)[i];
        let equal = vec![at(0); 30];
        let on_a_line = (0..30)
            .map(|i| {
                let point = Point3::new(0.1 * f64::from(i), 0.0, 10.0);
                let pixel = KITTI.project(&point).expect("in front");
                Correspondence { pixel, point }
            })
            .collect();
        let bunched = (0..30)
            .map(|i| {
                let offset = Vector3::new(f64::from(i).sin(), f64::from(i).cos(), 0.5) * 1e-3;
                Correspondence { point: at(0).point + offset, ..at(0) }
            })
            .collect();
        let point = Point3::new(f64::NAN, 0.0, 1.0);
        let not_finite = vec![Correspondence { point, ..at(0) }; 30];
        for scene in [equal, on_a_line, bunched, not_finite] {
            if let Ok(found) = run(&scene, 1).0 {
                assert!(found.pose.to_homogeneous().iter().all(|entry| entry.is_finite()));
                assert!(found.inliers.len() >= NEEDED);
            }
        }
    }

    #[test]
    fn a_solution_without_a_likelihood_does_not_hide_the_others_of_its_sample() {
        let solution = |log_likelihood| Hypothesis {
            pose: truth(),
            score: LikelihoodScore { log_likelihood, mixing: 0.5, inliers: 10 },
        };
        let chosen = |likelihoods: &[f64]| {
            likeliest(likelihoods.iter().copied().map(solution)).map(|h| h.score.log_likelihood)
        };
        assert_eq!(chosen(&[-20.0, f64::NAN, -10.0]), Some(-10.0));
        assert_eq!(chosen(&[-20.0, -f64::NAN]), Some(-20.0));
        assert_eq!(chosen(&[f64::NAN]), None);
        assert_eq!(chosen(&[]), None);
    }

    #[test]
    fn trials_by_hand() {
        // All true: the first sample will do. None: never.
        assert_eq!(trials_for(3, 10, 10, 0.999), 0);
        assert_eq!(trials_for(3, 2, 10, 0.999), usize::MAX);
        // 5 of 10 are true: P = 5·4·3 / (10·9·8) = 1/12; ln 0.001 / ln (11/12) = 79.4.
        assert_eq!(trials_for(3, 5, 10, 0.999), 80);
        // With a fourth: P = 5·4·3·2 / (10·9·8·7) = 1/42; ln 0.001 / ln (41/42) = 286.7.
        assert_eq!(trials_for(4, 5, 10, 0.999), 287);
        // One in ten of many: about 7,000.
        assert!((6_900..7_000).contains(&trials_for(3, 100_000, 1_000_000, 0.999)));
    }
}
