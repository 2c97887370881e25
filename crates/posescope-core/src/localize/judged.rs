//! What a second opinion says of a result.

use super::result::QueryResult;
use crate::diagnosis::{Code, Diagnosis, Family, Grade};
use crate::opinion::{MatchesOfPose, Opinion, Standing};

impl QueryResult {
    /// Takes the opinion on its pose, with what the matches say that came with it. What speaks against a pose that is not
    /// known to be right is a verdict.
    pub(super) fn take_opinion(
        &mut self,
        opinion: Option<Opinion>,
        its_matches: Option<MatchesOfPose>,
    ) {
        let opinion = opinion.map(|opinion| match &its_matches {
            Some(MatchesOfPose { explained, .. }) => Opinion {
                because: format!("{} {}", opinion.because, explained.words()),
                matches: Some(explained.clone()),
                ..opinion
            },
            None => opinion,
        });
        if self.grade != Grade::Right {
            let verdict = opinion.as_ref().and_then(|opinion| {
                let code = match opinion.standing {
                    Standing::Confirmed => return None,
                    Standing::Contradicted if opinion.copied_from.is_some() => Code::E2,
                    Standing::Contradicted => Code::E3,
                    Standing::Undecided => Code::E4,
                };
                let (text, evidence) = (opinion.because.clone(), serde_json::json!({}));
                Some(Diagnosis { code, text, evidence })
            });
            // The convention of a file explains why its poses are contradicted; what one query only hints at does not.
            let is_certain = |one: &&Diagnosis| {
                let is_hint = one.evidence.get("certain").is_some_and(|certain| certain == false);
                one.code == Code::X1 && !is_hint
            };
            let place = self.diagnosis.iter().take_while(is_certain).count();
            let of_matches = |one: &Diagnosis| {
                let is_resized =
                    one.code == Code::X1 && one.evidence.pointer("/query/part").is_some();
                is_resized || one.code.rule().applies_to == Family::MATCHING
            };
            let said = its_matches.into_iter().flat_map(|said| said.verdicts).filter(of_matches);
            let said: Vec<Diagnosis> = verdict.as_ref().map_or(Vec::new(), |_| said.collect());
            self.diagnosis.splice(place..place, verdict.into_iter().chain(said));
        }
        let is_confirmed = |one: &&Opinion| one.standing == Standing::Confirmed;
        if let Some(opinion) = opinion.as_ref().filter(is_confirmed)
            && let Some(error) = self.error.filter(|_| self.grade == Grade::Wrong)
        {
            // The truth alone stands against two that found the pose independently, but with the same camera. What is
            // said of clouds and conventions rests on the truth.
            let is_kept = |one: &Diagnosis| {
                let is_of = |key: &str| one.evidence.get(key).is_some();
                one.code != Code::X1 || is_of("error") || is_of("explained")
            };
            self.diagnosis.retain(is_kept);
            if !self.diagnosis.iter().any(|one| one.code == Code::X1) {
                let text = format!(
                    "The ground truth is suspect, or the query's camera: two systems find this pose, which is {} from \
                     the truth. {}",
                    error.greater(),
                    opinion.because
                );
                let probability = opinion.probability;
                let evidence = serde_json::json!({ "error": error, "probability": probability });
                self.diagnosis.insert(0, Diagnosis { code: Code::X1, text, evidence });
            }
        }
        self.opinion = opinion;
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::super::result::SCHEMA;
    use super::*;

    #[test]
    fn an_opinion_comes_behind_what_explains_it_and_before_a_hint() {
        let opinion = json!({
            "standing": "contradicted", "probability": 0.01, "within": {"m": 1.0, "deg": 5.0},
            "offset_m": null, "offset_deg": null, "interval_m": null, "better": null, "by": null,
            "because": "The photos agree elsewhere."
        });
        let opinion: Opinion = serde_json::from_value(opinion).expect("an opinion");
        for (certain, codes) in [(true, [Code::X1, Code::E3]), (false, [Code::E3, Code::X1])] {
            let result = json!({
                "schema": SCHEMA, "scene": "street", "query": "000070", "references": ["000062"],
                "method": "fb", "seed": 0, "status": "ok", "grade": "unmeasured",
                "diagnosis": [{"code": "X1", "text": "A camera.", "evidence": {"certain": certain}}]
            });
            let mut result: QueryResult = serde_json::from_value(result).expect("a result");
            result.take_opinion(Some(opinion.clone()), None);
            let found: Vec<Code> = result.diagnosis.iter().map(|one| one.code).collect();
            assert_eq!(found, codes);
        }
    }
}
