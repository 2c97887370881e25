//! The frames that resemble the query: in their order, with scores and what verification found.

use egui::{Color32, Grid, RichText, ScrollArea, Ui, pos2, vec2};

use super::View;
use super::canvas::{PanZoom, Placement, tag};
use super::images::Arrangement;
use super::mesh_painter::{MarkShape, MeshPainter};
use crate::app::textures::color_image;
use crate::app::{ViewContext, theme};
use crate::event::{Event, ReferencesRanked};
use crate::geometry::PoseError;
use crate::picture;
use crate::retrieval::{Criterion, Geometry, RankedReference};
use crate::session::Part;

/// Rows of the table that are seen at once \[points\].
const TABLE_HEIGHT: f32 = 170.0;

/// The ranking, and one of its frames beside the query.
#[derive(Default)]
pub struct RetrievalView {
    looked_at: usize,
}

impl View for RetrievalView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let Some(event) = told(context) else {
            ui.weak(
                "The references were not chosen by what they look like. Choose those with the most \
                 matches, or those that the index ranks, in the view References.",
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
        self.looked_at = self.looked_at.min(ranking.frames.len().saturating_sub(1));
        ScrollArea::both()
            .auto_shrink([false, true])
            .max_height(TABLE_HEIGHT)
            .show(ui, |ui| self.table(ui, context, event));
        ui.separator();
        if let Some(frame) = ranking.frames.get(self.looked_at) {
            photos(ui, context, event, self.looked_at, frame);
        }
    }
}

/// The ranking of the run, once the cursor has come so far.
fn told<'a>(context: &ViewContext<'a>) -> Option<&'a ReferencesRanked> {
    let span = context.run.span_of(Part::Retrieval)?;
    let end = span.records.end.min(context.cursor + 1);
    let records = &context.run.records()[span.records.start.min(end)..end];
    records.iter().find_map(|record| match &record.event {
        Event::ReferencesRanked(event) => Some(event),
        _ => None,
    })
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
                let name = RichText::new(&frame.name).monospace();
                let is_looked_at = index == self.looked_at;
                let name = if index < ranking.chosen && !is_looked_at {
                    name.color(theme::text(ui.visuals(), theme::REFERENCE))
                        .strong()
                } else {
                    name
                };
                ui.label((index + 1).to_string());
                if ui.selectable_label(is_looked_at, name).clicked() {
                    self.looked_at = index;
                }
                ui.label(match ranking.criterion {
                    Criterion::Words => format!("{:.3}", frame.ranked.score),
                    Criterion::Matches => format!("{:.0}", frame.ranked.score),
                });
                ui.label(geometry(frame));
                ui.label(distance(context, frame));
                ui.end_row();
            }
        });
    }
}

fn geometry(frame: &RankedReference) -> String {
    match &frame.ranked.geometry {
        Geometry::Unchecked => "–".to_owned(),
        Geometry::Refused => "× too few".to_owned(),
        Geometry::Verified(found) => format!("{} words", found.inliers),
    }
}

fn distance(context: &ViewContext<'_>, frame: &RankedReference) -> String {
    match (context.truth(), &frame.world_from_camera) {
        (Some(truth), Some(pose)) => {
            let error = PoseError::between(truth, pose);
            format!("{}, {}", error.translation(), error.rotation())
        }
        _ => "–".to_owned(),
    }
}

/// The query and a ranked frame, with lines between what lies alike.
fn photos(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    event: &ReferencesRanked,
    index: usize,
    frame: &RankedReference,
) {
    let loaded = context.run.loaded.as_deref();
    let Some(problem) = loaded.and_then(|loaded| loaded.problems.first()) else {
        return;
    };
    let Some(Some(photo)) = event.photos.get(index) else {
        ui.weak("There is no picture of this frame");
        return;
    };
    let (ctx, textures) = (ui.ctx(), context.textures);
    let query = textures.of(ctx, "photo", &problem.query, |query| {
        color_image(&picture::photo(&query.photo))
    });
    let reference = textures.of(ctx, "photo", photo, |photo| {
        color_image(&picture::photo(photo))
    });
    let room = ui.available_size().max(vec2(80.0, 80.0));
    let (area, response) = ui.allocate_exact_size(room, egui::Sense::hover());
    let found = frame.ranked.verification();
    let matches = found.map_or(&[][..], |found| &found.matches);
    response.widget_info(|| {
        let name = format!("{} matches with {}", matches.len(), frame.name);
        egui::WidgetInfo::labeled(egui::Role::Image, true, name)
    });
    let sizes = [query.size_vec2(), reference.size_vec2()];
    let arrangement = Arrangement::new(area, sizes[0], sizes[1]);
    let pan_zoom = PanZoom::default();
    let of_query = arrangement.place(0, &pan_zoom, sizes[0]);
    let of_reference = arrangement.place(1, &pan_zoom, sizes[1]);
    of_query.paint(ui.painter(), query.id(), Color32::WHITE);
    of_reference.paint(ui.painter(), reference.id(), Color32::WHITE);
    let spot = |at: &Placement, pixel: &nalgebra::Point2<f64>| {
        at.on_screen([pixel.x as f32, pixel.y as f32])
    };
    let mut mesh = MeshPainter::new(ui.pixels_per_point());
    let color = theme::state(4);
    for pair in matches {
        let from = spot(&of_query, &pair.query_pixel);
        let to = spot(&of_reference, &pair.reference_pixel);
        mesh.line(from, to, 1.0, color.gamma_multiply(0.6));
        mesh.mark(MarkShape::Ring, from, 3.0, color);
        mesh.mark(MarkShape::Ring, to, 3.0, color);
    }
    mesh.paint_on(ui.painter());
    let corner = |at: &Placement| at.visible().min + vec2(4.0, 4.0);
    tag(ui.painter(), corner(&of_query), "query", theme::ESTIMATE);
    let name = format!("rank {}: {}", index + 1, frame.name);
    let at = corner(&of_reference);
    tag(ui.painter(), pos2(at.x, at.y), &name, theme::REFERENCE);
}
