//! What might help against a verdict, to be tried.
//!
//! None of it uses the truth: a remedy that starts at the truth would be no remedy. Each rule lists what may
//! help its verdict for the method at hand; another method or another reference may help against any.

use serde_json::Value;

use super::{Code, Diagnosis, Family, confidence};
use crate::estimator;
use crate::method::Method;
use crate::params::Params;

pub use super::ask::{Ask, Change, Remedy};
use super::ask::{many_starts, method, other_references};

/// What might help a method against its primary verdict, in the order of what mended most in `studies remedies`. For a
/// hybrid, the method whose pose it took counts.
pub fn remedies(
    found: &Diagnosis,
    method: Method,
    fell_back: bool,
    params: &Params,
    radius_m: f64,
) -> Vec<Remedy> {
    let responsible = confidence::responsible_of(method, fell_back);
    let rule = found.code.rule();
    // A rule about features says nothing of a method that has none, and one about costs nothing of features.
    let is_of = |family: &Family| {
        [Family::MATCHING, Family::SEARCHING]
            .iter()
            .any(|kind| kind.contains(family) && rule.applies_to.iter().any(|of| kind.contains(of)))
    };
    let family = Family::of(responsible, params);
    let is_given = family == Some(Family::Given);
    let evidence = &found.evidence;
    let ask = family.map(|family| Ask { method: responsible, family, params, radius_m, evidence });
    let of_rule = ask.filter(|_| !is_given).map_or(Vec::new(), |ask| {
        let listed = (rule.remedies)(&ask);
        if is_of(&ask.family) {
            // What was changed by hand is the first suspect.
            reset(responsible, params).into_iter().chain(listed).collect()
        } else {
            listed.into_iter().filter(changes_no_setting).collect()
        }
    });
    let mut tried = each_once(of_rule.into_iter().chain(others(is_given)));
    let is_change = |change: &Change| match change {
        Change::Radius(other) => *other != radius_m,
        Change::Set(assignment) => {
            let mut changed = params.clone();
            changed.assign(assignment).is_ok() && changed != *params
        }
        Change::Method(other) => ![method, responsible].contains(other),
        Change::Reference(_) | Change::Fusion(_) | Change::Ranked(_) => true,
    };
    tried.retain(|remedy| {
        remedy.iter().all(is_change) && ask.is_none_or(|ask| is_given || ask.reaches(remedy))
    });
    tried
}

/// What may help against any verdict, in the order of what mends most. The pose of another system depends on no
/// reference.
fn others(is_given: bool) -> Vec<Remedy> {
    let ([robust, mi6], [farther, nearer]) = (many_starts(), other_references());
    let all = [robust, farther, mi6, nearer].into_iter().chain(["fb", "fb2", "mi"].map(method));
    let depends = |one: &Remedy| !(is_given && matches!(one[..], [Change::Reference(_)]));
    all.filter(depends).collect()
}

/// Everything that may help a method against any verdict: what each rule lists, every other method, and other
/// references.
pub fn candidates(method: Method, fell_back: bool, params: &Params, radius_m: f64) -> Vec<Remedy> {
    let listed = Code::ALL.iter().flat_map(|&code| {
        let found = Diagnosis { code, text: String::new(), evidence: Value::Null };
        remedies(&found, method, fell_back, params, radius_m)
    });
    let others = estimator::methods().filter(|other| *other != method);
    let all = listed.chain(others.map(|other| vec![Change::Method(other)]));
    each_once(all)
}

/// The remedies where they stand first.
fn each_once(all: impl Iterator<Item = Remedy>) -> Vec<Remedy> {
    let mut found: Vec<Remedy> = Vec::new();
    for remedy in all {
        if !found.contains(&remedy) {
            found.push(remedy);
        }
    }
    found
}

