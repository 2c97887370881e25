//! Two files of poses of the same queries: which of them do the photos support?

use std::collections::BTreeMap;

use crate::diagnosis::confidence::Within;
use crate::estimator;
use crate::geometry::{Pose, PoseError};
use crate::localize::{PoseReport, QueryResult};
use crate::method::Method;
use crate::opinion::BetterPose;
use crate::table::Table;

/// Which of two files the photos support, query by query.
#[derive(Clone, Debug, PartialEq)]
pub struct Rivals {
    /// The two files.
    pub methods: [Method; 2],
    /// The queries with a pose in both files.
    pub queries: Vec<Rivalry>,
}

/// A query with a pose in two files.
#[derive(Clone, Debug, PartialEq)]
pub struct Rivalry {
    /// The query.
    pub query: String,
    /// How far each pose is from posescope's own; `None` where that is not trusted.
    pub off: Option<[PoseError; 2]>,
    /// Which of them the photos support, 0 or 1; `None` where that stays open.
    pub supported: Option<usize>,
}

/// How much nearer a pose must be to posescope's own, as a share of how far off that may be itself.
const TELLING: f64 = 1.0;

/// All pairs of other systems that have poses of the same queries.
pub fn rivals(results: &[&QueryResult]) -> Vec<Rivals> {
    // Other radii and fusions compare the same poses.
    let mut by_query: BTreeMap<(&str, &str), BTreeMap<Method, &QueryResult>> = BTreeMap::new();
    for result in results.iter().filter(|result| estimator::find(result.method).is_none()) {
        // Frames of two scenes may have one name.
        let scene = result.query_scene.as_ref().unwrap_or(&result.scene);
        let of_query = by_query.entry((scene, &result.query)).or_default();
        of_query.entry(result.method).or_insert(result);
    }
    let mut found: BTreeMap<[Method; 2], Rivals> = BTreeMap::new();
    for ((_, query), of_query) in by_query {
        let pose = |result: &QueryResult| result.pose.as_ref().and_then(PoseReport::to_pose);
        let posed = of_query.iter().filter_map(|(method, result)| Some((*method, pose(result)?)));
        let posed: Vec<(Method, Pose)> = posed.collect();
        let own = of_query.values().find_map(|one| one.opinion.as_ref()?.own.as_ref());
        for (at, first) in posed.iter().enumerate() {
            for second in &posed[at + 1..] {
                let methods = [first.0, second.0];
                let nothing = || Rivals { methods, queries: Vec::new() };
                let rivals = found.entry(methods).or_insert_with(nothing);
                rivals.queries.push(Rivalry::between(query, own, [&first.1, &second.1]));
            }
        }
    }
    found.into_values().collect()
}

impl Rivalry {
    fn between(query: &str, own: Option<&BetterPose>, given: [&Pose; 2]) -> Self {
        let own = own.and_then(|own| Some((own.to_pose()?, own.within_95?)));
        let off = own.map(|(pose, _)| given.map(|given| PoseError::between(&pose, given)));
        let supported = own.zip(off).and_then(|((_, within), off)| {
            let [first, second] = off.map(|error| share(&error, within));
            ((first - second).abs() >= TELLING).then_some(usize::from(second < first))
        });
        Self { query: query.to_owned(), off, supported }
    }
}

/// How far off a pose is, as a share of how far off posescope's own may be.
fn share(error: &PoseError, own: Within) -> f64 {
    (error.translation_m / own.m).max(error.rotation_deg / own.deg)
}

impl Rivals {
    /// What is found, in a sentence.
    pub fn words(&self) -> String {
        let [first, second] = self.methods;
        let count = |supported: Option<usize>| {
            self.queries.iter().filter(|one| one.supported == supported).count()
        };
        format!(
            "Of {} queries with a pose of {first} and of {second}, the photos support {first} in {} and {second} in {}; {} \
             stay open.",
            self.queries.len(),
            count(Some(0)),
            count(Some(1)),
            count(None)
        )
    }

