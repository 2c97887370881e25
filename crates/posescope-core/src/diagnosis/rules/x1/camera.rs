//! A camera that is not as stated: what its matches say of another one.

use nalgebra::Vector2;

use super::*;
use crate::diagnosis::matches::Pairs;
use crate::solver::Correspondence;

/// Cameras of one focal length, and of one centre, differ by less \[share, px\].
const SAME_FOCAL_LENGTH: f64 = 0.02;
const SAME_CENTRE_PX: f64 = 8.0;
/// With another focal length or centre of one camera for both photos, the cloud gives more true matches their depths.
///
/// A camera of photos of another size has its centre scaled too. What one query says is certain if there are far more,
/// and else a hint, which counts where several queries agree.
pub(super) fn camera_of_both(case: &Case<'_>, matches: &TrueMatches) -> Option<Suspicion> {
    /// Steps of the focal length, as exponents of 2: first on both sides of the stated one, then around the best.
    const COARSE: f64 = 0.125;
    const COARSE_STEPS: i32 = 12;
    const FINE: f64 = 0.015;
    const FINE_STEPS: i32 = 8;
    /// Steps of the centre to the sides, as shares of the width.
    const ASIDE: f64 = 0.01;
    const ASIDE_STEPS: i32 = 15;
    /// Matches that another camera must gain, and how many times as many it must explain, for a hint.
    const GAINED: usize = 12;
    const TIMES: f64 = 1.25;
    let problem = case.subject.problem;
    let [query, reference] = [problem.query.intrinsics, problem.reference.intrinsics];
    let is_one_camera = query == reference;
    let before = matches.funnel.lifted;
    let lost = matches.wrong_depth + matches.no_depth;
    if !is_one_camera || lost < FEW_MATCHES {
        return None;
    }
    let pairs = Pairs::of(case.subject, &case.matching())?;
    if !pairs.test_depths() {
        return None;
    }
    // The focal length's exponent, whether the centre is scaled with it, and the centre's way to the right.
    let other = |(exponent, with_centre, aside): (f64, bool, f64)| {
        let scale = exponent.exp2();
        let of_centre = if with_centre { scale } else { 1.0 };
        Intrinsics {
            fx: scale * reference.fx,
            fy: scale * reference.fy,
            cx: of_centre * reference.cx + aside * f64::from(reference.width),
            cy: of_centre * reference.cy,
            ..reference
        }
    };
    // Of equal ones, that which changes less.
    let most = |candidates: &mut dyn Iterator<Item = (f64, bool, f64)>| {
        let change = |one: &(f64, bool, f64)| one.0.abs() + one.2.abs();
        let counted = candidates.map(|one| (pairs.explained_by(&other(one)).0, one));
        counted.max_by(|a, b| a.0.cmp(&b.0).then(change(&b.1).total_cmp(&change(&a.1))))
    };
    let grid = |around: f64, step: f64, steps: i32| {
        (-steps..=steps).map(move |at| around + step * f64::from(at))
    };
    let mut coarse = grid(0.0, COARSE, COARSE_STEPS)
        .flat_map(|at| [(at, false, 0.0), (at, true, 0.0)])
        .chain(grid(0.0, ASIDE, ASIDE_STEPS).map(|aside| (0.0, false, aside)));
    let (_, (exponent, with_centre, aside)) = most(&mut coarse)?;
    let fine = &mut grid(exponent, FINE, FINE_STEPS).map(|at| (at, with_centre, aside));
    let (after, found) = most(fine)?;
    let camera = other(found);
    let is_other = (camera.fx / reference.fx - 1.0).abs() > 2.0 * SAME_FOCAL_LENGTH
        || (camera.cx - reference.cx).abs() > 2.0 * SAME_CENTRE_PX;
    let is_more = after >= before + GAINED && after as f64 >= TIMES * before as f64;
    // Things that look alike agree on some camera too; of a real one, most matches do.
    let is_most = 2 * after >= pairs.explained_by(&camera).1;
    let is_far_more = after >= before + 2 * FEW_MATCHES && 5 * after >= 8 * before;
    let certain = lost >= before.max(2 * FEW_MATCHES) && is_far_more && is_most;
    let found = || {
        RULE.found(&CameraOfBoth {
            right_depth: before,
            right_depth_otherwise: after,
            camera,
            stated: reference,
            certain,
        })
    };
    (is_more && is_other).then(|| Suspicion { found: found(), certain })
}

evidence!(CameraOfBoth {
    right_depth: usize,
    right_depth_otherwise: usize,
    camera: Intrinsics,
    stated: Intrinsics,
    certain: bool,
} => {
    let is = if *certain { "is" } else { "may be" };
    let should_be = what_it_should_be(camera, stated);
    format!(
        "The camera of both photos {is} suspect: {should_be}. That gives {right_depth_otherwise} true matches the \
         right depth, not {right_depth}."
    )
});

