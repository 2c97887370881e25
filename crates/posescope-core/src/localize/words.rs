//! A result in words. Terminal, recording and report only lay these out.

use super::result::{QueryResult, Status};
use crate::diagnosis::{Code, Diagnosis, Grade, confidence};
use crate::scale::LengthUnit;

impl QueryResult {
    /// The method, with the fusion where references were fused.
    pub fn method_name(&self) -> String {
        match &self.fusion {
            Some(fusion) => format!("{} {fusion}", self.method),
            None => self.method.to_string(),
        }
    }

    /// How far the pose is off: the distance, and where it is wrong for its heading, the angle.
    pub fn off(&self) -> Option<String> {
        let error = self.error.as_ref()?;
        let off = if self.grade == Grade::Wrong { error.greater() } else { error.translation() };
        Some(self.unit.words(&off))
    }

    /// How wrong it is, as far as is known: by the truth, by a second opinion, or that there is no pose.
    pub fn how_wrong(&self) -> String {
        match (self.off(), self.opinion.as_ref().filter(|_| self.is_suspect())) {
            (Some(off), _) => format!("{off} off"),
            (None, Some(opinion)) => self.unit.words(&opinion.words()),
            (None, None) => self.grade.to_string(),
        }
    }

    /// Says in the unit what its sentences say in metres.
    pub(super) fn put_into_words_of(&mut self, unit: LengthUnit) {
        self.unit = unit;
        let reason = self.reason.iter_mut().map(|reason| &mut reason.text);
        let verdicts = self.diagnosis.iter_mut().map(|verdict| &mut verdict.text);
        for text in reason.chain(verdicts) {
            *text = unit.words(text);
        }
        if let Some(opinion) = &mut self.opinion {
            opinion.because = unit.words(&opinion.because);
        }
        for one in self.per_reference.iter_mut().flatten() {
            one.put_into_words_of(unit);
        }
    }

    /// Query, method and error in a line, with the primary verdict.
    pub fn headline(&self) -> String {
        let worth = self.off().unwrap_or_else(|| self.grade.to_string());
        let text = format!("{} {}, {worth}", self.query, self.method_name());
        match self.verdict() {
            Some(verdict) => format!("{text}: {verdict}"),
            None => text,
        }
    }

    /// The primary verdict: its code and its sentences.
    pub fn verdict(&self) -> Option<String> {
        let primary = self.diagnosis.first()?;
        Some(format!("{} {}", primary.code, primary.text))
    }