    /// A row per query, with the distances from posescope's own pose.
    pub fn table(&self) -> Table {
        let of = |what: &str| self.methods.map(|method| format!("{method} {what}"));
        let [first_m, second_m] = of("off (m)");
        let [first_deg, second_deg] = of("turned (°)");
        let header = ["query", "supported", &first_m, &first_deg, &second_m, &second_deg];
        let mut table = Table::new("rivals", self.words(), header);
        for one in &self.queries {
            let supported = one.supported.map(|which| self.methods[which].to_string());
            let mut row = vec![one.query.clone(), supported.unwrap_or_else(|| "open".to_owned())];
            for which in 0..2 {
                let off = one.off.map(|off| off[which]);
                let number = |number: Option<f64>, digits: usize| {
                    number.map_or("–".to_owned(), |number| format!("{number:.digits$}"))
                };
                row.push(number(off.map(|off| off.translation_m), 3));
                row.push(number(off.map(|off| off.rotation_deg), 2));
            }
            table.push(row);
        }
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::PoseConfidence;
    use crate::diagnosis::Tolerance;
    use crate::measure::metrics::tests::row;
    use crate::opinion::{Opinion, OwnAnswer};

    /// A given pose, so far to the right of posescope's own, which is known to 0.05 m.
    fn given(query: &str, method: &str, right_m: f64, probability: f64) -> QueryResult {
        let right = Tolerance::default();
        let confidence = PoseConfidence {
            within_95: Some(Within { m: 0.05, deg: 0.2 }),
            ..PoseConfidence::new(probability, right.into())
        };
        let own = OwnAnswer {
            method: Method::FB,
            pose: Pose::identity(),
            confidence: Some(confidence),
            given_costs_more: None,
        };
        let pose = Pose::translation(right_m, 0.0, 0.0);
        QueryResult {
            method: Method::called(method).expect("a name"),
            pose: Some(PoseReport::from(&pose)),
            opinion: Some(Opinion::of(&pose, right, &[own], "")),
            ..row(query, "fb", None)
        }
    }

    #[test]
    fn the_photos_support_what_is_nearer_if_it_can_be_told() {
        let rows = [
            given("1", "a", 0.01, 0.99),
            given("1", "b", 0.11, 0.99),
            given("2", "a", 0.09, 0.99),
            given("2", "b", -0.02, 0.99),
            // Too near to each other, and an own pose that is not trusted.
            given("3", "a", 0.02, 0.99),
            given("3", "b", -0.04, 0.99),
            given("4", "a", 0.0, 0.6),
            given("4", "b", 2.0, 0.6),
            // Nothing to compare with.
            given("5", "a", 0.0, 0.99),
        ];
        let mut rows: Vec<&QueryResult> = rows.iter().collect();
        let found = rivals(&rows);
        let names = found[0].methods.map(|method| method.to_string());
        assert_eq!((found.len(), names), (1, ["a".to_owned(), "b".to_owned()]));
        let supported: Vec<_> =
            found[0].queries.iter().map(|one| (one.query.as_str(), one.supported)).collect();
        assert_eq!(supported, [("1", Some(0)), ("2", Some(1)), ("3", None), ("4", None)]);
        assert!(found[0].words().contains("support a in 1 and b in 1; 2 stay open"));
        // Other settings say the same of the same poses.
        rows.extend(rows.clone());
        rows.reverse();
        assert_eq!(rivals(&rows), found);
        // Those of another scene whose frames have the same names count beside them.
        let others = rows.iter().map(|row| QueryResult { scene: "other".into(), ..(*row).clone() });
        let others: Vec<QueryResult> = others.collect();
        let both: Vec<&QueryResult> = rows.iter().copied().chain(&others).collect();
        assert!(rivals(&both)[0].words().contains("support a in 2 and b in 2; 4 stay open"));
        let alone: Vec<&QueryResult> =
            rows.into_iter().filter(|row| row.method.to_string() == "a").collect();
        assert_eq!(rivals(&alone), []);
    }
}
