//! Records retrieval: the ranked frames with the query, scores and verified matches.

use image::imageops::thumbnail;
use rerun::{LineStrips2D, Points2D, Points3D, Radius, TextDocument};

use super::encode::jpeg;
use super::entities;
use super::scene::Origin;
use super::stream::Stream;
use crate::event::ReferencesRanked;
use crate::geometry::Pose;
use crate::image::Photo;
use crate::narration::{score, verified};
use crate::palette;
use crate::picture;
use crate::problem::Query;
use crate::retrieval::{Criterion, Geometry, RankedReference, ReferenceRanking, VerifiedMatch};

/// The greatest width of a canvas \[px\]: ten of them are as large as one photo of full size.
const CANVAS_WIDTH: u32 = 480;

/// Records a ranking; `truth` is the true pose of the query, if known.
pub(super) fn tell(
    event: &ReferencesRanked,
    query: &Query,
    truth: Option<&Pose>,
    origin: Origin,
    stream: &mut Stream,
) {
    let ranking = &event.ranking;
    let document = TextDocument::from_markdown(table(ranking, truth));
    stream.log(entities::RETRIEVAL_TABLE, &document);
    stream.log(entities::RETRIEVAL_PLACES, &places(ranking, origin));
    let pictured = ranking.pictured().iter().zip(event.photos.iter());
    for (rank, (reference, photo)) in pictured.enumerate() {
        // The frame is still in the table.
        let Some(photo) = photo else { continue };
        let photo_pair = PhotoPair::of(query.photo(), photo);
        let path = entities::rank(rank);
        stream.log_image(&path, jpeg(&photo_pair.picture.clone().into()));
        let is_chosen = rank < ranking.chosen;
        let label = photo_pair.label(&label(ranking, rank, reference), is_chosen);
        stream.log(&entities::rank_part(rank, "label"), &label);
        if let Some(found) = reference.ranked.verification() {
            let matches = photo_pair.matches(&found.matches);
            stream.log(&entities::rank_part(rank, "matches"), &matches);
        }
    }
}

/// A small picture of the query above a ranked frame.
struct PhotoPair {
    picture: image::RgbImage,
    /// Pixels of the canvas per pixel of the photos, horizontally and vertically.
    scale: [f64; 2],
    /// The first row of the ranked frame, in pixels of the photos.
    top: f64,
}

impl PhotoPair {
    fn of(query: &Photo, reference: &Photo) -> Self {
        let (stacked, top) = picture::stacked(query, reference);
        let stacked = stacked.into_rgb8();
        let (width, height) = stacked.dimensions();
        let shrink = f64::from(CANVAS_WIDTH) / f64::from(width.max(CANVAS_WIDTH));
        let small = |length: u32| ((f64::from(length) * shrink).round() as u32).max(1);
        let picture = thumbnail(&stacked, small(width), small(height));
        Self {
            scale: [
                f64::from(picture.width()) / f64::from(width),
                f64::from(picture.height()) / f64::from(height),
            ],
            picture,
            top: f64::from(top),
        }
    }

    /// Rerun's pixel (0, 0) is the corner of the image, ours the centre of the first pixel.
    fn shown(&self, x: f64, y: f64) -> [f32; 2] {
        let [across, down] = self.scale;
        [((x + 0.5) * across) as f32, ((y + 0.5) * down) as f32]
    }

    fn matches(&self, matches: &[VerifiedMatch]) -> LineStrips2D {
        let ends = |found: &VerifiedMatch| {
            let (above, below) = (&found.query_pixel, &found.reference_pixel);
            [self.shown(above.x, above.y), self.shown(below.x, below.y + self.top)]
        };
        LineStrips2D::new(matches.iter().map(ends))
            .with_colors([super::color(palette::TRUTH)])
            .with_radii([Radius::new_ui_points(0.75)])
    }

    /// A label on the seam between the photos.
    fn label(&self, words: &str, is_chosen: bool) -> Points2D {
        let color = if is_chosen {
            palette::light(palette::REFERENCE)
        } else {
            palette::light(palette::UNDECIDED)
        };
        let middle = f64::from(self.picture.width()) / self.scale[0] / 2.0;
        Points2D::new([self.shown(middle, self.top)])
            .with_colors([super::color(color)])
            .with_radii([Radius::new_ui_points(1.0)])
            .with_labels([words])
            .with_show_labels(true)
    }
}

/// The places of the ranked frames.
fn places(ranking: &ReferenceRanking, origin: Origin) -> Points3D {
    let known = || {
        let ranked = ranking.frames.iter().enumerate();
        ranked.filter_map(|(rank, frame)| Some((rank, frame, frame.world_from_camera?)))
    };
    Points3D::new(known().map(|(.., pose)| origin.place(&pose.translation.vector)))
        .with_colors(known().map(|(rank, ..)| {
            super::color(if rank < ranking.chosen {
                palette::REFERENCE
            } else {
                palette::UNDECIDED
            })
        }))
        .with_radii([Radius::new_ui_points(4.0)])
        .with_labels(known().map(|(rank, frame, _)| label(ranking, rank, frame)))
        .with_show_labels(false)
}

