//! The scene in 3-D: the cloud, the cameras, the rays, the costs on the ground.

mod cameras;
mod cloud;
mod gpu;
mod ground;
mod labels;
mod orbit;
mod rays;
mod scene_geometry;
mod view_camera;

use std::sync::Arc;

use eframe::egui_wgpu::RenderState;
use egui::containers::menu::{MenuButton, MenuConfig};
use egui::{
    Align, Layout, PointerButton, PopupCloseBehavior, Rect, Response, Sense, Ui, UiBuilder, Vec2,
};
use nalgebra::Point3;

use super::View;
use super::features::FeatureProgress;
use super::legend::name_picture;
use super::memo::{Memo, Same};
use super::surface::scale::{Scale, number};
use super::surface::search::Search;
use crate::app::{ViewContext, theme};
use crate::grid::ScoredLattice;
use crate::problem::ReferenceTuple;
use crate::render::RenderParams;
use cameras::{CameraKind, SceneCamera};
use gpu::{Frame, Painter, Points};
use orbit::Orbit;
use rays::Rays;
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

/// A part of the scene that can be hidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Layer {
    Cloud,
    Cost,
    Path,
    Rays,
    Grid,
}

/// The layers with their names.
const LAYERS: [(Layer, &str); 5] = [
    (Layer::Cloud, "Cloud"),
    (Layer::Cost, "Cost on the ground"),
    (Layer::Path, "Way of the search"),
    (Layer::Rays, "Rays to lifted points"),
    (Layer::Grid, "Grid"),
];

/// The view of the scene in 3-D.
pub struct SpaceView {
    /// `None` without a graphics card.
    painter: Option<Painter>,
    hidden: Vec<Layer>,
    eye: Eye,
    /// The shape of the pane.
    height_over_width: f32,
    /// The points of a reference's cloud.
    cloud: Memo<(Same<ReferenceTuple>, SceneGeometry, RenderParams), Arc<Points>>,
    /// The points of an empty cloud.
    nothing: Arc<Points>,
}

/// What there is to draw at the cursor.
struct SceneContent<'a> {
    geometry: SceneGeometry,
    cameras: Vec<SceneCamera>,
    rays: Rays,
    search: Option<Search<'a>>,
    scale: Option<Scale>,
}

impl<'a> SceneContent<'a> {
    fn at(context: &ViewContext<'a>) -> Option<Self> {
        let geometry = SceneGeometry::of(context)?;
        let features = FeatureProgress::at(context);
        let search = Search::at(context, context.direct_method());
        let selected = context.options.selected_feature;
        Some(Self {
            cameras: cameras::cameras(context, &geometry, search.as_ref()),
            rays: rays::rays(&geometry, &features, selected),
            scale: search.as_ref().map(|search| Scale::of(context.run, search)),
            geometry,
            search,
        })
    }

    /// The cost map on the ground.
    fn lattices(&self) -> Vec<&ScoredLattice> {
        self.search.as_ref().map_or(Vec::new(), ground::lattices)
    }
}

impl SpaceView {
    /// A view for a window with or without a graphics card.
    pub fn new(state: Option<&RenderState>) -> Self {
        Self {
            painter: state.map(Painter::new),
            hidden: Vec::new(),
            eye: Eye::default(),
            height_over_width: 1.0,
            cloud: Memo::default(),
            nothing: Arc::default(),
        }
    }
}

impl View for SpaceView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let Some(content) = SceneContent::at(context) else {
            ui.weak("The scene appears when the query and its reference are read");
            return;
        };
        let trouble = match &self.painter {
            None => Some("No graphics card: points, lines and surfaces are not drawn".to_owned()),
            Some(painter) => painter.trouble().map(|why| format!("Nothing is drawn in 3-D: {why}")),
        };
        if let Some(words) = trouble {
            ui.colored_label(ui.visuals().error_fg_color, words);
        }
        // The marks are made for a dark ground.
        let style = ui.ctx().style_of(egui::Theme::Dark);
        ui.scope(|ui| {
            ui.style_mut().visuals = style.visuals.clone();
            self.pane(ui, context, &content);
        });
    }
}

impl SpaceView {
    fn shows(&self, layer: Layer) -> bool {
        !self.hidden.contains(&layer)
    }

