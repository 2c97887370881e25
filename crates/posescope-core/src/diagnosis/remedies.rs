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
        [Family::MATCHING, Family::SEARCHING]
            .iter()
            .any(|kind| kind.contains(family) && rule.applies_to.iter().any(|of| kind.contains(of)))
    };
    let mut tried = match Family::of(responsible, params).filter(is_of) {
        None | Some(Family::Given) => Vec::new(),
        Some(family) => {
            let of_rule = (rule.remedies)(&Ask { method: responsible, family, params, radius_m });
            // What was changed by hand is the first suspect.
            reset(responsible, params).into_iter().chain(of_rule).collect()
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

/// Everything that may help a method against any verdict: what each rule lists, every other method, and other
/// references.
pub fn candidates(method: Method, fell_back: bool, params: &Params, radius_m: f64) -> Vec<Remedy> {
    let listed =
        Code::ALL.iter().flat_map(|&code| remedies(code, method, fell_back, params, radius_m));
    let others = estimator::methods().filter(|other| *other != method);
    let all = listed.chain(others.map(|other| vec![Change::Method(other)]));
    let mut candidates: Vec<Remedy> = Vec::new();
    for remedy in all {
        if !candidates.contains(&remedy) {
            candidates.push(remedy);
        }
    }
    candidates
}

/// Whether a remedy changes how features are detected or matched. It does nothing for matches of another system.
pub fn changes_matching(remedy: &Remedy) -> bool {
    const MATCHING: [&str; 3] = ["surf.", "fb.ratio=", "fb.unique="];
    remedy.iter().any(|change| match change {
        Change::Set(assignment) => MATCHING.iter().any(|key| assignment.starts_with(key)),
        _ => false,
    })
}

/// The parameters that a method reads and that differ from their defaults, back at them.
fn reset(method: Method, params: &Params) -> Option<Remedy> {
    let entry = estimator::find(method)?;
    let changed = params.list().into_iter().zip(params.defaults().list());
    let changed = changed
        .filter(|(now, default)| now.value != default.value && entry.reads(params, &now.key));
    let back: Remedy = changed
        .map(|(now, default)| Change::Set(format!("{}={}", now.key, default.value)))
        .collect();
    (!back.is_empty()).then_some(back)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::RULES;
    use crate::diagnosis::rules::GIVEN_MATCHES;

    #[test]
    fn no_advice_against_given_matches_is_about_features_of_our_own() {
        let params = Params::default();
        let words = ["surf", "fb.ratio", "fb2"];
        for rule in RULES.iter().filter(|rule| rule.applies_to == Family::MATCHING) {
            let given = serde_json::json!({ GIVEN_MATCHES: true });
            let advice = rule.code.advice(Some(Family::Features), &given);
            assert!(!words.iter().any(|word| advice.contains(word)), "{}: {advice}", rule.code);
            let tried = remedies(rule.code, Method::FB, false, &params, 10.0).into_iter();
            let tried: Vec<Remedy> = tried.filter(|remedy| !changes_matching(remedy)).collect();
            let named = format!("{tried:?}");
            assert!(!named.contains("surf.") && !named.contains("fb.ratio"), "{named}");
        }
        // Without given matches, it is.
        let advice = Code::R2.advice(Some(Family::Features), &serde_json::json!({}));
        assert_eq!(advice, "lower surf.threshold");
    }

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
    fn what_runs_inside_of_a_method_is_suspected_too() {
        let mut params = Params::default();
        for assignment in ["robust.credit=100", "surf.max_keypoints=30", "mi.bins=8"] {
            params.assign(assignment).expect("a parameter");
        }
        let first =
            remedies(Code::D2, Method::named("robust"), false, &params, 10.0).swap_remove(0);
        let default = Params::default().robust.credit;
        let back = ["surf.max_keypoints=0".to_owned(), format!("robust.credit={default}")];
        assert_eq!(first, back.map(Change::Set));
    }

    #[test]
    fn a_grid_that_missed_a_minimum_is_offered_a_search_from_many_starts() {
        for method in ["pm", "mi", "nid"] {
            let tried = remedies(Code::D3, Method::named(method), false, &Params::default(), 10.0);
            assert_eq!(tried[0], [Change::Set(format!("{method}.search=starts"))]);
        }
    }

    #[test]
    fn a_descent_is_offered_another_search_and_none_that_it_does_not_do() {
        let mut params = Params::default();
        params.assign("pm.search=descent").expect("a parameter");
        for code in [Code::D2, Code::D3, Code::D4, Code::D8] {
            let tried = remedies(code, Method::PM, false, &params, 10.0);
            let set = tried.concat().into_iter().filter_map(|change| match change {
                Change::Set(assignment) => Some(assignment),
                _ => None,
            });
            let set: Vec<String> = set.collect();
            assert_eq!(set[0], "pm.search=grid", "{code}");
            assert!(set.iter().all(|one| !one.starts_with("grid.")), "{code}: {set:?}");
        }
    }

    #[test]
    fn a_remedy_changes_only_what_the_method_reads() {
        let searches = ["grid", "starts", "descent"].map(|search| {
            let mut params = Params::default();
            params.set("pm.search", search).expect("a search");
            params
        });
        for (rule, params) in
            RULES.iter().flat_map(|rule| searches.iter().map(move |of| (rule, of)))
        {
            for method in estimator::methods() {
                for change in remedies(rule.code, method, false, params, 10.0).concat() {
                    let Change::Set(assignment) = change else {
                        continue;
                    };
                    let key = assignment.split('=').next().unwrap_or_default();
                    let is_read = estimator::entry(method).reads(params, key);
                    assert!(is_read, "{} of {method}: {assignment}", rule.code);
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