fn label(ranking: &ReferenceRanking, rank: usize, reference: &RankedReference) -> String {
    let score = score(ranking.criterion, reference.ranked.score);
    let place = rank + 1;
    format!("{place}. {}: {score}{}", reference.name, verified(&reference.ranked.geometry))
}

fn table(ranking: &ReferenceRanking, truth: Option<&Pose>) -> String {
    let what = match ranking.criterion {
        Criterion::Words => "score (cosine of visual words)",
        Criterion::Matches => "score (feature matches)",
    };
    let mut text = format!(
        "# Ranked references\n\nThe first {} of {} candidates are used as references.\n\n\
         | rank | frame | {what} | inliers | verified | from the truth \\[m\\] | reference |\n\
         |--:|:--|--:|--:|:--|--:|:--|\n",
        ranking.chosen, ranking.candidates
    );
    for (rank, reference) in ranking.frames.iter().enumerate() {
        let (inliers, verified) = match &reference.ranked.geometry {
            Geometry::Verified(found) => (found.inliers.to_string(), "yes"),
            Geometry::Refused => ("–".to_owned(), "no"),
            Geometry::Unchecked => ("–".to_owned(), "not checked"),
        };
        let distance =
            truth.zip(reference.world_from_camera).map_or("–".to_owned(), |(truth, pose)| {
                let offset = pose.translation.vector - truth.translation.vector;
                format!("{:.1}", offset.norm())
            });
        let chosen = if rank < ranking.chosen { "yes" } else { "no" };
        text += &format!(
            "| {} | {} | {} | {inliers} | {verified} | {distance} | {chosen} |\n",
            rank + 1,
            reference.name,
            score(ranking.criterion, reference.ranked.score),
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use image::GrayImage;
    use nalgebra::{Matrix2, Vector2};

    use super::*;
    use crate::retrieval::{Affine, Ranked, Verification};

    fn matched(query: [f64; 2], reference: [f64; 2]) -> VerifiedMatch {
        VerifiedMatch { query: 0, query_pixel: query.into(), reference_pixel: reference.into() }
    }

    fn verification() -> Verification {
        Verification {
            inliers: 2,
            reference_from_query: Affine {
                linear: Matrix2::new(2.0, 0.0, 0.0, 1.0),
                translation: Vector2::new(5.0, 0.0),
            },
            matches: vec![matched([10.0, 20.0], [25.0, 20.0]), matched([30.0, 40.0], [65.0, 40.0])],
        }
    }

    #[test]
    fn pixels_of_both_photos_are_found_on_the_shrunken_canvas() {
        let photo = Photo::from_gray(GrayImage::new(960, 300));
        let photo_pair = PhotoPair::of(&photo, &photo);
        // 960 × (300 + 4 + 300) at half the size.
        assert_eq!(photo_pair.picture.dimensions(), (480, 302));
        assert_eq!(photo_pair.shown(-0.5, -0.5), [0.0, 0.0]);
        assert_eq!(photo_pair.shown(959.5, 299.5), [480.0, 150.0]);
        assert_eq!(photo_pair.shown(-0.5, photo_pair.top - 0.5), [0.0, 152.0]);
        assert_eq!(photo_pair.shown(959.5, photo_pair.top + 299.5), [480.0, 302.0]);
        // A small photo is not blown up.
        let small = Photo::from_gray(GrayImage::new(96, 30));
        let photo_pair = PhotoPair::of(&small, &small);
        assert_eq!(photo_pair.picture.dimensions(), (96, 64));
    }

    #[test]
    fn the_table_says_what_became_of_each_frame_and_how_far_off_it_is() {
        let ranked = |name: &str, score, geometry, ahead: Option<f64>| RankedReference {
            name: name.to_owned(),
            world_from_camera: ahead.map(|z| Pose::translation(0.0, 0.0, z)),
            ranked: Ranked { frame: 0, score, geometry },
        };
        let ranking = ReferenceRanking {
            criterion: Criterion::Words,
            candidates: 40,
            chosen: 1,
            frames: vec![
                ranked("a", 0.25, Geometry::Verified(verification()), Some(2.0)),
                ranked("b", 0.5, Geometry::Refused, Some(-30.0)),
                ranked("c", 0.125, Geometry::Unchecked, None),
            ],
        };
        let text = table(&ranking, Some(&Pose::translation(0.0, 0.0, 5.0)));
        let rows: Vec<&str> = text.lines().filter(|line| line.starts_with("| ")).collect();
        assert_eq!(
            rows[1..],
            [
                "| 1 | a | 0.250 | 2 | yes | 3.0 | yes |",
                "| 2 | b | 0.500 | – | no | 35.0 | no |",
                "| 3 | c | 0.125 | – | not checked | – | no |",
            ]
        );
        assert!(text.contains("first 1 of 40 candidates"), "{text}");
        assert!(table(&ranking, None).contains("| a | 0.250 | 2 | yes | – | yes |"));
        assert_eq!(label(&ranking, 0, &ranking.frames[0]), "1. a: 0.250, 2 inliers");
    }
}
