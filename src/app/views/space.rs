//! The scene in 3-D: where reference, truth and estimates stand in the coloured cloud.

mod cameras;
mod orbit;
mod picture;
mod scene_geometry;
mod view_camera;

use std::sync::Arc;

use egui::containers::menu::{MenuButton, MenuConfig};
use egui::{
    Align, Color32, Layout, PointerButton, PopupCloseBehavior, Pos2, Rect, Response, Sense, Stroke,
    TextureHandle, TextureOptions, Ui, UiBuilder, Vec2, pos2,
};
use nalgebra::Point3;

use super::View;
use super::legend::name_picture;
use crate::app::ViewContext;
use crate::app::memo::{Memo, Same};
use crate::problem::ReferenceTuple;
use crate::render::RenderParams;
use crate::scale::LengthUnit;
use cameras::{CameraKind, SceneCamera};
use orbit::Orbit;
use picture::{Spot, picture};
use scene_geometry::SceneGeometry;
use view_camera::ViewCamera;

/// Where the scene is seen from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Eye {
    /// Behind and above the reference, far enough to see every camera.
    #[default]
    Overview,
    /// Where the user moved it.
    Orbit(Orbit),
    /// Through a camera.
    Through(CameraKind),
}

/// The points of a reference's cloud depend on these.
type CloudKey = (Same<ReferenceTuple>, SceneGeometry, RenderParams);

/// The view of the scene in 3-D.
#[derive(Default)]
pub struct SpaceView {
    eye: Eye,
    /// The shape of the pane.
    height_over_width: f32,
    cloud: Memo<CloudKey, Arc<Vec<Spot>>>,
    /// What is seen of the cloud.
    picture: Memo<(Same<Vec<Spot>>, ViewCamera, f32), TextureHandle>,
}

/// What there is to draw at the cursor.
struct SceneContent {
    unit: LengthUnit,
    geometry: SceneGeometry,
    cameras: Vec<SceneCamera>,
    points: Arc<Vec<Spot>>,
}

impl View for SpaceView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let Some(content) = self.content(context) else {
            ui.weak("The scene appears when the query and its reference are read");
            return;
        };
        // The marks are made for a dark ground.
        let style = ui.ctx().style_of(egui::Theme::Dark);
        ui.scope(|ui| {
            ui.style_mut().visuals = style.visuals.clone();
            self.pane(ui, &content);
        });
    }
}

impl SpaceView {
    /// What is drawn of a run at its cursor. The points of the cloud are prepared once.
    fn content(&mut self, context: &ViewContext<'_>) -> Option<SceneContent> {
        let geometry = SceneGeometry::of(context)?;
        let (reference, params) = (context.problem()?.reference(), &context.run.params.render);
        let key = (Same(Arc::clone(reference)), geometry, params.clone());
        let points =
            self.cloud.get(key, || Arc::new(picture::points(&geometry, reference, params)));
        let points = Arc::clone(points);
        let unit = context.setup.task.params.scale.unit();
        Some(SceneContent { unit, geometry, cameras: cameras::cameras(context, &geometry), points })
    }