/// From the true pose, another focal length and principal point explain far more matches.
pub(super) fn camera_by_matches(case: &Case<'_>, matches: &TrueMatches) -> Option<Diagnosis> {
    let query_from_reference = case.subject.reference_from_truth()?.inverse();
    let stated = &case.subject.problem.query.intrinsics;
    let threshold_px = case.matching().mlesac.inlier_threshold_px;
    let explained = |camera: &Intrinsics| {
        let is_explained = |c: &&Correspondence| {
            let seen = camera.project(&(query_from_reference * c.point));
            seen.is_some_and(|seen| (seen - c.pixel).norm() <= threshold_px)
        };
        matches.correspondences.iter().filter(is_explained).count()
    };
    let before = explained(stated);
    let (camera, after) = likeliest_camera(matches, &query_from_reference, stated)
        .map(|camera| (camera, explained(&camera)))?;
    // What another pose explains as well says nothing against the camera.
    let is_more =
        after >= 3 * FEW_MATCHES && 2 * after > 3 * before && 5 * after > 6 * matches.inliers();
    let is_other = (camera.fx / stated.fx - 1.0).abs() > SAME_FOCAL_LENGTH
        || (camera.cx - stated.cx).hypot(camera.cy - stated.cy) > SAME_CENTRE_PX;
    (is_more && is_other).then(|| {
        RULE.found(&OtherCamera {
            explained: before,
            explained_otherwise: after,
            camera,
            stated: *stated,
        })
    })
}

evidence!(OtherCamera {
    explained: usize,
    explained_otherwise: usize,
    camera: Intrinsics,
    stated: Intrinsics,
} =>
    "The query camera is suspect: {}. That explains {explained_otherwise} matches at the truth, not \
     {explained}.",
    what_it_should_be(camera, stated)
);

/// What differs between two cameras, to the pixel.
fn what_it_should_be(camera: &Intrinsics, stated: &Intrinsics) -> String {
    let mut differences = Vec::new();
    if (camera.fx / stated.fx - 1.0).abs() > SAME_FOCAL_LENGTH {
        let lengths = format!("{:.0} px, not {:.0}", camera.fx, stated.fx);
        differences.push(("its focal length", lengths));
    }
    if (camera.cx - stated.cx).hypot(camera.cy - stated.cy) > SAME_CENTRE_PX {
        let centre = |of: &Intrinsics| format!("({:.0}, {:.0})", of.cx, of.cy);
        differences.push(("its centre", format!("{}, not {}", centre(camera), centre(stated))));
    }
    match differences.as_slice() {
        [(first, is), (second, are)] => format!("{first} should be {is}, and {second} {are}"),
        others => others.iter().map(|(what, is)| format!("{what} should be {is}")).collect(),
    }
}

/// The camera of one focal length and any centre that explains most matches from a pose.
///
/// Two matches fix a focal length and a centre; pairs are taken at a fixed stride, so that equal runs
/// ask equal pairs.
fn likeliest_camera(
    matches: &TrueMatches,
    query_from_reference: &Pose,
    stated: &Intrinsics,
) -> Option<Intrinsics> {
    const PAIRS: usize = 400;
    const THRESHOLD_PX: f64 = 4.0;
    let rays: Vec<(Vector2<f64>, &Correspondence)> = matches
        .correspondences
        .iter()
        .filter_map(|correspondence| {
            let seen = query_from_reference * correspondence.point;
            (seen.z > 0.1).then(|| (seen.coords.xy() / seen.z, correspondence))
        })
        .collect();
    let count = rays.len();
    if count < FEW_MATCHES {
        return None;
    }
    let aspect = stated.fy / stated.fx;
    let camera_of = |a: usize, b: usize| {
        let ((ray_a, a), (ray_b, b)) = (rays[a], rays[b]);
        let (rays, pixels) = (ray_a - ray_b, a.pixel - b.pixel);
        let scaled = Vector2::new(rays.x, rays.y * aspect);
        let squared = scaled.norm_squared();
        if squared < 0.01 {
            return None;
        }
        let fx = scaled.dot(&pixels) / squared;
        let within = (0.3..3.0).contains(&(fx / stated.fx));
        within.then(|| Intrinsics {
            fx,
            fy: fx * aspect,
            cx: a.pixel.x - fx * ray_a.x,
            cy: a.pixel.y - fx * aspect * ray_a.y,
            ..*stated
        })
    };
    let support = |camera: &Intrinsics| {
        rays.iter()
            .filter(|(ray, c)| {
                let u = camera.fx * ray.x + camera.cx - c.pixel.x;
                let v = camera.fy * ray.y + camera.cy - c.pixel.y;
                u.hypot(v) <= THRESHOLD_PX
            })
            .count()
    };
    (0..PAIRS)
        .filter_map(|k| {
            let a = k * 7919 % count;
            let b = (a + 1 + k * 104_729 % (count - 1)) % count;
            let camera = camera_of(a, b)?;
            Some((support(&camera), camera))
        })
        // Of equal ones the first.
        .reduce(|best, next| if next.0 > best.0 { next } else { best })
        .map(|(_, camera)| camera)
}
