//! For posescope's own crates: may change in any version.
//!
//! The estimators. Each is a straight-line function from a [`Problem`] to an [`Outcome`] that emits
//! what it does to a [`Trace`].
//!
//! A direct estimator is a registered [cost](crate::cost::ALL) with a search, so a new cost is a new
//! method. Any other estimator is one file, its `mod` line and its [`Entry`] in [`all`].

mod direct;
mod failure;
mod family;
mod fb2;
mod feature;
mod given;
mod hybrid;
mod joint;
mod mi6;
mod multi_start;
mod robust;

pub use direct::Direct;
pub use failure::Failure;
pub use family::Family;
pub use feature::{
    DepthRule, FeatureBased, FeatureParams, GuidedParams, count_matches, projected_cloud,
};
pub use given::Given;
pub use hybrid::{Hybrid, HybridParams, HybridParts, hybrid_outcome};
pub(crate) use joint::{JointReference, estimate_jointly};
pub use mi6::Mi6;
use multi_start::Level;
pub use multi_start::MultiStartParams;
pub(crate) use multi_start::{cost_deviation, prior_penalty};
pub use robust::{Robust, RobustParams};

use std::str::FromStr;
use std::sync::LazyLock;

use crate::cost;
use crate::event::MinimumAssessed;
use crate::geometry::Pose;
use crate::grid::Offset;
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::render::{Comparison, Objective, Score, Scorer};
use crate::search::Refined;
use crate::text::UnknownWord;
use crate::trace::{Cancelled, Trace};

/// How many features passed each step of FB. Every query keypoint is in exactly one state, so
/// each count is at most the one before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct FeatureCounts {
    /// Keypoints of the query photo.
    pub query_keypoints: usize,
    /// Keypoints of the reference photo.
    pub reference_keypoints: usize,
    /// Query keypoints whose nearest reference feature passed the ratio test.
    pub ratio_passed: usize,
    /// Matches that passed the ratio test and are mutually best.
    pub unique: usize,
    /// Mutually best matches whose reference keypoint has a depth.
    pub with_depth: usize,
    /// Matches with a depth that the estimated pose explains.
    pub inliers: usize,
}

/// The costs that a direct method found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct CostSummary {
    /// Cost at the reference pose.
    pub initial: Option<f64>,
    /// Cost at the result.
    pub best: f64,
    /// Cost at the result with the view's pixels shuffled.
    pub shuffled: Option<f64>,
    /// Cost of the second-best local minimum of the coarse positions.
    pub runner_up: Option<f64>,
    /// Share of the image that is covered at the result.
    pub coverage_best: f64,
    /// Share of the image that is covered at the reference pose.
    pub coverage_reference: f64,
    /// Hypotheses that were scored.
    pub evaluations: u64,
}

/// The pose that a search answers.
struct Answered {
    reference_from_camera: Pose,
    /// What it costs and covers.
    score: Score,
    /// The cost of what it is compared with, if there is anything.
    runner_up: Option<f64>,
    /// Hypotheses that were scored on the way.
    evaluations: u64,
}

impl CostSummary {
    /// All that a result says of its cost is of the pose that is answered.
    fn of(problem: &Problem, level: &Level<impl Objective>, answered: &Answered) -> Self {
        let &Answered { reference_from_camera: ref pose, score, runner_up, evaluations } = answered;
        let area = problem.query.intrinsics.area();
        Self {
            initial: level.initial.cost,
            best: score.cost.unwrap_or(f64::NAN),
            shuffled: level.objective.shuffled(pose, problem.shuffle_seed()),
            runner_up,
            coverage_best: f64::from(score.covered) / area,
            coverage_reference: f64::from(level.initial.covered) / area,
            evaluations,
        }
    }

    /// The event of the minimum at this offset.
    fn assessed(&self, offset: Offset) -> MinimumAssessed {
        let &Self { initial, best, shuffled, runner_up, .. } = self;
        MinimumAssessed { offset, initial, best, shuffled, runner_up }
    }
}

/// The answer of an estimator. A query without a pose is an answer too.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Outcome {
    /// `world_from_camera` of the query, or why there is none.
    pub pose: Result<Pose, Failure>,
    /// Where the features went, if features were used.
    pub counts: Option<FeatureCounts>,
    /// What the cost was like, if a cost was minimised.
    pub cost: Option<CostSummary>,
    /// Whether this is the answer of a hybrid's second method, because the first had no pose.
    pub fell_back: bool,
}

impl Outcome {
    /// A pose, or why there is none, and nothing else.
    pub fn of(pose: Result<Pose, Failure>) -> Self {
        Self { pose, counts: None, cost: None, fell_back: false }
    }

    /// No pose, and nothing to say but why.
    pub fn failed(failure: Failure) -> Self {
        Self::of(Err(failure))
    }