    fn pane(&mut self, ui: &mut Ui, content: &SceneContent) {
        let size = ui.available_size().max(Vec2::splat(60.0));
        let (pane, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        self.height_over_width = size.y / size.x;
        self.steer(ui, &response, content);
        let view_camera = self.view_camera(size, content);
        self.draw(ui, pane, content, &view_camera);
        let headline = content.unit.words(&self.headline(content));
        cameras::headline(ui, pane, &headline);
        if let Some(kind) = cameras::labels(ui, pane, &view_camera, &content.cameras) {
            self.eye = Eye::Through(kind);
        }
        self.menu(ui, pane, content);
        let count = content.points.len();
        name_picture(&response, format!("3-D view of {count} points. {headline}"));
    }

    /// The menu in the upper right corner.
    fn menu(&mut self, ui: &mut Ui, pane: Rect, content: &SceneContent) {
        let corner =
            UiBuilder::new().max_rect(pane.shrink(6.0)).layout(Layout::right_to_left(Align::TOP));
        let mut ui = ui.new_child(corner);
        let config = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
        MenuButton::new("View").config(config).ui(&mut ui, |ui| {
            let help = "Show every camera (double click)";
            if ui.button("Whole scene").on_hover_text(help).clicked() {
                self.eye = Eye::Overview;
            }
            if ui.button("From above").clicked() {
                let (middle, radius_m) = self.overview(content);
                self.eye = Eye::Orbit(Orbit::from_above(middle, radius_m));
            }
            ui.separator();
            for camera in &content.cameras {
                let is_chosen = self.eye == Eye::Through(camera.kind);
                let text = format!("Through {}", camera.kind.name());
                let button = ui.selectable_label(is_chosen, text);
                if button.on_hover_text(&camera.about).clicked() {
                    self.eye = Eye::Through(camera.kind);
                }
            }
        });
    }

    /// A drag turns, with Shift or another button it moves; the wheel zooms; a double click shows everything.
    fn steer(&mut self, ui: &Ui, response: &Response, content: &SceneContent) {
        if response.double_clicked() {
            self.eye = Eye::Overview;
            return;
        }
        let (by, size) = (response.drag_delta(), response.rect.size());
        let is_dragged = response.dragged() && by != Vec2::ZERO;
        if let Some(camera) = self.looked_through(content) {
            // Turning leaves the camera.
            if is_dragged {
                let ahead_m = 4.0 * content.geometry.camera_m();
                self.eye = Eye::Orbit(Orbit::leaving(&camera.scene_from_camera, ahead_m));
            }
            return;
        }
        let mut orbit = self.orbit(content);
        if is_dragged {
            let moves = response.dragged_by(PointerButton::Secondary)
                || response.dragged_by(PointerButton::Middle)
                || ui.input(|input| input.modifiers.shift);
            if moves {
                orbit.pan(by, size);
            } else {
                orbit.turn(by);
            }
            self.eye = Eye::Orbit(orbit);
        }
        if let Some(at) = response.hover_pos() {
            let (scroll, pinch) =
                ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
            let factor = f64::from(pinch) * (0.004 * f64::from(scroll)).exp();
            if factor != 1.0 {
                orbit.zoom(1.0 / factor, at - response.rect.min.to_vec2(), size);
                self.eye = Eye::Orbit(orbit);
            }
        }
    }

    /// The circle that shows reference, estimates and truth together.
    fn overview(&self, content: &SceneContent) -> (Point3<f64>, f64) {
        let centres: Vec<Point3<f64>> = content.cameras.iter().map(SceneCamera::centre).collect();
        let height_over_width = f64::from(self.height_over_width);
        content.geometry.overview(&centres, height_over_width)
    }

    fn orbit(&self, content: &SceneContent) -> Orbit {
        match self.eye {
            Eye::Orbit(orbit) => orbit,
            Eye::Overview | Eye::Through(_) => {
                let (middle, radius_m) = self.overview(content);
                Orbit::overview(middle, radius_m)
            }
        }
    }

    fn looked_through<'c>(&self, content: &'c SceneContent) -> Option<&'c SceneCamera> {
        let mut cameras = content.cameras.iter();
        cameras.find(|camera| self.eye == Eye::Through(camera.kind))
    }

    fn view_camera(&self, size: Vec2, content: &SceneContent) -> ViewCamera {
        match self.looked_through(content) {
            Some(camera) => {
                ViewCamera::of_camera(camera.scene_from_camera, &camera.intrinsics, size)
            }
            None => self.orbit(content).view_camera(size),
        }
    }

    /// Draws all but marks and labels of cameras. The cloud is painted anew when it is seen from elsewhere.
    fn draw(&mut self, ui: &Ui, pane: Rect, content: &SceneContent, view_camera: &ViewCamera) {
        let visuals = ui.visuals();
        let most = ui.input(|input| input.max_texture_side) as f32;
        let scale = ui.pixels_per_point().min(most / pane.size().max_elem());
        let key = (Same(Arc::clone(&content.points)), *view_camera, scale);
        let texture = self.picture.get(key, || {
            let image = picture(&content.points, view_camera, scale, visuals.extreme_bg_color);
            ui.ctx().load_texture("cloud", image, TextureOptions::NEAREST)
        });
        let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        let painter = ui.painter_at(pane);
        painter.image(texture.id(), pane, whole, Color32::WHITE);
        let [pale, strong] = [0.25, 0.6].map(|share| visuals.text_color().gamma_multiply(share));
        let mut lines = scene_geometry::grid(&content.geometry, pale, strong);
        for camera in &content.cameras {
            if self.eye != Eye::Through(camera.kind) {
                lines.extend(camera.lines(&content.geometry.below(&camera.centre())));
            }
        }
        for line in &lines {
            if let Some(ends) = view_camera.segment(line) {
                let ends = ends.map(|end| end + pane.min.to_vec2());
                painter.line_segment(ends, Stroke::new(line.width, line.color));
            }
        }
    }

    /// Where the eye is, and the scale of the grid.
    fn headline(&self, content: &SceneContent) -> String {
        match (self.eye, self.looked_through(content)) {
            (Eye::Through(kind), Some(_)) => format!("Through {}; drag to leave it", kind.name()),
            (Eye::Through(kind), None) => format!("{} has no pose at this step", kind.name()),
            (Eye::Overview | Eye::Orbit(_), _) => {
                let step_m = content.geometry.grid_m();
                format!("A square is {step_m} m. Drag: turn; Shift+drag: move; wheel: zoom")
            }
        }
    }
}
