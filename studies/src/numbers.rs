//! What all studies share: the loop over places, statistics, and the printing of tables.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use posescope::geometry::PoseError;
use rayon::prelude::*;

use crate::Failure;

/// Does the work of all places on all threads, and says on stderr how many are done.
pub fn at_places<T: Send>(
    places: usize,
    work: impl Fn(usize) -> Result<T, Failure> + Sync,
) -> Result<Vec<T>, Failure> {
    let (started, done) = (Instant::now(), AtomicUsize::new(0));
    let one = |place| {
        let found = work(place)?;
        let count = done.fetch_add(1, Ordering::Relaxed) + 1;
        let minutes = started.elapsed().as_secs_f64() / 60.0;
        eprintln!("{count} of {places}, {minutes:.1} min");
        Ok(found)
    };
    (0..places).into_par_iter().map(one).collect()
}

/// Prints a Markdown table. Commas are between the names of its columns.
pub fn print_table(head: &str, rows: &[Vec<String>]) {
    let columns = head.split(',').count();
    println!("| {} |", head.replace(',', " | "));
    println!("|:--|{}", "--:|".repeat(columns - 1));
    for row in rows {
        println!("| {} |", row.join(" | "));
    }
    println!();
}

pub fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.into_iter().collect();
    values.iter().sum::<f64>() / values.len() as f64
}

/// The value below which a share of all lies; no number where there is none.
pub fn percentile(values: &mut [f64], share: f64) -> f64 {
    let index = (values.len().saturating_sub(1) as f64 * share).round() as usize;
    values.sort_unstable_by(f64::total_cmp);
    values.get(index).copied().unwrap_or(f64::NAN)
}

/// The middle one, of an even number the upper one.
pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

pub fn percent(part: usize, whole: usize) -> f64 {
    100.0 * part as f64 / whole.max(1) as f64
}

/// The columns of [`summary`].
pub const SUMMARY: &str =
    "queries,a pose,< 0.25 m,< 0.5 m,< 1 m,< 2 m,< 10 m,median,rotation,RMSE,rotation";

/// Shares of all queries, medians over all, those without a pose counted as infinitely wrong, and RMSE over those
/// with one.
pub fn summary(errors: &[Option<PoseError>]) -> Vec<String> {
    let metres = |e: &Option<PoseError>| e.map_or(f64::INFINITY, |e| e.translation_m);
    let degrees = |e: &Option<PoseError>| e.map_or(f64::INFINITY, |e| e.rotation_deg);
    let within = |limit| {
        let near = errors.iter().filter(|e| metres(e) < limit).count();
        format!("{:.1} %", percent(near, errors.len()))
    };
    let rms =
        |of: fn(&PoseError) -> f64| mean(errors.iter().flatten().map(|e| of(e).powi(2))).sqrt();
    let mut cells = vec![errors.len().to_string()];
    cells.extend([f64::INFINITY, 0.25, 0.5, 1.0, 2.0, 10.0].map(within));
    cells.extend([
        format!("{:.3} m", median(errors.iter().map(metres))),
        format!("{:.2}°", median(errors.iter().map(degrees))),
        format!("{:.3} m", rms(|e| e.translation_m)),
        format!("{:.2}°", rms(|e| e.rotation_deg)),
    ]);
    cells
}

/// A number of kilobytes that the system tells of this process, as `VmHWM` \[MB\]; no number where it tells nothing.
pub fn memory_mb(field: &str) -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(field));
    let kilobytes = line.and_then(|line| line.split_whitespace().nth(1)?.parse().ok());
    kilobytes.map_or(f64::NAN, |kilobytes: f64| kilobytes * 1024.0 / 1e6)
}