    /// What to try against a verdict of this result.
    pub fn advice(&self, found: &Diagnosis) -> &'static str {
        if found.code == Code::L1 && self.status == Status::Failed {
            return "lower --min-confidence or fb2.least_probability to see the refused pose";
        }
        found.code.advice(self.family(), &found.evidence)
    }

    /// What follows the primary verdict, a paragraph each: other verdicts, what to try, what helped.
    pub fn paragraphs(&self) -> Vec<String> {
        let Some((primary, others)) = self.diagnosis.split_first() else {
            return Vec::new();
        };
        let also = others.iter().map(|one| format!("also {}: {}", one.code, one.text));
        let mut paragraphs: Vec<String> = also.collect();
        let Some(explanation) = &self.explanation else {
            if self.is_suspect() {
                paragraphs.push(format!("try: {}", self.advice(primary)));
            }
            return paragraphs;
        };
        for helped in &explanation.helped {
            let args = helped.args.join(" ");
            let error = self.unit.words(&helped.error.to_string());
            paragraphs.push(format!("helped: {args} ({error})"));
        }
        if explanation.helped.is_empty() {
            paragraphs.push(match explanation.runs {
                1 => "the one remedy that was tried did not help".to_owned(),
                runs => format!("none of the {runs} remedies that were tried helped"),
            });
            paragraphs.push(format!("try: {}", self.advice(primary)));
        }
        if !explanation.complete {
            paragraphs.push("stopped before all remedies were tried".to_owned());
        }
        paragraphs
    }

    /// What the result rests on, in a few words; without the truth also how likely it is right.
    pub fn evidence(&self) -> String {
        let rests_on = self.rests_on();
        match &self.confidence {
            Some(known) if self.grade == Grade::Unmeasured => {
                let interval = known.interval().map(|words| format!(" ({words})"));
                let because = known.because().map(|why| format!(", because {why}"));
                let words = format!(
                    "{} {}, {} likely within {} m{}{}; {rests_on}",
                    known.word.glyph(),
                    known.word,
                    confidence::percent(known.probability),
                    known.within.m,
                    interval.unwrap_or_default(),
                    because.unwrap_or_default()
                );
                self.unit.words(&words)
            }
            _ => match &self.opinion {
                Some(opinion) => self.unit.words(&format!("{}; {rests_on}", opinion.words())),
                None => rests_on,
            },
        }
    }

    fn rests_on(&self) -> String {
        // That a pose is uncertain says less than what speaks for it, and has its own paragraph.
        let primary = self.diagnosis.first();
        if let Some(primary) = primary.filter(|primary| primary.code.is_failure()) {
            return format!("{} {}", primary.code, primary.code.title());
        }
        if let Some(reason) = &self.reason {
            return format!("{}: {}", reason.code, reason.text);
        }
        if let Some(cost) = &self.cost {
            let part = |words: &str, cost: Option<f64>| {
                cost.map_or(String::new(), |cost| format!(", {words} {cost:.4}"))
            };
            let (truth, shuffled) = (part("at truth", cost.truth), part("shuffled", cost.shuffled));
            return format!("cost {:.4}{truth}{shuffled}", cost.best);
        }
        if !self.costs_at_pose.is_empty() {
            let costs = self.costs_at_pose.iter().filter_map(|one| {
                let truth = one.truth.map(|truth| format!(" (truth {truth:.4})"));
                Some(format!("{} {:.4}{}", one.method, one.cost?, truth.unwrap_or_default()))
            });
            let costs: Vec<String> = costs.collect();
            return if costs.is_empty() {
                "too little of the cloud is in view for a cost".to_owned()
            } else {
                costs.join(", ")
            };
        }
        if let (Some(fusion), Some(alone)) = (&self.fusion, &self.per_reference) {
            let found = alone.iter().filter(|one| one.status == Status::Ok).count();
            return format!("{fusion} of {}, {found} with a pose", alone.len());
        }
        self.counts.map_or(String::new(), |counts| {
            let (inliers, matches) = (counts.inliers, counts.with_depth);
            format!("{inliers} inliers of {matches} matches with depth")
        })
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::super::result::SCHEMA;
    use super::*;

    #[test]
    fn a_wrong_pose_has_its_verdict_and_what_helped() {
        let error =
            |off_m: f64| json!({"translation_m": off_m, "rotation_deg": 1.0, "max_euler_deg": 1.0});
        let finding =
            |code: &str| json!({"code": code, "text": "The cost is wrong.", "evidence": {}});
        let result = json!({
            "schema": SCHEMA, "scene": "street", "query": "000070", "references": ["000062"],
            "method": "mi", "fusion": "avg", "seed": 0, "status": "ok", "grade": "wrong",
            "error": error(12.5), "diagnosis": [finding("D2"), finding("L1")]
        });
        let mut result: QueryResult = serde_json::from_value(result).expect("a result");
        assert_eq!(result.headline(), "000070 mi avg, 12.500 m: D2 The cost is wrong.");
        assert!(result.evidence().starts_with("D2 "));
        let [also, advice] = result.paragraphs().try_into().expect("two paragraphs");
        assert_eq!(also, "also L1: The cost is wrong.");
        assert!(advice.starts_with("try: "), "{advice}");

        let explanation = json!({
            "helped": [{"args": ["--radius", "20"], "error": error(0.5)}], "runs": 3, "complete": false
        });
        result.explanation = serde_json::from_value(explanation).expect("an explanation");
        let paragraphs = result.paragraphs();
        assert!(paragraphs[1].starts_with("helped: --radius 20 (0.500 m"), "{paragraphs:?}");
        assert_eq!(paragraphs[2], "stopped before all remedies were tried");

        result.diagnosis.clear();
        result.error = None;
        assert_eq!(result.headline(), "000070 mi avg, wrong");
        assert!(result.paragraphs().is_empty() && result.evidence().is_empty());
    }
}
