//! Judges a finished run: its figures and gates, and what broke since an earlier run.

use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use super::plan::Judging;
use super::run_file::RunFile;
use super::run_folder::{FolderError, read_results};
use super::scenes::Scenes;
use crate::doctor::{self, unseen_map};
use crate::localize::QueryResult;
use crate::measure::{
    Change, Finding, Report, RunComparison, failing_scenes, of_examination, read_rows,
};
use crate::scene::Scene;

/// How good a run is.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// Its figures, findings and gates.
    pub report: Report,
    /// The run that it is compared with.
    pub before: Option<PathBuf>,
    /// The changes since that run.
    pub comparison: Option<RunComparison>,
    /// Why it is not good enough: gates that do not hold, and queries that broke.
    pub failures: Vec<String>,
}

impl Judgement {
    /// Judges the results in a folder. `examine` says of them what `posescope doctor` finds in their scenes.
    ///
    /// # Errors
    /// Results that cannot be read.
    pub fn of(
        folder: &Path,
        run: &RunFile,
        judging: &Judging,
        examine: impl FnOnce(&[QueryResult]) -> Vec<Finding>,
    ) -> Result<Self, FolderError> {
        let rows = read_results(folder, run)?;
        let Judging { gates, known, before, only_repeated } = judging;
        let compared = before.as_deref().map(|before| compare(before, &rows, *only_repeated));
        let comparison = compared.transpose()?;
        let examined = examine(&rows);
        let report = Report::of(folder, run, rows, &examined, gates, known)?;
        let failed = report.gate_results.iter().filter(|one| !one.passed);
        let failed = failed.map(|one| format!("gate `{}` failed: {}", one.gate, one.found));
        let changes = comparison.iter().flat_map(|comparison| &comparison.differences);
        let broken = changes.filter(|one| one.change == Change::Broken);
        let broken = match broken.filter(|one| !known.has(&one.after)).count() {
            0 => None,
            count => before
                .as_ref()
                .map(|before| format!("{count} queries broken since {}", before.display())),
        };
        let failures = failed.chain(broken).collect();
        Ok(Self { report, before: before.clone(), comparison, failures })
    }
}

/// The changes since an earlier run; `only_repeated` leaves out its queries that are not among the rows.
fn compare(
    before: &Path,
    rows: &[QueryResult],
    only_repeated: bool,
) -> Result<RunComparison, FolderError> {
    let mut rows_before = read_rows(before)?;
    if only_repeated {
        let key =
            |row: &QueryResult| (row.scene.clone(), row.query_scene.clone(), row.query.clone());
        let repeated: BTreeSet<_> = rows.iter().map(key).collect();
        rows_before.retain(|row| repeated.contains(&key(row)));
    }
    Ok(RunComparison::of(&rows_before, rows, &RunComparison::TOLERANCE))
}

/// Warns where no reference of failed results has any of its scene's map in view.
pub fn warn_of_unseen_map<'a>(scene: &dyn Scene, results: impl Iterator<Item = &'a QueryResult>) {
    /// The most references that are looked at.
    const SAMPLE: usize = 20;
    let failed = results.filter(|result| result.grade.is_failure());
    let names: BTreeSet<&String> = failed.flat_map(|result| &result.references).collect();
    let frames = names.into_iter().filter_map(|name| scene.find(name).ok());
    if let Some(why) = unseen_map(scene, &frames.take(SAMPLE).collect::<Vec<_>>()) {
        log::warn!("{}: {why}", scene.name());
    }
}

/// What `posescope doctor` says of scenes whose queries fail often. A part of a run asks about each scene: how often its
/// queries fail is known only when all parts are there. Nobody asked for it, so a scene that cannot be examined is only
/// a warning.
pub fn examine(run: &RunFile, scenes: &Scenes, rows: &[QueryResult]) -> Vec<Finding> {
    let failing = failing_scenes(&rows.iter().collect::<Vec<_>>());
    let mut examined = Vec::new();
    for (at, scene) in scenes.references.iter().enumerate() {
        let pair = run.pairs.iter().find(|pair| pair.scene_index == at);
        let is_asked = |label: &&str| run.shard.is_some() || failing.contains(*label);
        let Some(label) = pair.map(|pair| pair.scene.as_str()).filter(is_asked) else {
            continue;
        };
        warn_of_unseen_map(scene.as_ref(), rows.iter().filter(|row| row.scene == label));
        match catch_unwind(AssertUnwindSafe(|| doctor::fit(scene.as_ref()).0)) {
            Ok(found) => examined.extend(found.map(|found| of_examination(label, &found))),
            Err(_) => log::warn!("`posescope doctor` cannot examine {label}"),
        }
    }
    examined
}