    fn pane(&mut self, ui: &mut Ui, context: &ViewContext<'_>, content: &SceneContent<'_>) {
        let size = ui.available_size().max(Vec2::splat(60.0));
        let (pane, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        self.height_over_width = size.y / size.x;
        self.steer(ui, &response, content);
        let view_camera = self.view_camera(size, content);

        let points = self.points(context, &content.geometry);
        let count = points.len();
        self.draw(ui, pane, content, &view_camera, points);
        let cost = self.shows(Layer::Cost) && !content.lattices().is_empty();
        let ends = content.scale.as_ref().and_then(Scale::cost_ends);
        let method = content.search.as_ref().map(|search| search.method.label());
        let cost = method.as_deref().zip(ends.filter(|_| cost));
        let no_rays = Rays::default();
        let rays = if self.shows(Layer::Rays) { &content.rays } else { &no_rays };
        labels::legend(ui, pane, cost, rays);
        let headline = self.headline(&view_camera, &response, content);
        labels::headline(ui, pane, &headline);
        if let Some(kind) = labels::cameras(ui, pane, &view_camera, &content.cameras) {
            self.eye = Eye::Through(kind);
        }
        self.menu(ui, pane, content);
        name_picture(&response, format!("3-D view of {count} points. {headline}"));
    }

    /// The menu in the upper right corner.
    fn menu(&mut self, ui: &mut Ui, pane: Rect, content: &SceneContent<'_>) {
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
            ui.separator();
            for (layer, name) in LAYERS {
                let mut is_shown = self.shows(layer);
                if ui.checkbox(&mut is_shown, name).changed() {
                    self.hidden.retain(|hidden| *hidden != layer);
                    self.hidden.extend((!is_shown).then_some(layer));
                }
            }
        });
    }

    /// A drag turns, with Shift or another button it moves; the wheel zooms; a double click shows everything.
    fn steer(&mut self, ui: &Ui, response: &Response, content: &SceneContent<'_>) {
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
    fn overview(&self, content: &SceneContent<'_>) -> (Point3<f64>, f64) {
        let centres: Vec<Point3<f64>> = content.cameras.iter().map(SceneCamera::centre).collect();
        let height_over_width = f64::from(self.height_over_width);
        content.geometry.overview(&centres, height_over_width)
    }

    fn orbit(&self, content: &SceneContent<'_>) -> Orbit {
        match self.eye {
            Eye::Orbit(orbit) => orbit,
            Eye::Overview | Eye::Through(_) => {
                let (middle, radius_m) = self.overview(content);
                Orbit::overview(middle, radius_m)
            }
        }
    }

    fn looked_through<'c>(&self, content: &'c SceneContent<'_>) -> Option<&'c SceneCamera> {
        let mut cameras = content.cameras.iter();
        cameras.find(|camera| self.eye == Eye::Through(camera.kind))
    }

    fn view_camera(&self, size: Vec2, content: &SceneContent<'_>) -> ViewCamera {
        match self.looked_through(content) {
            Some(camera) => {
                ViewCamera::of_camera(camera.scene_from_camera, &camera.intrinsics, size)
            }
            None => self.orbit(content).view_camera(size),
        }
    }

    /// The points of the cloud, prepared once.
    fn points(&mut self, context: &ViewContext<'_>, geometry: &SceneGeometry) -> Arc<Points> {
        let Some(problem) = context.problem().filter(|_| self.shows(Layer::Cloud)) else {
            return Arc::clone(&self.nothing);
        };
        let (reference, params) = (&problem.reference, &context.run.params.render);
        let key = (Same(Arc::clone(reference)), *geometry, params.clone());
        let points = || Arc::new(cloud::points(geometry, reference, params));
        Arc::clone(self.cloud.get(key, points))
    }

    /// Draws all but marks and labels of cameras.
    fn draw(
        &self,
        ui: &Ui,
        pane: Rect,
        content: &SceneContent<'_>,
        view_camera: &ViewCamera,
        points: Arc<Points>,
    ) {
        let (visuals, geometry) = (ui.visuals(), &content.geometry);
        let mut lines = Vec::new();
        let mut metres = Vec::new();
        if self.shows(Layer::Grid) {
            let text = visuals.text_color();
            let [pale, strong] = [0.25, 0.6].map(|share| text.gamma_multiply(share));
            (lines, metres) = ground::grid(geometry, pale, strong);
        }
        let faces = match &content.scale {
            Some(scale) if self.shows(Layer::Cost) => {
                ground::faces(geometry, &content.lattices(), scale)
            }
            _ => Vec::new(),
        };
        if let Some(search) = content.search.as_ref().filter(|_| self.shows(Layer::Path)) {
            let color = theme::method(search.method);
            lines.extend(ground::path(geometry, &search.way, color));
        }
        if self.shows(Layer::Rays) {
            lines.extend_from_slice(&content.rays.lines);
        }
        for camera in &content.cameras {
            if self.eye != Eye::Through(camera.kind) {
                lines.extend(camera.lines(&geometry.below(&camera.centre())));
            }
        }
        let background = visuals.extreme_bg_color;
        match &self.painter {
            Some(painter) => {
                let frame = Frame { view_camera: *view_camera, background, points, lines, faces };
                painter.paint(&ui.painter_at(pane), pane, frame);
            }
            None => {
                ui.painter().rect_filled(pane, 0.0, background);
            }
        }
        labels::metres(ui, pane, view_camera, &metres);
    }

    /// Where the eye is, and what is under the pointer.
    fn headline(
        &self,
        view_camera: &ViewCamera,
        response: &Response,
        content: &SceneContent<'_>,
    ) -> String {
        let SceneContent { geometry, .. } = content;
        let mut words = match (self.eye, self.looked_through(content)) {
            (Eye::Through(kind), Some(_)) => format!("Through {}; drag to leave it", kind.name()),
            (Eye::Through(kind), None) => format!("{} has no pose at this step", kind.name()),
            (Eye::Overview | Eye::Orbit(_), _) => {
                "Drag: turn; Shift+drag: move; wheel: zoom".to_owned()
            }
        };
        let under = response.hover_pos().and_then(|at| {
            let ray = view_camera.ray(at - response.rect.min.to_vec2());
            let met = ray.meets(&geometry.on_ground(0.0, 0.0, 0.0), &geometry.up())?;
            let place = geometry.scene_from_reference.inverse() * met;
            (place.coords.norm() < 3.0 * geometry.radius_m).then_some(place)
        });
        if let Some(place) = under {
            let cell = self.shows(Layer::Cost).then(|| content.lattices());
            let cell = cell.and_then(|lattices| ground::cell_at(&lattices, place.x, place.z));
            let (what, [right_m, forward_m]) = match cell {
                Some((offset, cost)) => {
                    let cost = cost.map(|cost| format!("cost {}", number(cost)));
                    let what = cost.unwrap_or_else(|| "below the coverage floor".to_owned());
                    (what, [offset.right_m, offset.forward_m])
                }
                None => ("ground".to_owned(), [place.x, place.z]),
            };
            words += &format!(" – {what} at ({right_m:.1}, {forward_m:.1}) m");
        }
        words
    }
}
