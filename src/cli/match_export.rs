//! Writes the matches of the feature-based method, in the format that `--matches` reads.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use posescope::event::{Event, Kind, KindSet, Side};
use posescope::features::Features;
use posescope::problem::Problem;
use posescope::scene::{PixelMaps, Scene, write_matches};
use posescope::trace::Record;

use super::failure::CliError;

/// Writes one file per pair, as soon as the pair is matched.
pub struct MatchExport {
    folder: PathBuf,
    /// Where pixels of queries and references are in their files.
    maps: [PixelMaps; 2],
    query: Option<Arc<Features>>,
    reference: Option<Arc<Features>>,
    written: usize,
    broken: Option<CliError>,
}

impl MatchExport {
    /// Writes the matches of frames of these scenes into this folder, which is created.
    pub fn to(
        folder: &Path,
        queries: &dyn Scene,
        references: &dyn Scene,
    ) -> Result<Self, CliError> {
        std::fs::create_dir_all(folder).map_err(CliError::io(folder))?;
        Ok(Self {
            folder: folder.to_owned(),
            maps: [queries, references].map(PixelMaps::of),
            query: None,
            reference: None,
            written: 0,
            broken: None,
        })
    }

    pub fn wanted() -> KindSet {
        KindSet::of(&[Kind::FeaturesDetected, Kind::MatchesDecided])
    }

    /// Takes an event of a problem. After the first error, which is kept, nothing is written.
    pub fn accept(&mut self, record: &Record, problem: &Problem) {
        match &record.event {
            Event::FeaturesDetected(detected) => {
                let features = Some(Arc::clone(&detected.features));
                match detected.side {
                    Side::Query => self.query = features,
                    Side::Reference => self.reference = features,
                }
            }
            Event::MatchesDecided(decided) if self.broken.is_none() => {
                let (Some(query), Some(reference)) = (&self.query, &self.reference) else {
                    return;
                };
                let written = write_matches(
                    &self.folder,
                    (problem.query().name(), query),
                    (problem.reference().name(), reference),
                    &decided.decisions,
                    [&self.maps[0], &self.maps[1]],
                );
                match written {
                    Ok(()) => self.written += 1,
                    Err(error) => self.broken = Some(CliError::io(&self.folder)(error)),
                }
            }
            _ => {}
        }
    }

    /// The number of files written.
    pub fn close(self) -> Result<usize, CliError> {
        match self.broken {
            Some(error) => Err(error),
            None => Ok(self.written),
        }
    }
}
