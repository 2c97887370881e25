//! Localising a query, and judging somebody else's pose of it.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use posescope::foreign::{Foreign, MatchSource};
use posescope::fusion::Fusion;
use posescope::localize::{LocalizeError, NoObserver, QueryResult, Request};
use posescope::report::Witness;
use posescope::run::{Protocol, known};
use posescope::scene::SceneError;
use posescope::sink::EventLines;
use posescope::sink::rerun::{Recorder, Targets};
use posescope_core::features::{FoundMatches, PairMatches};
use posescope_core::{Method, Params, Pose};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;

use crate::detached::{Stoppable, detached};
use crate::frames::{Query, Reference};
use crate::job::{Frames, Job};
use crate::{arrays, errors};

/// Query points, reference points and perhaps scores.
pub type GivenMatches<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, Option<Bound<'py, PyAny>>);

/// A line of `results.jsonl`, and how long the work took \[s\].
type Before = (String, f64);

/// The fusion of several references, as of `posescope eval`.
const FUSION: &str = "r-wavg";

/// What a method answered, with all that is needed to ask it again.
#[pyclass(frozen, module = "posescope._posescope")]
pub struct Answer {
    job: Job,
    result: QueryResult,
    /// The result as a line of `results.jsonl`. Read and written again, a pose may differ in its last digit.
    line: String,
    threads: Option<NonZeroUsize>,
    took: Duration,
}

impl Answer {
    /// Computes the answer. If `before` holds one that travelled, that one is taken.
    fn of(
        py: Python<'_>,
        asked: &Asked<'_>,
        threads: Option<NonZeroUsize>,
        before: Option<Before>,
    ) -> PyResult<Self> {
        if let Some((line, seconds)) = before {
            let result =
                serde_json::from_str(&line).map_err(|error| errors::value(error.to_string()))?;
            let took = Duration::try_from_secs_f64(seconds).unwrap_or_default();
            let job = detached(py, threads, |_| asked.job())??;
            return Ok(Self { job, result, line, threads, took });
        }
        let answered = detached(py, threads, |stop| -> PyResult<_> {
            let start = Instant::now();
            let job = asked.job()?;
            let result = job.run(&mut Stoppable { observer: &mut NoObserver, stop });
            let result = result.map_err(|error| errors::localize(&error))?;
            Ok((job, result, start.elapsed()))
        })?;
        let (job, result, took) = answered?;
        let line = serde_json::to_string(&result);
        let line = line.map_err(|error| errors::internal(&error.to_string()))?;
        Ok(Self { job, result, line, threads, took })
    }
}

#[pymethods]
impl Answer {
    /// The result as a line of `results.jsonl`.
    fn json(&self) -> &str {
        &self.line
    }

    /// How long the work took \[s\], without Python's part.
    fn seconds(&self) -> f64 {
        self.took.as_secs_f64()
    }

    /// Query, method and error in a line, with the primary verdict.
    fn headline(&self) -> String {
        self.result.headline()
    }

    /// What follows the primary verdict.
    fn paragraphs(&self) -> Vec<String> {
        self.result.paragraphs()
    }

    /// What the result rests on, in a few words.
    fn evidence(&self) -> String {
        self.result.evidence()
    }

    /// All events as lines of JSON.
    fn events(&self, py: Python<'_>) -> PyResult<String> {
        let mut lines = EventLines::new(self.job.frames.scene_names());
        let run = detached(py, self.threads, |stop| {
            self.job.watch(&mut Stoppable { observer: &mut lines, stop })
        })?;
        run.map_err(|error| errors::localize(&error))?;
        Ok(lines.into_text())
    }

    /// Saves a recording for the Rerun viewer.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        detached(py, self.threads, |stop| -> Result<_, PyErr> {
            let (targets, identity) = (Targets::file(&path), self.job.identity());
            let failed =
                |error: posescope::sink::rerun::RecordError| PyOSError::new_err(error.to_string());
            let mut recorder =
                Recorder::open(&targets, &identity, &[self.job.method]).map_err(failed)?;
            let run = self.job.watch(&mut Stoppable { observer: &mut recorder, stop });
            recorder.close().map_err(failed)?;
            run.map(drop).map_err(|error| errors::localize(&error))
        })?
    }

    /// The picture that proves the primary verdict, or shows what decided: a data URI and a description.
    fn proof(&self, py: Python<'_>) -> PyResult<Option<(String, String)>> {
        let mut witness = Witness::default();
        let drawn = detached(py, self.threads, |stop| -> Result<_, LocalizeError> {
            self.job.watch(&mut Stoppable { observer: &mut witness, stop })?;
            Ok(witness.proof(self.job.truth().as_ref(), &self.result, &self.job.params))
        })?;
        let drawn = drawn.map_err(|error| errors::localize(&error))?;
        Ok(drawn.map(|drawn| (drawn.picture, drawn.words)))
    }
}

