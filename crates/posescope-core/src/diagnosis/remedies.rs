//! What might help against a verdict, to be tried.
//!
//! None of it uses the truth: a remedy that starts at the truth would be no remedy. Each rule lists what may
//! help its verdict for the method at hand; another method or another reference may help against any.

use super::Family;
use super::{Code, confidence};
use crate::estimator;
use crate::method::Method;
use crate::params::Params;

pub use super::ask::{Ask, Change, Remedy};

/// What might help a method against its primary verdict, the likeliest first. For a hybrid, the method
/// whose pose it took counts.
pub fn remedies(
    code: Code,
    method: Method,
    fell_back: bool,
    params: &Params,
    radius_m: f64,
) -> Vec<Remedy> {
    let responsible = confidence::responsible_of(method, fell_back);
    let rule = code.rule();
    // A rule about features says nothing of a method that has none, and one about costs nothing of features.
    let is_of = |family: &Family| {
        [Family::MATCHING, Family::COSTED]
            .iter()
            .any(|kind| kind.contains(family) && rule.applies_to.iter().any(|of| kind.contains(of)))
    };
    let mut tried = match Family::of(responsible).filter(is_of) {
        None | Some(Family::Given) => Vec::new(),
        Some(family) => {
            let of_rule = (rule.remedies)(&Ask { family, params, radius_m });
            // What was changed by hand is the first suspect.
            reset(&family.groups(responsible), params).into_iter().chain(of_rule).collect()
        }
    };
    // Whatever it is, another method or another reference may do better; a search from many starts first.
    let others = [Method::named("mi6")].into_iter().chain(Method::PAPER);
    let others = others.filter(|other| {
        *other != method && estimator::find(*other).is_some_and(|entry| entry.hybrid().is_none())
    });
    tried.extend(others.map(|other| vec![Change::Method(other)]));
    tried.extend((1..=2).map(|farther| vec![Change::Reference(farther)]));
    let is_change = |change: &Change| match change {
        Change::Radius(other) => *other != radius_m,
        Change::Set(assignment) => {
            let mut changed = params.clone();
            changed.assign(assignment).is_ok() && changed != *params
        }
        Change::Method(_) | Change::Reference(_) => true,
    };
    tried.retain(|remedy| remedy.iter().all(is_change));
    tried
}

/// The parameters of these groups that differ from their defaults, back at them.
fn reset(groups: &[&str], params: &Params) -> Option<Remedy> {
    let changed = params.list().into_iter().zip(params.defaults().list());
    let changed = changed.filter(|(now, default)| {
        let group = now.key.split('.').next().unwrap_or_default();
        groups.contains(&group) && now.value != default.value
    });
    let back: Remedy = changed
        .map(|(now, default)| Change::Set(format!("{}={}", now.key, default.value)))
        .collect();
    (!back.is_empty()).then_some(back)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::RULES;

    #[test]
    fn what_was_changed_by_hand_is_set_back_first() {
        let mut params = Params::default();
        for assignment in ["surf.max_keypoints=30", "fb.ratio=0.3", "mi.bins=8"] {
            params.assign(assignment).expect("a parameter");
        }
        let default = Params::default();
        let set = |text: String| Change::Set(text);
        let back = vec![
            set(format!("fb.ratio={}", default.fb.ratio)),
            set("surf.max_keypoints=0".to_owned()),
        ];
        let first = |method| remedies(Code::R3, method, false, &params, 10.0).swap_remove(0);
        let mut found = first(Method::FB);
        found.sort_by_key(|change| format!("{change:?}"));
        assert_eq!(found, back);
    }

    #[test]
    fn a_search_from_many_starts_is_the_first_other_method_and_twelve_runs_try_all() {
        let tried = remedies(Code::D3, Method::MI, false, &Params::default(), 10.0);
        assert!(tried.len() <= 12, "{tried:?}");
        let methods = tried.iter().flatten().filter_map(|change| match change {
            Change::Method(method) => Some(method.name()),
            _ => None,
        });
        assert_eq!(methods.collect::<Vec<_>>(), ["mi6", "fb", "pm"]);
    }

    #[test]
    fn a_remedy_changes_only_what_the_method_reads() {
        let params = Params::default();
        for rule in RULES {
            for method in estimator::methods() {
                let Some(family) = Family::of(method) else {
                    continue;
                };
                for change in remedies(rule.code, method, false, &params, 10.0).concat() {
                    let Change::Set(assignment) = change else {
                        continue;
                    };
                    let key = assignment.split('=').next().unwrap_or_default();
                    let group = key.split('.').next().unwrap_or_default();
                    assert!(
                        family.groups(method).contains(&group),
                        "{} of {method}: {assignment}",
                        rule.code
                    );
                    // A search from many starts has one round and yaws of its own.
                    let is_grid_alone = ["grid.rounds", "grid.yaw_range"].contains(&key);
                    assert!(!is_grid_alone || family == Family::Grid, "{method}: {assignment}");
                }
            }
        }
    }

    #[test]
    fn a_hybrid_gets_the_remedies_of_the_method_that_it_took() {
        let params = Params::default();
        let of = |fell_back| remedies(Code::R8, Method::HY, fell_back, &params, 10.0);
        assert!(of(false).len() >= 3);
        let keys = |remedies: Vec<Remedy>| format!("{remedies:?}");
        assert!(keys(of(false)).contains("fb.ratio"));
        let of_search = remedies(Code::D3, Method::HY, true, &params, 10.0);
        assert!(keys(of_search).contains("grid.rounds"));
    }
}
