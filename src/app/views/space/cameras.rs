//! The cameras of the scene: reference, truth, estimates, and the trial camera.

use egui::{CornerRadius, Pos2, Rect, Role, Sense, Stroke, Ui, WidgetInfo, vec2};
use nalgebra::{Point2, Point3};

use super::scene_geometry::SceneGeometry;
use super::view_camera::{Line, ViewCamera};
use crate::app::views::features;
use crate::app::views::legend::{self, paint_mark};
use crate::app::{ViewContext, theme};
use crate::camera::Intrinsics;
use crate::estimator;
use crate::event::ViewRendered;
use crate::geometry::{Pose, PoseError};
use crate::method::Method;
use crate::palette;
use crate::place::place;
use crate::proof::Thing;

/// Whose camera it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CameraKind {
    Reference,
    Truth,
    /// Where the photos agree, for a pose of another system that is contradicted.
    Better,
    Estimate(Method),
    /// The best pose so far of a method that is not finished.
    BestSoFar(Method),
    /// The trial camera.
    Hand,
    /// The pose under the pointer, in another view.
    Pointer,
}

impl CameraKind {
    /// The name on its label.
    pub(super) fn name(self) -> String {
        match self {
            Self::Reference => "Reference".to_owned(),
            Self::Truth => "Truth".to_owned(),
            Self::Better => "Where the photos agree".to_owned(),
            Self::Estimate(method) => method.label(),
            Self::BestSoFar(method) => format!("{}, best so far", method.label()),
            Self::Hand => "In hand".to_owned(),
            Self::Pointer => "Under the pointer".to_owned(),
        }
    }

    /// Its size and the width of its lines. Frusta at the same place are nested, not on top of each other.
    fn look(self) -> (f64, f32) {
        match self {
            Self::Reference | Self::Hand => (1.0, 2.5),
            Self::Truth | Self::Better => (1.24, 2.5),
            Self::Estimate(method) => (1.0 + 0.08 * rank(method) as f64, 2.5),
            Self::BestSoFar(_) | Self::Pointer => (0.7, 1.0),
        }
    }
}

/// A method's place among all.
fn rank(method: Method) -> usize {
    let found = estimator::methods().position(|known| known == method);
    found.unwrap_or_else(|| estimator::all().len())
}

/// A camera somewhere in the scene.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SceneCamera {
    pub(super) kind: CameraKind,
    pub(super) scene_from_camera: Pose,
    pub(super) intrinsics: Intrinsics,
    /// How far the image plane is drawn from the centre \[m\].
    pub(super) depth_m: f64,
    /// Where it is and how far from the truth, in words.
    pub(super) about: String,
    /// Its mark, which is the same in every picture.
    pub(super) thing: Thing,
}

impl SceneCamera {
    pub(super) fn centre(&self) -> Point3<f64> {
        self.scene_from_camera.translation.vector.into()
    }

    /// The corners of its image, from the upper left one clockwise.
    pub(super) fn corners(&self) -> [Point3<f64>; 4] {
        let (right, below) =
            (f64::from(self.intrinsics.width) - 0.5, f64::from(self.intrinsics.height) - 0.5);
        [(-0.5, -0.5), (right, -0.5), (right, below), (-0.5, below)].map(|(x, y)| {
            let seen = self.intrinsics.unproject(&Point2::new(x, y), self.depth_m);
            self.scene_from_camera * seen
        })
    }

    /// The frustum with a roof that shows which side is up, and a pole down to the ground, where `foot` is.
    pub(super) fn lines(&self, foot: &Point3<f64>) -> Vec<Line> {
        let centre = self.centre();
        let corners = self.corners();
        let middle = nalgebra::center(&corners[0], &corners[1]);
        let up = 0.35 * (corners[0] - corners[3]);
        let roof = middle + up;
        let line = |from: Point3<f64>, to: Point3<f64>| Line {
            ends: [from, to],
            color: theme::rgb(self.thing.color()),
            width: self.kind.look().1,
        };
        let mut lines = vec![line(centre, *foot)];
        for side in 0..4 {
            lines.push(line(centre, corners[side]));
            lines.push(line(corners[side], corners[(side + 1) % 4]));
        }
        lines.push(line(corners[0], roof));
        lines.push(line(roof, corners[1]));
        lines
    }
}

/// Every camera at the cursor; those that matter most come last.
pub(super) fn cameras(context: &ViewContext<'_>, geometry: &SceneGeometry) -> Vec<SceneCamera> {
    let Some(problem) = context.problem() else {
        return Vec::new();
    };
    let truth = context.truth();
    let camera = |kind: CameraKind, world: Pose| {
        let reference_from_camera = geometry.reference_from(&world);
        let mut about = format!("from the reference: {}", place(&reference_from_camera));
        if let Some(truth) = truth
            && kind != CameraKind::Truth
        {
            let error = PoseError::between(truth, &world);
            about.push_str(&format!("; from the truth {error}"));
        }
        let thing = match kind {
            CameraKind::Reference => Thing::Reference,
            CameraKind::Truth => Thing::Truth,
            CameraKind::Better => Thing::Dot(palette::TRUTH),
            CameraKind::Estimate(_) => legend::result(context, &world),
            CameraKind::BestSoFar(_) => Thing::Result(palette::NO_POSE),
            CameraKind::Hand | CameraKind::Pointer => Thing::Dot(palette::UNDECIDED),
        };
        let about = context.in_unit(&about);
        SceneCamera {
            kind,
            scene_from_camera: geometry.scene_from_world * world,
            // The reference camera took the reference photo, all others take the query's.
            intrinsics: match kind {
                CameraKind::Reference => *problem.reference().intrinsics(),
                _ => *problem.query().intrinsics(),
            },
            depth_m: kind.look().0 * geometry.camera_m(),
            about,
            thing,
        }
    };
    let mut all = vec![camera(CameraKind::Reference, *problem.reference().world_from_camera())];
    all.extend(truth.map(|pose| camera(CameraKind::Truth, *pose)));
    all.extend(context.better_pose().map(|pose| camera(CameraKind::Better, pose)));
    for &method in &context.setup.task.protocol.methods {
        if let Some(pose) = estimate(context, method) {
            all.push(camera(CameraKind::Estimate(method), pose));
        }
    }
    all.extend(best_so_far(context).map(|(method, reference_from_query)| {
        let pose = problem.world_from_query(&reference_from_query);
        camera(CameraKind::BestSoFar(method), pose)
    }));
    all.extend(context.state.hovered.map(|pose| camera(CameraKind::Pointer, pose)));
    all.extend(context.state.camera.map(|pose| camera(CameraKind::Hand, pose)));
    all
}