/// Matches of another system by the name of the reference.
struct ByReference(BTreeMap<String, FoundMatches>);

impl MatchSource for ByReference {
    fn matches(&self, _: &str, reference: &str) -> Result<Option<PairMatches>, SceneError> {
        Ok(self.0.get(reference).cloned().map(PairMatches::Found))
    }
}

/// The matches of one reference. Better scores come first, so that they keep a point that several claim.
pub fn found(name: &str, (query, reference, scores): &GivenMatches<'_>) -> PyResult<FoundMatches> {
    let query = arrays::points(&format!("{name}[0]"), query)?;
    let reference = arrays::points(&format!("{name}[1]"), reference)?;
    if query.len() != reference.len() {
        let (some, others) = (query.len(), reference.len());
        return Err(errors::value(format!(
            "{name}: as many query points as reference points expected, {some} and {others} given"
        )));
    }
    let mut order: Vec<usize> = (0..query.len()).collect();
    if let Some(scores) = scores {
        let scores = arrays::scores(&format!("{name}[2]"), scores, query.len())?;
        order.sort_by(|&a, &b| scores[b].total_cmp(&scores[a]));
    }
    // Equal points are one keypoint.
    let bits = |[x, y]: [f32; 2]| [x.to_bits(), y.to_bits()];
    let (mut queries, mut references, mut partners) = (Vec::new(), Vec::new(), Vec::new());
    let (mut matched, mut places) = (HashSet::new(), HashMap::new());
    for at in order {
        if matched.insert(bits(query[at])) {
            let place = places.entry(bits(reference[at])).or_insert_with(|| {
                references.push(reference[at]);
                references.len() - 1
            });
            queries.push(query[at]);
            partners.push(Some(*place));
        }
    }
    Ok(FoundMatches::new(&queries, &references, &partners))
}

/// The matches of each reference.
fn all_found(matches: Option<Vec<GivenMatches<'_>>>) -> PyResult<Option<Vec<FoundMatches>>> {
    let found = |all: Vec<GivenMatches<'_>>| all.iter().map(|one| found("matches", one)).collect();
    matches.map(found).transpose()
}

/// What Python asks.
struct Asked<'a> {
    query: &'a Query,
    references: Vec<&'a Reference>,
    truth: Option<Pose>,
    method: Method,
    /// The pose that another system found.
    estimate: Option<Pose>,
    matches: Option<Vec<FoundMatches>>,
    params: Vec<(String, String)>,
    judging: Judging,
    fusion: Option<&'a str>,
    seed: u64,
}

/// The radius of the search \[m\], when a pose is right, and how many variations of a wrong one are tried.
#[derive(Clone, FromPyObject)]
pub struct Judging(pub Option<f64>, pub Option<String>, pub usize);

