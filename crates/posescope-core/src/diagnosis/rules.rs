//! The table of verdicts, one file for each code.
//!
//! A new verdict is a file with its `RULE` and a line of `verdicts!`. Rules are tried in the order of the
//! table; the first that fires is the primary verdict, the others are listed behind it.

// The files in `rules/` take what most of them need from here.
use std::cmp::Ordering;
use std::fmt;
use std::str::FromStr;

use serde::Serialize;

use super::Family;
use super::ask::{Ask, Change, Remedy, many_starts, method, other_references};
use super::case::{Case, FusionCase, Member, RankingCase};
use super::free_search::FreeSearch;
use super::matches::Funnel;
use super::numbers::{distance, metres, ordinal, pair};
use super::search::FinishedSearch;
use super::{Diagnosis, MapOverlay, Proof};
use crate::estimator::Failure;
use crate::event::Stage;
use crate::geometry::{Pose, PoseError};
use crate::grid::{Offset, Phase};
use crate::method::Method;
use crate::text::UnknownWord;

/// The evidence of a verdict: a struct whose fields go into a file, and the sentence that is made of them: a
/// block, or what `format!` takes.
macro_rules! evidence {
    ($name:ident { $($(#[$attribute:meta])* $field:ident: $type:ty),+ $(,)? } => $words:block) => {
        #[derive(Serialize)]
        struct $name {
            $($(#[$attribute])* $field: $type),+
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                #[allow(unused_variables, reason = "not every field is in the sentence")]
                let Self { $($field),+ } = self;
                f.write_str(&$words)
            }
        }
    };
    ($name:ident { $($fields:tt)+ } => $($words:tt)+) => {
        evidence!($name { $($fields)+ } => { format!($($words)+) });
    };
}

macro_rules! verdicts {
    ($($code:ident in $file:ident),+ $(,)?) => {
        $(mod $file;)+

        /// The code of a verdict: what is wrong with a result, in short. [`Code::title`] says what it means.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        #[allow(missing_docs, reason = "each code has a title in its rule")]
        pub enum Code { $($code),+ }

        /// Every rule, in the order in which they are tried.
        pub static RULES: &[&Rule] = &[$(&$file::RULE),+];

        impl Code {
            /// Every code, in the order of the rules.
            pub(crate) const ALL: &'static [Self] = &[$(Self::$code),+];

            /// The code as it is written: `D3`.
            pub fn name(self) -> &'static str {
                match self { $(Self::$code => stringify!($code)),+ }
            }

            /// The rule that gives this verdict.
            pub fn rule(self) -> &'static Rule {
                match self { $(Self::$code => &$file::RULE),+ }
            }
        }
    };
}

pub(super) use l1::low;

verdicts! {
    X9 in x9,
    I1 in i1,
    X1 in x1,
    V1 in v1,
    F1 in f1,
    F2 in f2,
    E1 in e1,
    E2 in e2,
    E3 in e3,
    E4 in e4,
    E5 in e5,
    E6 in e6,
    D9 in d9,
    D5 in d5,
    N1 in n1,
    H1 in h1,
    R1 in r1,
    R2 in r2,
    R3 in r3,
    R4 in r4,
    R5 in r5,
    R9 in r9,
    R6 in r6,
    R7 in r7,
    R8 in r8,
    D4 in d4,
    D3 in d3,
    D1 in d1,
    D8 in d8,
    D7 in d7,
    D6 in d6,
    D2 in d2,
    L1 in l1,
}

/// The key that the evidence has if another system gave the matches.
pub(super) const GIVEN_MATCHES: &str = "given_matches";

/// A verdict: when it is given, what proves it and what may help against it.
#[derive(Debug)]
pub struct Rule {
    /// The code.
    pub code: Code,
    /// What it means, in one phrase.
    pub title: &'static str,
    /// What to do about it, in one phrase.
    pub advice: &'static str,
    /// The advice for methods of a family, if it is another.
    pub advice_of: fn(Family) -> Option<&'static str>,
    /// The advice where another system gave the matches, if it is another: that system reads no parameter of ours.
    pub advice_of_matches: Option<&'static str>,
    /// The advice for what was found, if that says more.
    pub advice_on: fn(&serde_json::Value) -> Option<&'static str>,
    /// What it applies to.
    pub applies_to: &'static [Family],
    /// Whether it needs the ground truth.
    pub needs_truth: bool,
    /// Whether no later rule is tried once this one fired.
    pub is_conclusive: bool,
    /// The verdicts that come before this one if they fire too, for what was found.
    pub yields_to: fn(Family, &serde_json::Value) -> &'static [Code],
    /// The test.
    pub test: Test,
    /// The stage that decided it.
    pub decided_at: DecidedAt,
    /// The kind of picture that proves it.
    pub proof: Proof,
    /// The kind for what was found, if that needs another.
    pub proof_on: fn(&serde_json::Value) -> Option<Proof>,
    /// What may help a method against it, the likeliest first.
    pub remedies: fn(&Ask<'_>) -> Vec<Remedy>,
}

impl Rule {
    /// A rule with what most have in common; alone, one that the method itself reports.
    const fn new(code: Code) -> Self {
        Self {
            code,
            title: "",
            advice: "",
            advice_of: |_| None,
            advice_of_matches: None,
            advice_on: |_| None,
            applies_to: &[],
            needs_truth: true,
            is_conclusive: false,
            yields_to: |_, _| &[],
            test: Test::Reported,
            decided_at: DecidedAt::End,
            proof: Proof::DecidingStage,
            proof_on: |_| None,
            remedies: |_| Vec::new(),
        }
    }

    /// A verdict of this rule. Its sentence is made from the evidence.
    pub(super) fn found(&self, evidence: &(impl Serialize + fmt::Display)) -> Diagnosis {
        Diagnosis {
            code: self.code,
            text: evidence.to_string(),
            evidence: serde_json::to_value(evidence).unwrap_or_default(),
        }
    }
}

/// When a verdict is given.
#[derive(Clone, Copy, Debug)]
pub enum Test {
    /// By what one method did with one reference.
    Method(fn(&Case<'_>) -> Option<Diagnosis>),
    /// By what each reference of a fusion gave.
    Fusion(fn(&FusionCase<'_>) -> Option<Diagnosis>),
    /// By how references were ranked.
    Ranking(fn(&RankingCase<'_>) -> Option<Diagnosis>),
    /// Where the method itself reports it ([`Code::of`]).
    Reported,
}

/// Where in a run a verdict was decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DecidedAt {
    /// At the end of this stage.
    Stage(Stage),
    /// At the end of the method.
    End,
}

impl Code {
    /// All codes, sorted by name.
    pub fn all() -> Vec<Self> {
        let mut all: Vec<Self> = RULES.iter().map(|rule| rule.code).collect();
        all.sort_unstable();
        all
    }

    /// What it means, in one phrase.
    pub fn title(self) -> &'static str {
        self.rule().title
    }

    /// What to try against what was found, for a method of a family. Another system does not read our parameters.
    pub fn advice(self, family: Option<Family>, evidence: &serde_json::Value) -> &'static str {
        let rule = self.rule();
        let of_family = || family.and_then(rule.advice_of);
        let of_matches = rule.advice_of_matches.filter(|_| evidence.get(GIVEN_MATCHES).is_some());
        (rule.advice_on)(evidence).or(of_matches).or_else(of_family).unwrap_or(rule.advice)
    }

    /// Whether it says that something failed: all but [`Code::L1`] and [`Code::E4`], which say that the pose is
    /// uncertain.
    pub fn is_failure(self) -> bool {
        !matches!(self, Self::L1 | Self::E4)
    }
}

impl Code {
    /// The verdict that a method's own failure is.
    pub fn of(failure: &Failure) -> Self {
        match failure {
            Failure::NothingInView { .. }
            | Failure::NoReference { .. }
            | Failure::NotRecognised { .. } => Self::R1,
            Failure::TooFewFeatures { .. } => Self::R2,
            Failure::TooFewMatches { .. }
            | Failure::NoConsensus { .. }
            | Failure::ChanceConsensus { .. } => Self::R3,
            Failure::TooFewDepths { .. } => Self::R4,
            Failure::OutsideRadius { .. } => Self::R9,
            Failure::NothingComparable { .. } | Failure::FlatCost { .. } => Self::D5,
            Failure::LedOutside { .. } => Self::D8,
            Failure::ChanceMinimum { .. } => Self::D6,
            Failure::LatticeTooLarge(_) => Self::D9,
            Failure::NoReferenceSucceeded { failure, .. } => Self::of(failure),
            Failure::NotJoint { .. } => Self::F2,
            Failure::NotAnswered { .. } => Self::E1,
            Failure::UnknownMethod { .. } | Failure::Parameter(_) => Self::E6,
            Failure::LowConfidence { .. } => Self::L1,
            Failure::Internal { .. } => Self::X9,
            Failure::Unreadable { .. } => Self::I1,
        }
    }
}

impl Diagnosis {
    /// Whether another system gave the matches that it is about.
    pub(crate) fn has_given_matches(&self) -> bool {
        self.evidence.get(GIVEN_MATCHES).is_some()
    }

    /// What an estimator that has no pose reports.
    pub fn of_failure(failure: &Failure) -> Self {
        Self { code: Code::of(failure), text: failure.to_string(), evidence: serde_json::json!({}) }
    }
}

impl Ord for Code {
    fn cmp(&self, other: &Self) -> Ordering {
        self.name().cmp(other.name())
    }
}

impl PartialOrd for Code {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Code {
    type Err = UnknownWord;

    fn from_str(name: &str) -> Result<Self, UnknownWord> {
        let all = Self::all();
        let found = all.iter().find(|code| code.name() == name);
        found
            .copied()
            .ok_or_else(|| UnknownWord::among(name, "code", all.iter().map(|code| code.name())))
    }
}

crate::serde_as_text!(Code);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_read_back_from_its_name_and_has_its_own_rule() {
        for code in Code::all() {
            assert_eq!(code.name().parse(), Ok(code));
            assert_eq!(code.rule().code, code);
        }
        assert!("D0".parse::<Code>().is_err());
    }

    #[test]
    fn titles_and_advice_are_short_phrases_in_plain_words() {
        const PRIVATE: [&str; 9] = [
            "dearer",
            "cheaper",
            "told",
            "remembered",
            "has a say",
            "somebody",
            "nobody",
            "whoever",
            "judge",
        ];
        for rule in RULES {
            for words in [rule.title, rule.advice] {
                let count = words.split_whitespace().count();
                assert!((2..=16).contains(&count), "{}: {words}", rule.code);
                assert!(!words.ends_with('.'), "{}: {words}", rule.code);
                for private in PRIVATE {
                    assert!(!words.contains(private), "{}: {words}", rule.code);
                }
            }
        }
    }

    #[test]
    fn a_rule_that_tests_something_applies_to_something() {
        for rule in RULES {
            let tests = matches!(rule.test, Test::Method(_));
            assert_eq!(tests, !rule.applies_to.is_empty(), "{}", rule.code);
        }
    }
}