/// The estimate of a method; of the one at the cursor only at its end.
fn estimate(context: &ViewContext<'_>, method: Method) -> Option<Pose> {
    let (span, cursor) = context.part_of(method)?;
    (cursor + 1 >= span.records.end).then(|| context.estimate(method)).flatten()
}

/// The best pose so far of the estimator at the cursor, in the reference camera's frame, until its end.
fn best_so_far(context: &ViewContext<'_>) -> Option<(Method, Pose)> {
    let span = context.span()?;
    if span.result.is_some() && context.cursor + 1 >= span.records.end {
        return None;
    }
    let view: Option<&ViewRendered> = context.run.latest_in(span, context.cursor);
    let by_search = view.map(|view| view.offset.reference_from_camera());
    let by_features = || features::of(context, span, context.cursor).reference_from_query;
    Some((span.part.method()?, by_search.or_else(by_features)?))
}

/// Marks and labels of cameras, no label over another. Returns the camera whose label is clicked.
pub(super) fn labels(
    ui: &Ui,
    pane: Rect,
    view_camera: &ViewCamera,
    cameras: &[SceneCamera],
) -> Option<CameraKind> {
    const RADIUS: f32 = 8.0;
    let seen = |camera: &SceneCamera| {
        let at = view_camera.project(&camera.centre())? + pane.min.to_vec2();
        pane.shrink(4.0).contains(at).then_some(at)
    };
    let painter = ui.painter_at(pane);
    let shown = cameras.iter();
    let mut shown: Vec<(Pos2, &SceneCamera)> =
        shown.filter_map(|camera| Some((seen(camera)?, camera))).collect();
    // The truth last, so that nothing hides it.
    shown.sort_by_key(|(_, camera)| camera.kind == CameraKind::Truth);
    for (at, camera) in &shown {
        paint_mark(&painter, camera.thing, *at, RADIUS);
    }
    shown.sort_by(|a, b| a.0.y.total_cmp(&b.0.y));
    let mut taken: Vec<Rect> = Vec::new();
    let mut clicked = None;
    for (at, camera) in shown {
        let visuals = ui.visuals();
        let color = visuals.strong_text_color();
        let galley = painter.layout_no_wrap(camera.kind.name(), theme::LABEL, color);
        let size = galley.size() + vec2(24.0, 4.0);
        let corner = at + vec2(12.0, -0.5 * size.y);
        let mut place = inside(Rect::from_min_size(corner, size), pane);
        while let Some(other) = taken.iter().find(|other| other.intersects(place)) {
            place = place.translate(vec2(0.0, other.bottom() - place.top() + 1.0));
        }
        taken.push(place);
        let id = ui.scope_id().with(camera.kind.name());
        let response = ui.interact(place, id, Sense::click());
        let words = format!("{}: {}", camera.kind.name(), camera.about);
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &words));
        let own = theme::rgb(camera.thing.color());
        let border = if response.hovered() { color } else { own };
        painter.line_segment([at, place.left_center()], Stroke::new(1.0, own));
        painter.rect(
            place,
            CornerRadius::same(3),
            visuals.window_fill.gamma_multiply(0.85),
            Stroke::new(1.0, border),
            egui::StrokeKind::Inside,
        );
        let mark = place.left_center() + vec2(10.0, 0.0);
        paint_mark(&painter, camera.thing, mark, 4.5);
        painter.galley(place.min + vec2(20.0, 2.0), galley, color);
        let response = response.on_hover_text(format!("{words}\nClick to look through it"));
        if response.clicked() {
            clicked = Some(camera.kind);
        }
    }
    clicked
}

fn inside(place: Rect, pane: Rect) -> Rect {
    let right = (place.right() - pane.right()).max(0.0);
    let left = (pane.left() - place.left()).max(0.0);
    place.translate(vec2(left - right, 0.0))
}

/// A line in the upper left corner.
pub(super) fn headline(ui: &Ui, pane: Rect, words: &str) {
    let painter = ui.painter_at(pane);
    let color = ui.visuals().strong_text_color();
    // The menu is on the right.
    let galley = painter.layout(words.to_owned(), theme::LABEL, color, pane.width() - 80.0);
    let place = Rect::from_min_size(pane.min + vec2(8.0, 6.0), galley.size());
    let ground = ui.visuals().extreme_bg_color.gamma_multiply(0.6);
    painter.rect_filled(place.expand(2.0), CornerRadius::same(2), ground);
    painter.galley(place.min, galley, color);
}