    /// The end of a search.
    fn searched(found: Result<(Pose, CostSummary), Failure>) -> Self {
        match found {
            Ok((pose, cost)) => Self { cost: Some(cost), ..Self::of(Ok(pose)) },
            Err(failure) => Self::failed(failure),
        }
    }
}

/// A way to find the query's pose.
pub trait Estimator: Send + Sync {
    /// Localises the query.
    ///
    /// # Errors
    /// Only [`Cancelled`]: a query without a pose is an [`Outcome`] with a [`Failure`].
    fn estimate(&self, problem: &Problem, trace: &mut Trace<'_>) -> Result<Outcome, Cancelled>;

    /// What scores many poses of the query by the cost that this estimator minimises; `None` if it has none of
    /// one channel.
    #[doc(hidden)]
    fn scorer(&self, problem: &Problem) -> Option<Scorer<'_>> {
        let _ = problem;
        None
    }

    /// The minimum that a pose (`reference_from_camera`) leads to by the estimator's own way in six freedoms, though it
    /// did not start there; `None` where there is none, and for an estimator without such a way.
    #[doc(hidden)]
    fn led_from(&self, problem: &Problem, reference_from_camera: &Pose) -> Option<Refined> {
        let _ = (problem, reference_from_camera);
        None
    }

    /// The synthetic view at any pose of the query, with its cost and what that was made of; `None` for an
    /// estimator that minimises no cost.
    #[doc(hidden)]
    fn compare_at(&self, problem: &Problem, world_from_query: &Pose) -> Option<Comparison> {
        let pose = problem.reference_from_query(world_from_query);
        Some(self.scorer(problem)?.compare(&pose))
    }
}

/// Makes an estimator with parameters.
type Make = Box<dyn Fn(&Params) -> Box<dyn Estimator> + Send + Sync>;

/// An estimator's place in the registry. It states all that others need to know of the estimator.
pub struct Entry {
    /// The method that it is.
    pub method: Method,
    /// What the estimator does, in one phrase.
    pub about: &'static str,
    family: fn(&Self, &Params) -> Option<Family>,
    /// The groups of parameters that it reads beside those of its search and of the methods that it runs inside.
    groups: Vec<&'static str>,
    cost: Option<&'static cost::CostEntry>,
    hybrid: Option<HybridParts>,
    runs: &'static [Method],
    make: Make,
    least_probability: fn(&Params) -> f64,
}

impl Entry {
    /// An estimator that minimises no cost and lets every pose pass.
    fn new(
        method: Method,
        about: &'static str,
        make: impl Fn(&Params) -> Box<dyn Estimator> + Send + Sync + 'static,
    ) -> Self {
        Self {
            method,
            about,
            family: |_, _| None,
            groups: Vec::new(),
            cost: None,
            hybrid: None,
            runs: &[],
            make: Box::new(make),
            least_probability: |_| 0.0,
        }
    }

    /// The estimator with these parameters.
    pub fn make(&self, params: &Params) -> Box<dyn Estimator> {
        (self.make)(params)
    }

    /// How it finds its pose with these parameters, which decides its confidence and its verdicts; `None` for a
    /// hybrid, whose poses are those of its methods.
    pub fn family(&self, params: &Params) -> Option<Family> {
        (self.family)(self, params)
    }

    /// Whether its answer depends on the parameter `key` (`group.name`) while the others are these.
    #[doc(hidden)]
    pub fn reads(&self, params: &Params, key: &str) -> bool {
        let of_search: &[&str] = match self.family(params) {
            Some(Family::Grid) => &["grid"],
            Some(Family::MultiStart) => {
                &["mi6", "grid.coarse_step", "grid.coverage_floor", "fb.radius_slack"]
            }
            Some(Family::Descent) => &["descent", "grid.coverage_floor"],
            _ => &[],
        };
        let is_of = |group: &&str| {
            key.strip_prefix(*group).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        let mut parts = self.recorded_methods().into_iter().filter(|part| *part != self.method);
        of_search.iter().chain(&self.groups).any(is_of)
            || parts.any(|part| entry(part).reads(params, key))
    }

    /// The cost that it searches by itself, or by which its views are explained.
    pub fn cost(&self) -> Option<&'static cost::CostEntry> {
        self.cost
    }

    /// The least probability of being right with which it lets a pose pass; 0 for those that judge
    /// their poses by nothing else than what they are found by, as the paper's do.
    pub fn least_probability(&self, params: &Params) -> f64 {
        (self.least_probability)(params)
    }

    /// The methods that it runs inside, if it is made of others.
    pub fn hybrid(&self) -> Option<HybridParts> {
        self.hybrid
    }