impl Asked<'_> {
    /// Defaults of the scene's size, then what is given.
    fn job(&self) -> PyResult<Job> {
        if self.references.is_empty() {
            return Err(errors::value("references: at least one expected, none given"));
        }
        let frames = Frames::of(self.query, &self.references, self.truth.as_ref());
        let frames = frames.map_err(|error| errors::array(&error))?;
        let mut protocol = Protocol::default().at_size(&frames.size);
        let Judging(radius, right, explain) = &self.judging;
        if let Some(right) = right {
            protocol.right = right.parse().map_err(|why| errors::value(format!("right: {why}")))?;
        }
        let mut params = Params::at_scale(frames.size.scale);
        for (key, value) in &self.params {
            params.set(key, value).map_err(errors::value)?;
        }
        let radius_m = radius.unwrap_or_else(|| protocol.radius_m());
        if !(radius_m.is_finite() && radius_m > 0.0) {
            return Err(errors::value(format!(
                "radius: a finite number above 0 expected, {radius_m} given"
            )));
        }
        let fusion = self.fusion.or_else(|| (frames.chosen.len() > 1).then_some(FUSION));
        let fusion = fusion.map(|name| name.parse::<Fusion>().map_err(errors::value));
        let request = Request {
            radius_m,
            references: frames.chosen.clone().into(),
            fusions: fusion.transpose()?.into_iter().collect(),
            setting: None,
        };
        Ok(Job {
            foreign: self.foreign(&frames),
            frames,
            request,
            method: self.method,
            params,
            seed: self.seed,
            right: protocol.right,
            explain: *explain,
        })
    }

    /// Pose and matches of another system.
    fn foreign(&self, frames: &Frames) -> Foreign {
        let mut foreign = Foreign::default();
        if let Some(pose) = self.estimate {
            let estimates = [(self.query.query.name().to_owned(), pose)].into();
            foreign = foreign.with_estimates(self.method, estimates);
        }
        if let Some(matches) = &self.matches {
            let names = frames.chosen.iter();
            let names = names.map(|&frame| frames.references.frames()[frame].clone());
            let by_name = names.zip(matches.iter().cloned()).collect();
            foreign = foreign.with_matches(Arc::new(ByReference(by_name)));
        }
        foreign
    }
}

fn threads_of(threads: Option<usize>) -> PyResult<Option<NonZeroUsize>> {
    /// More threads are a mistake.
    const MAX: usize = 1024;
    match threads {
        None => Ok(None),
        Some(count) => NonZeroUsize::new(count).filter(|count| count.get() <= MAX).map_or_else(
            || Err(errors::value(format!("threads: 1 to {MAX} expected, {count} given"))),
            |count| Ok(Some(count)),
        ),
    }
}

/// Localises a query, unless the result came from another process.
#[pyfunction]
#[pyo3(signature = (query, references, method, params, judging, matches, fusion, seed, threads, before = None))]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub fn localize(
    py: Python<'_>,
    query: &Query,
    references: Vec<PyRef<'_, Reference>>,
    method: &str,
    params: Vec<(String, String)>,
    judging: Judging,
    matches: Option<Vec<GivenMatches<'_>>>,
    fusion: Option<&str>,
    seed: u64,
    threads: Option<usize>,
    before: Option<Before>,
) -> PyResult<Answer> {
    let threads = threads_of(threads)?;
    let method: Method = method.parse().map_err(errors::value)?;
    known(&[method], &[]).map_err(errors::value)?;
    let asked = Asked {
        query,
        references: references.iter().map(|one| &**one).collect(),
        truth: None,
        method,
        estimate: None,
        matches: all_found(matches)?,
        params,
        judging,
        fusion,
        seed,
    };
    Answer::of(py, &asked, threads, before)
}

/// What the verdicts say of a pose, unless the result came from another process.
#[pyfunction]
#[pyo3(signature = (query, references, world_from_camera, truth, params, judging, name, threads, before = None))]
#[expect(clippy::too_many_arguments, reason = "Python names them")]
pub fn diagnose(
    py: Python<'_>,
    query: &Query,
    references: Vec<PyRef<'_, Reference>>,
    world_from_camera: &Bound<'_, PyAny>,
    truth: Option<&Bound<'_, PyAny>>,
    params: Vec<(String, String)>,
    judging: Judging,
    name: &str,
    threads: Option<usize>,
    before: Option<Before>,
) -> PyResult<Answer> {
    let threads = threads_of(threads)?;
    let method = Method::called(name).map_err(errors::value)?;
    if known(&[method], &[]).is_ok() {
        return Err(errors::value(format!("name: `{name}` is a method of posescope")));
    }
    let asked = Asked {
        query,
        references: references.iter().map(|one| &**one).collect(),
        truth: truth.map(|truth| arrays::pose("truth", truth)).transpose()?,
        method,
        estimate: Some(arrays::pose("world_from_camera", world_from_camera)?),
        matches: None,
        params,
        judging,
        fusion: None,
        seed: 0,
    };
    Answer::of(py, &asked, threads, before)
}

/// The names of all methods.
#[pyfunction]
pub fn methods() -> Vec<&'static str> {
    posescope_core::methods().map(Method::name).collect()
}
