//! A result in words. Terminal, recording and report only lay these out.

use super::result::{QueryResult, Status};
use crate::diagnosis::{Grade, confidence};

impl QueryResult {
    /// The method, with the fusion where references were fused.
    pub fn method_name(&self) -> String {
        match &self.fusion {
            Some(fusion) => format!("{} {fusion}", self.method),
            None => self.method.to_string(),
        }
    }

    /// Query, method and error in a line, with the primary verdict.
    pub fn headline(&self) -> String {
        let worth = match &self.error {
            Some(error) => error.translation(),
            None => self.grade.to_string(),
        };
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

    /// What follows the primary verdict, a paragraph each: other verdicts, what to try, what helped.
    pub fn paragraphs(&self) -> Vec<String> {
        let Some((primary, others)) = self.diagnosis.split_first() else {
            return Vec::new();
        };
        let also = others
            .iter()
            .map(|one| format!("also {}: {}", one.code, one.text));
        let mut paragraphs: Vec<String> = also.collect();
        let Some(explanation) = &self.explanation else {
            if self.grade.is_failure() {
                paragraphs.push(format!("try: {}", primary.code.rule().advice));
            }
            return paragraphs;
        };
        for helped in &explanation.helped {
            let args = helped.args.join(" ");
            paragraphs.push(format!("helped: {args} ({})", helped.error));
        }
        if explanation.helped.is_empty() {
            paragraphs.push(format!("none of {} remedies helped", explanation.runs));
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
            Some(known) if self.grade == Grade::Unmeasured => format!(
                "{} {}, {} likely within {} m; {rests_on}",
                known.word.glyph(),
                known.word,
                confidence::percent(known.probability),
                confidence::WITHIN_M
            ),
            _ => rests_on,
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
            let (truth, shuffled) = (
                part("at truth", cost.truth),
                part("shuffled", cost.shuffled),
            );
            return format!("cost {:.4}{truth}{shuffled}", cost.best);
        }
        if !self.costs_at_pose.is_empty() {
            let costs = self.costs_at_pose.iter().map(|one| {
                let cost = one
                    .cost
                    .map_or("none".to_owned(), |cost| format!("{cost:.4}"));
                let truth = one.truth.map(|truth| format!(" (truth {truth:.4})"));
                format!("{} {cost}{}", one.method, truth.unwrap_or_default())
            });
            return costs.collect::<Vec<_>>().join(", ");
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
