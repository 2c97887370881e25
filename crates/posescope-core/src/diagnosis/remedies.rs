//! What might help against a verdict, to be tried.
//!
//! None of it uses the truth: a remedy that starts at the truth would be no remedy.

use super::Code;
use crate::estimator;
use crate::method::Method;
use crate::params::Params;

/// What is done differently.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// A parameter, as `--set` takes it: `grid.rounds=2`.
    Set(String),
    /// Another uncertainty radius \[m\].
    Radius(f64),
    /// Another method.
    Method(Method),
    /// Another reference: the one so many places farther from the one that was used.
    Reference(usize),
}

/// Changes that are tried together.
pub type Remedy = Vec<Change>;

/// What might help a method against its primary verdict, what is likeliest to help first.
pub fn remedies(code: Code, method: Method, params: &Params, radius_m: f64) -> Vec<Remedy> {
    let grid = &params.grid;
    let set = |key: &str, value: f64| Change::Set(format!("{key}={}", rounded(value)));
    let rounds = || Change::Set(format!("grid.rounds={}", (grid.rounds + 1).min(10)));
    let dense = || set("grid.coarse_step", grid.coarse_step_m / 2.0);
    let wide_yaw = || set("grid.yaw_range", (2.0 * grid.yaw_range_deg).min(180.0));
    let floor = |times: f64, least: f64| {
        set(
            "grid.coverage_floor",
            (grid.coverage_floor * times).max(least).min(1.0),
        )
    };
    let ratio = |by: f64| set("fb.ratio", (params.fb.ratio + by).clamp(0.1, 1.0));
    let keypoints = |by: f64| set("surf.threshold", params.surf.threshold * by);
    let radius = |times: f64| Change::Radius(rounded(radius_m * times));
    let splat = || Change::Set(format!("render.splat_px={}", params.render.splat_px + 2));
    let mut tried: Vec<Remedy> = match code {
        Code::D3 => vec![
            vec![rounds()],
            vec![dense()],
            vec![dense(), rounds()],
            vec![floor(3.0, 0.15)],
            vec![splat()],
            vec![wide_yaw(), rounds()],
            vec![dense(), floor(3.0, 0.15)],
        ],
        Code::D4 => vec![
            vec![radius(1.5)],
            vec![wide_yaw(), rounds()],
            vec![radius(2.0)],
            vec![floor(0.2, 0.0)],
            vec![set("grid.yaw_range", 45.0), rounds()],
        ],
        Code::D1 | Code::D8 => vec![
            vec![floor(2.0, 0.1)],
            vec![floor(4.0, 0.2)],
            vec![radius(1.5)],
            vec![radius(0.5)],
            vec![floor(8.0, 0.4)],
            vec![floor(2.0, 0.1), rounds()],
        ],
        Code::D2 | Code::D6 | Code::D7 => vec![
            vec![floor(4.0, 0.2)],
            vec![splat()],
            vec![radius(0.5)],
            vec![rounds()],
        ],
        Code::R2 => vec![vec![keypoints(0.2)], vec![keypoints(0.05)]],
        Code::R3 | Code::R7 => vec![
            vec![ratio(0.06)],
            vec![keypoints(0.2)],
            vec![keypoints(0.2), ratio(0.06)],
            vec![Change::Set("fb.accept=paper".to_owned())],
        ],
        Code::R4 | Code::R5 => vec![
            vec![set("fb.depth_radius", 2.0 * params.fb.depth_radius_px)],
            vec![Change::Set("fb.depth=guarded".to_owned())],
            vec![ratio(0.06)],
            vec![keypoints(0.2)],
        ],
        Code::R6 => vec![
            vec![Change::Set(format!(
                "fb.max_trials={}",
                (params.fb.mlesac.max_trials * 10).clamp(20_000, 10_000_000)
            ))],
            vec![
                Change::Set("fb.confidence=0.99999".to_owned()),
                Change::Set("fb.min_trials=10000".to_owned()),
            ],
            vec![ratio(-0.1)],
        ],
        Code::R8 => vec![
            vec![ratio(-0.1)],
            vec![Change::Set("fb.depth=guarded".to_owned())],
            vec![ratio(-0.2)],
        ],
        Code::R9 => vec![vec![radius(1.5)], vec![radius(2.0)], vec![radius(3.0)]],
        _ => Vec::new(),
    };
    // Whatever it is, another method or another reference may do better; a search from many starts first.
    let others = [Method::named("mi6")].into_iter().chain(Method::PAPER);
    let others = others.filter(|other| {
        *other != method && estimator::find(*other).is_some_and(|entry| entry.hybrid().is_none())
    });
    tried.extend(others.map(|other| vec![Change::Method(other)]));
    tried.extend((1..=2).map(|farther| vec![Change::Reference(farther)]));
    let is_change = |change: &Change| *change != Change::Radius(radius_m);
    tried.retain(|remedy| remedy.iter().all(is_change));
    tried
}

/// Three digits are enough, and are what the command line then says.
fn rounded(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_search_from_many_starts_is_the_first_other_method_and_twelve_runs_try_all() {
        let tried = remedies(Code::D3, Method::MI, &Params::default(), 10.0);
        assert!(tried.len() <= 12, "{tried:?}");
        let methods = tried.iter().flatten().filter_map(|change| match change {
            Change::Method(method) => Some(method.name()),
            _ => None,
        });
        assert_eq!(methods.collect::<Vec<_>>(), ["mi6", "fb", "pm"]);
    }

    #[test]
    fn every_remedy_is_one_that_the_parameters_take() {
        for &code in Code::ALL {
            for method in Method::PAPER {
                let params = Params::default();
                for remedy in remedies(code, method, &params, 10.0) {
                    let mut changed = params.clone();
                    for change in remedy {
                        if let Change::Set(assignment) = change {
                            let before = changed.clone();
                            changed
                                .assign(&assignment)
                                .expect("a parameter within its range");
                            assert_ne!(changed, before, "{code}: {assignment} changes nothing");
                        }
                    }
                }
            }
        }
    }
}
