//! The frames that resemble the query: their ranks and scores, and what in them lies alike.

use egui::{Grid, RichText, ScrollArea, Ui};

use super::View;
use super::canvas::PanZoom;
use super::images::{PhotoPair, photo};
use super::legend::{MarkShape, from_truth};
use crate::app::{ViewContext, theme};
use crate::event::ReferencesRanked;
use crate::retrieval::{Criterion, Geometry, RankedReference};
use crate::session::Part;

/// Height of the ranking \[points\].
const TABLE_HEIGHT: f32 = 150.0;

/// The query above or beside a ranked frame, with the ranking below.
#[derive(Default)]
pub struct RetrievalView {
    /// The position of the selected frame in the ranking.
    selected: usize,
    pan_zoom: PanZoom,
}

impl View for RetrievalView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let span = context.run.span_of(Part::Retrieval);
        let event: Option<&ReferencesRanked> =
            span.and_then(|span| context.run.latest_in(span, context.cursor));
        let Some(event) = event else {
            ui.weak(
                "No ranking: nothing chose the references by what they look like. Choose \"most matches\" or \
                 \"by the index\" in the list of references.",
            );
            return;
        };
        let ranking = &event.ranking;
        let how = match ranking.criterion {
            Criterion::Words => "by visual words, those that lie alike first",
            Criterion::Matches => "by feature matches",
        };
        ui.label(format!(
            "{} of {} frames are references, ranked {how}",
            ranking.chosen, ranking.candidates
        ));
        self.selected = self.selected.min(ranking.frames.len().saturating_sub(1));
        if let Some(frame) = ranking.frames.get(self.selected) {
            self.photos(ui, context, event, frame);
        }
        let area = ScrollArea::both().auto_shrink(false);
        area.show(ui, |ui| self.table(ui, context, event));
    }
}

impl RetrievalView {
    fn table(&mut self, ui: &mut Ui, context: &ViewContext<'_>, event: &ReferencesRanked) {
        let ranking = &event.ranking;
        let score = match ranking.criterion {
            Criterion::Words => "score",
            Criterion::Matches => "matches",
        };
        Grid::new("ranking").striped(true).show(ui, |ui| {
            for text in ["rank", "frame", score, "lie alike", "from the truth"] {
                ui.label(RichText::new(text).weak().small());
            }
            ui.end_row();
            for (index, frame) in ranking.frames.iter().enumerate() {
                let is_selected = index == self.selected;
                let mut name = RichText::new(&frame.name).monospace();
                if index < ranking.chosen && !is_selected {
                    name = name.color(theme::text(ui.visuals(), theme::REFERENCE));
                }
                ui.label((index + 1).to_string());
                if ui.selectable_label(is_selected, name).clicked() {
                    self.selected = index;
                }
                ui.label(match ranking.criterion {
                    Criterion::Words => format!("{:.3}", frame.ranked.score),
                    Criterion::Matches => format!("{:.0}", frame.ranked.score),
                });
                ui.label(match &frame.ranked.geometry {
                    Geometry::Unchecked => "–".to_owned(),
                    Geometry::Refused => "× too few".to_owned(),
                    Geometry::Verified(found) => format!("{} words", found.inliers),
                });
                let pose = frame.world_from_camera.as_ref();
                let distance = pose.and_then(|pose| from_truth(context, pose));
                ui.label(distance.unwrap_or_else(|| "–".to_owned()));
                ui.end_row();
            }
        });
    }

    /// The query and a ranked frame, with lines between what lies alike.
    fn photos(
        &mut self,
        ui: &mut Ui,
        context: &ViewContext<'_>,
        event: &ReferencesRanked,
        frame: &RankedReference,
    ) {
        let Some(problem) = context.run.problems().first() else { return };
        let Some(Some(of_frame)) = event.photos.get(self.selected) else {
            ui.weak("There is no picture of this frame");
            return;
        };
        let room = ui.available_rect_before_wrap();
        let area = room.with_max_y((room.bottom() - TABLE_HEIGHT).max(room.top() + 80.0));
        let [query, reference] =
            [problem.query().photo(), of_frame].map(|source| photo(ui, context, source));
        let found = frame.ranked.verification();
        let matches = found.map_or(&[][..], |found| &found.matches);
        let names = [
            format!("query photo {}", problem.query().name()),
            format!("{} matches with {}", matches.len(), frame.name),
        ];
        let pair = PhotoPair::show(ui, area, [&query, &reference], names, &mut self.pan_zoom);
        let painter = ui.painter_at(area);
        let color = theme::state(4);
        for found in matches {
            let pixels = [&found.query_pixel, &found.reference_pixel];
            let [from, to] =
                [0, 1].map(|side| pair.at[side].on_screen(pixels[side].cast::<f32>().into()));
            painter.line_segment([from, to], (1.0, color.gamma_multiply(0.6)));
            MarkShape::Ring.paint(&painter, from, 3.0, color);
            MarkShape::Ring.paint(&painter, to, 3.0, color);
        }
        let rank = self.selected + 1;
        pair.name(ui, ["Query".to_owned(), format!("Rank {rank}: {}", frame.name)]);
        ui.advance_cursor_after_rect(area);
    }
}
