//! Photos and proofs as data URIs: thumbnails of queries, and pictures that prove failures.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::DynamicImage;
use image::codecs::jpeg::JpegEncoder;

use crate::event::KindSet;
use crate::geometry::Pose;
use crate::history::History;
use crate::image::Photo;
use crate::localize::{LocalizeObserver, QueryResult};
use crate::params::Params;
use crate::picture;
use crate::problem::Problem;
use crate::proof::{self, ProofCase, ProofPicture};
use crate::trace::{Cancelled, Record, Sink};

const THUMBNAIL_WIDTH: u32 = 120;
/// The width of a proof \[px\]: its text is readable on a large screen, and large enough on a phone.
const PROOF_WIDTH: u32 = 720;

/// A small copy of a photo.
pub(super) fn thumbnail(photo: &Photo) -> Option<String> {
    jpeg(&picture::photo(photo), THUMBNAIL_WIDTH, 55)
}

/// A picture in at most this width, as a data URI; `None` for one without pixels.
fn jpeg(picture: &DynamicImage, width: u32, quality: u8) -> Option<String> {
    if picture.width() == 0 || picture.height() == 0 {
        return None;
    }
    let small =
        if picture.width() > width { picture.thumbnail(width, u32::MAX) } else { picture.clone() };
    let mut bytes = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut bytes, quality);
    small.into_rgb8().write_with_encoder(encoder).ok()?;
    Some(format!("data:image/jpeg;base64,{}", STANDARD.encode(bytes)))
}

/// Collects the records for a proof of a query.
#[derive(Default)]
pub struct Witness {
    history: History,
    problems: Vec<Problem>,
}

impl Sink for Witness {
    fn wanted(&self) -> KindSet {
        proof::KINDS
    }

    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        self.history.accept(record)
    }
}

impl LocalizeObserver for Witness {
    fn begin_query(&mut self, _index: usize, problems: &[Problem], _truth: Option<&Pose>) {
        self.problems = problems.to_vec();
    }
}

/// The picture that proves a failure.
#[derive(Clone, Debug)]
pub struct DrawnProof {
    /// The picture as a data URI.
    pub picture: String,
    /// Its description, panel by panel.
    pub words: String,
}

impl Witness {
    /// Draws the proof of the result.
    pub fn proof(
        &self,
        truth: Option<&Pose>,
        result: &QueryResult,
        params: &Params,
    ) -> Option<DrawnProof> {
        let picture = ProofPicture::of(&ProofCase {
            problem: proof::problem_of(result, &self.problems)?,
            records: self.history.records(),
            result,
            truth,
            params,
        })?;
        let titles: Vec<&str> = picture.panels().map(|panel| panel.title.as_str()).collect();
        let raster = DynamicImage::ImageRgb8(picture.raster(PROOF_WIDTH, ""));
        Some(DrawnProof { picture: jpeg(&raster, PROOF_WIDTH, 75)?, words: titles.join("; ") })
    }
}