    /// The methods whose events show what it does: those that it runs inside, else itself.
    pub fn recorded_methods(&self) -> Vec<Method> {
        match self.hybrid {
            Some(HybridParts { first, second }) => vec![first, second],
            None if self.runs.is_empty() => vec![self.method],
            None => self.runs.to_vec(),
        }
    }
}

/// FB.
fn feature_based() -> Entry {
    let about = "indirect: SURF, ratio match, depth from the cloud, P3P and MLESAC";
    Entry {
        family: |_, _| Some(Family::Features),
        groups: vec!["fb", "surf", "render"],
        ..Entry::new(Method::FB, about, |params| Box::new(FeatureBased::new(params)))
    }
}

/// HY.
fn hybrid() -> Entry {
    let parts = HybridParts { first: Method::FB, second: Method::MI };
    let about = "the feature-based pose, and mutual information where that has none";
    Entry {
        hybrid: Some(parts),
        groups: vec!["hy"],
        ..Entry::new(Method::HY, about, move |params| {
            Box::new(Hybrid::new(Method::HY, parts, params))
        })
    }
}

/// The search of a cost over the grid.
fn direct(cost: &'static cost::CostEntry) -> Entry {
    Entry {
        family: |entry, params| Some(params.costs.search(entry.cost?).into()),
        groups: vec![cost.name, "render"],
        cost: Some(cost),
        ..Entry::new(Method::named(cost.name), cost.about, |params| {
            Box::new(Direct::new(cost, params))
        })
    }
}

/// Every estimator: those of the paper in its order, then the others. Each registered cost is one.
pub fn all() -> &'static [Entry] {
    static ALL: LazyLock<Vec<Entry>> = LazyLock::new(|| {
        let others = [feature_based(), hybrid(), fb2::entry(), mi6::entry(), robust::entry()];
        let mut all: Vec<Entry> = others.into_iter().chain(cost::ALL.iter().map(direct)).collect();
        all.sort_by_key(|entry| entry.method);
        all
    });
    &ALL
}

/// Every method: those of the paper in its order, then the others by name.
pub fn methods() -> impl Iterator<Item = Method> {
    all().iter().map(|entry| entry.method)
}

/// The methods among these that search the pose of least cost, and those that a hybrid among them
/// runs, in the order of [`all`].
pub fn direct_methods(methods: &[Method]) -> Vec<Method> {
    let runs = |method: Method| {
        methods.iter().any(|&asked| {
            let parts = find(asked).and_then(Entry::hybrid);
            asked == method
                || parts.is_some_and(|parts| parts.first == method || parts.second == method)
        })
    };
    let direct = all().iter().filter(|entry| entry.cost().is_some());
    direct.map(|entry| entry.method).filter(|&method| runs(method)).collect()
}

/// The registry's entry of a method; `None` for one that is in none, such as that of a cost of one's
/// own ([`Direct::searching`]) or another system's answers ([`Given`]).
pub fn find(method: Method) -> Option<&'static Entry> {
    all().iter().find(|entry| entry.method == method)
}

/// The entry that [`find`] finds, for a method that is registered: read from text, or named in
/// [`Method`].
///
/// # Panics
/// When the method is registered nowhere.
pub fn entry(method: Method) -> &'static Entry {
    find(method).unwrap_or_else(|| panic!("{method} is in no registry"))
}

/// Reads the name of a method in the registry, or of another system that was declared.
impl FromStr for Method {
    type Err = UnknownWord;

    fn from_str(text: &str) -> Result<Self, UnknownWord> {
        let ours = methods().find(|method| method.name() == text);
        let found = ours.or_else(|| Method::declared(text));
        found.ok_or_else(|| UnknownWord::among(text, "method", methods().map(Method::name)))
    }
}

/// Why a straight-line estimator stops early.
pub(crate) enum Halt {
    Failed(Failure),
    Cancelled,
}

impl From<Failure> for Halt {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

impl From<Cancelled> for Halt {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

/// Separates a failure, which is an answer, from being asked to stop.
fn separate_failure<T>(result: Result<T, Halt>) -> Result<Result<T, Failure>, Cancelled> {
    match result {
        Ok(value) => Ok(Ok(value)),
        Err(Halt::Failed(failure)) => Ok(Err(failure)),
        Err(Halt::Cancelled) => Err(Cancelled),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_has_an_estimator() {
        let registered: Vec<_> = methods().collect();
        assert_eq!(registered[..4], Method::PAPER);
        for cost in cost::ALL {
            assert!(registered.iter().any(|method| method.name() == cost.name), "{}", cost.name);
        }
        let unknown = "sift".parse::<Method>().expect_err("no method").to_string();
        assert!(unknown.starts_with("`sift` is no method; fb, pm, mi, hy, "), "{unknown}");
        for method in registered {
            assert_eq!(method.name().parse(), Ok(method));
            assert!(unknown.contains(method.name()), "{unknown}");
        }
    }
}