/// Whether a remedy is another method or other references alone.
fn changes_no_setting(remedy: &Remedy) -> bool {
    !remedy.iter().any(|change| matches!(change, Change::Set(_) | Change::Radius(_)))
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

    fn of(code: Code, method: Method, params: &Params) -> Vec<Remedy> {
        remedies(&found(code, Value::Null), method, false, params, 10.0)
    }

    fn found(code: Code, evidence: Value) -> Diagnosis {
        Diagnosis { code, text: String::new(), evidence }
    }

    #[test]
    fn no_advice_against_given_matches_is_about_features_of_our_own() {
        let params = Params::default();
        let words = ["surf", "fb.ratio", "fb2"];
        for rule in RULES.iter().filter(|rule| rule.applies_to == Family::MATCHING) {
            let given = serde_json::json!({ GIVEN_MATCHES: true });
            let advice = rule.code.advice(Some(Family::Features), &given);
            assert!(!words.iter().any(|word| advice.contains(word)), "{}: {advice}", rule.code);
            let tried = of(rule.code, Method::FB, &params).into_iter();
            let tried: Vec<Remedy> = tried.filter(|remedy| !changes_matching(remedy)).collect();
            let named = format!("{tried:?}");
            assert!(!named.contains("surf.") && !named.contains("fb.ratio"), "{named}");
        }
        // Without given matches, it is.
        let advice = Code::R2.advice(Some(Family::Features), &serde_json::json!({}));
        assert_eq!(advice, "lower surf.threshold");
    }

    #[test]
    fn where_the_reference_does_not_see_the_scene_nothing_is_matched_otherwise() {
        let params = Params::default();
        let far = serde_json::json!({ "distance_m": 50.0, "allowed_m": 11.0 });
        let is_reference = |remedy: &Remedy| matches!(remedy[..], [Change::Reference(_)]);
        for method in [Method::FB, Method::named("fb2")] {
            let unseen = of(Code::R1, method, &params);
            assert!(is_reference(&unseen[0]) && is_reference(&unseen[1]), "{unseen:?}");
            assert!(!unseen.iter().any(changes_matching), "{unseen:?}");
            let too_far = remedies(&found(Code::R3, far.clone()), method, false, &params, 10.0);
            assert!(too_far.len() == 2 && too_far.iter().all(is_reference), "{too_far:?}");
            let family = Family::of(method, &params);
            assert!(Code::R3.advice(family, &far).starts_with("use another reference"));
        }
        // So it is for a search that says so itself.
        assert!(is_reference(&of(Code::R1, Method::MI, &params)[0]));
        // A greater radius is tried where it reaches the truth, and a method that ends at the same radius is not.
        let near = serde_json::json!({ "distance_m": 14.0, "radius_m": 10.0, "is_turned": false });
        let tried = remedies(&found(Code::D4, near), Method::MI, false, &params, 10.0);
        assert_eq!(tried[0], [Change::Radius(15.0)]);
        assert!(
            tried.iter().all(|one| is_reference(one) || matches!(one[..], [Change::Radius(_)]))
        );
    }

    #[test]
    fn another_system_gets_no_advice_about_our_parameters() {
        let (params, mine) = (Params::default(), Method::called("mine").expect("a name"));
        let groups: Vec<String> = params
            .list()
            .iter()
            .filter_map(|one| Some(format!("{}.", one.key.split_once('.')?.0)))
            .collect();
        for rule in RULES {
            let tried = of(rule.code, mine, &params).concat();
            let is_method = |change: &Change| matches!(change, Change::Method(_));
            assert!(tried.iter().all(is_method), "{}: {tried:?}", rule.code);
            if rule.applies_to.contains(&Family::Given) {
                let advice = rule.code.advice(Some(Family::Given), &Value::Null);
                let names = groups.iter().any(|group| advice.contains(group));
                assert!(!names && !advice.contains("search="), "{}: {advice}", rule.code);
            }
        }
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
        let first = |method| of(Code::R3, method, &params).swap_remove(0);
        let mut found = first(Method::FB);
        found.sort_by_key(|change| format!("{change:?}"));
        assert_eq!(found, back);
    }

    #[test]
    fn searches_from_many_starts_are_the_first_other_methods_and_twelve_runs_try_all() {
        let tried = of(Code::D3, Method::MI, &Params::default());
        assert!(tried.len() <= 12, "{tried:?}");
        let methods = tried.iter().flatten().filter_map(|change| match change {
            Change::Method(method) => Some(method.name()),
            _ => None,
        });
        assert_eq!(methods.collect::<Vec<_>>(), ["robust", "mi6", "fb", "fb2"]);
    }

    #[test]
    fn what_runs_inside_of_a_method_is_suspected_too() {
        let mut params = Params::default();
        for assignment in ["robust.credit=100", "surf.max_keypoints=30", "mi.bins=8"] {
            params.assign(assignment).expect("a parameter");
        }
        let first = of(Code::D2, Method::named("robust"), &params).swap_remove(0);
        let default = Params::default().robust.credit;
        let back = ["surf.max_keypoints=0".to_owned(), format!("robust.credit={default}")];
        assert_eq!(first, back.map(Change::Set));
    }

    /// In `studies remedies`, `robust` mends more of what a grid missed than the method's own cost from many starts.
    #[test]
    fn a_grid_that_missed_a_minimum_is_offered_searches_from_many_starts() {
        for method in ["pm", "mi", "nid"] {
            let tried = of(Code::D3, Method::named(method), &Params::default());
            assert_eq!(tried[0], super::method("robust"));
            assert_eq!(tried[1], [Change::Set(format!("{method}.search=starts"))]);
        }
    }

    #[test]
    fn the_first_remedy_is_the_one_that_the_advice_names() {
        let params = Params::default();
        for (code, method, words) in [
            (Code::D2, "mi", "--method robust"),
            (Code::D2, "robust", "another reference"),
            (Code::D3, "mi", "--method robust"),
            (Code::D3, "mi6", "another reference"),
            (Code::R1, "fb", "another reference"),
            (Code::R3, "fb2", "--method robust"),
            (Code::R7, "fb", "fb.accept=paper"),
            (Code::H1, "fb", "--method robust"),
        ] {
            let method = Method::named(method);
            let first = match &of(code, method, &params)[0][..] {
                [Change::Method(other)] => format!("--method {other}"),
                [Change::Reference(_)] => "another reference".to_owned(),
                [Change::Set(assignment)] => assignment.clone(),
                other => panic!("{code}: {other:?}"),
            };
            assert_eq!(first, words, "{code} of {method}");
            let advice = code.advice(Family::of(method, &params), &Value::Null);
            assert!(advice.contains(words), "{code} of {method}: {advice}");
        }
    }

    #[test]
    fn a_descent_is_offered_another_search_and_none_that_it_does_not_do() {
        let mut params = Params::default();
        params.assign("pm.search=descent").expect("a parameter");
        for code in [Code::D2, Code::D3, Code::D4, Code::D8] {
            let tried = of(code, Method::PM, &params);
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
                for change in of(rule.code, method, params).concat() {
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
        let of = |code, fell_back| {
            remedies(&found(code, Value::Null), Method::HY, fell_back, &params, 10.0)
        };
        let keys = |remedies: Vec<Remedy>| format!("{remedies:?}");
        assert!(keys(of(Code::R8, false)).contains("fb.ratio"));
        assert!(keys(of(Code::D3, true)).contains("grid.rounds"));
    }
}
