//! The scene in space: the cloud, the cameras, the rays, the search on the ground.

mod camera_drag;
mod cameras;
mod cloud;
mod controls;
mod gpu;
mod ground;
mod labels;
mod orbit;
mod progress;
mod rays;
mod scene_geometry;
mod view_camera;

use std::sync::Arc;
use std::time::Duration;

use eframe::egui_wgpu::RenderState;
use egui::{Color32, Rect, Response, Role, Sense, Stroke, StrokeKind, Ui, Vec2, WidgetInfo};
use nalgebra::{Point2, Point3};

use super::View;
use crate::app::camera::NamedPose;
use crate::app::textures::color_image;
use crate::app::{Command, ViewContext, theme};
use crate::picture;
use camera_drag::CameraDrag;
use cameras::{CameraKind, SceneCamera};
use cloud::{Coloring, PreparedCloud};
use controls::{Layers, ViewRequest};
use gpu::{Frame, Painter, Points};
use ground::CostGround;
use labels::Bar;
use orbit::Orbit;
use progress::{LiftedFeatures, SearchProgress};
use rays::Rays;
use scene_geometry::SceneGeometry;
use view_camera::ViewCamera;

/// How long one of two poses is shown while they blink.
const BLINK: Duration = Duration::from_millis(600);

/// The view of the scene in space.
pub struct SpaceView {
    /// `None` where there is no graphics card to draw with.
    painter: Option<Painter>,
    layers: Layers,
    orbit: Option<Orbit>,
    through: Option<LookThrough>,
    /// The shape of the pane.
    height_over_width: f32,
    camera_drag: CameraDrag,
    cloud: Option<PreparedCloud>,
    /// The points of no cloud.
    nothing: Arc<Points>,
    /// When the camera in hand changes its pose next, in egui's time \[s\]; `None` while it does not.
    next_flip: Option<f64>,
}

/// A camera that one looks through, and how much the picture is magnified and shifted.
#[derive(Clone, Copy)]
struct LookThrough {
    kind: CameraKind,
    magnified: f64,
    shifted: Vec2,
}

/// All that is there to be drawn at the cursor.
struct SceneContent {
    cameras: Vec<SceneCamera>,
    search: CostGround,
    path: Vec<crate::grid::Offset>,
    rays: Rays,
}

impl SpaceView {
    /// A view for a window, with a graphics card or without.
    pub fn new(state: Option<&RenderState>) -> Self {
        Self {
            painter: state.map(Painter::new),
            layers: Layers::default(),
            orbit: None,
            through: None,
            height_over_width: 1.0,
            camera_drag: CameraDrag::default(),
            cloud: None,
            nothing: Arc::default(),
            next_flip: None,
        }
    }
}

impl View for SpaceView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let Some(geometry) = SceneGeometry::of(context) else {
            ui.weak("There is no scene before the query and its reference are read");
            return;
        };
        let content = self.content(context, &geometry);
        let through = self.through.map(|through| through.kind);
        let looks = ui.horizontal_wrapped(|ui| {
            controls::looks(
                ui,
                &context.setup.task.protocol.methods,
                &mut self.layers,
                &content.cameras,
                through,
            )
        });
        let jumps =
            ui.horizontal_wrapped(|ui| controls::jumps(ui, context, self.next_flip.is_some()));
        if let Some(request) = looks.inner.or(jumps.inner) {
            self.apply(request, &geometry, &content.cameras);
        }
        self.blink(ui, context);
        self.say_trouble(ui);
        self.pane(ui, context, &geometry, &content);
    }
}

impl SpaceView {
    fn content(&self, context: &ViewContext<'_>, geometry: &SceneGeometry) -> SceneContent {
        let features = LiftedFeatures::at(context);
        let search = SearchProgress::at(context);
        let relief_m = if self.layers.relief {
            0.2 * geometry.radius_m
        } else {
            0.0
        };
        SceneContent {
            cameras: cameras::cameras(context, geometry, &features, &search),
            rays: rays::rays(geometry, &features, context.options.selected_feature),
            search: CostGround::new(&search, &context.run.params.grid).with_relief(relief_m),
            path: search.path,
        }
    }

    fn apply(&mut self, request: ViewRequest, geometry: &SceneGeometry, cameras: &[SceneCamera]) {
        match request {
            ViewRequest::Reset => {
                // As long as nobody turns it, the overview follows what there is to be seen.
                self.orbit = None;
                self.through = None;
            }
            ViewRequest::Top => {
                let (middle, radius_m) = self.overview(geometry, cameras);
                self.orbit = Some(Orbit::from_above(middle, radius_m));
                self.through = None;
            }
            ViewRequest::Through(kind) => {
                let is_new = self.through.is_none_or(|through| through.kind != kind);
                self.through = is_new.then_some(LookThrough {
                    kind,
                    magnified: 1.0,
                    shifted: Vec2::ZERO,
                });
            }
            ViewRequest::Blink => {
                self.next_flip = match self.next_flip {
                    Some(_) => None,
                    None => Some(0.0),
                };
            }
        }
    }

    fn blink(&mut self, ui: &Ui, context: &ViewContext<'_>) {
        let Some(next) = self.next_flip else { return };
        if context.camera().is_none() || context.named_pose(NamedPose::Last).is_none() {
            self.next_flip = None;
            return;
        }
        let now = ui.input(|input| input.time);
        if now >= next {
            context.send(Command::JumpCamera(NamedPose::Last));
            self.next_flip = Some(now + BLINK.as_secs_f64());
        }
        ui.ctx().request_repaint_after(BLINK);
    }

    fn say_trouble(&self, ui: &mut Ui) {
        let Some(painter) = &self.painter else {
            ui.weak("No graphics card: points, lines and surfaces are not drawn");
            return;
        };
        if let Some(why) = painter.trouble() {
            ui.horizontal_wrapped(|ui| {
                ui.colored_label(theme::ESTIMATE, format!("Nothing is drawn in space: {why}"));
                if ui.button("Draw again").clicked() {
                    painter.try_again();
                }
            });
        }
    }

    fn pane(
        &mut self,
        ui: &mut Ui,
        context: &ViewContext<'_>,
        geometry: &SceneGeometry,
        content: &SceneContent,
    ) {
        let size = ui.available_size().max(Vec2::splat(60.0));
        let (pane, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        self.height_over_width = size.y / size.x;
        self.steer(ui, geometry, &response, &content.cameras);
        let view_camera = self.view_camera(geometry, size, &content.cameras);

        let points = self.points(context, geometry);
        let count = points.len();
        let marks = self.draw(ui, pane, geometry, content, &view_camera, points);
        let through = self.looked_through(&content.cameras);
        if let Some(camera) = through {
            self.photo(ui, context, pane, &view_camera, camera);
        }
        labels::marks(ui, pane, &view_camera, &marks);
        self.legend(ui, pane, context, content);
        let headline = self.headline(&view_camera, &response, geometry, content);
        labels::headline(ui, pane, &headline);

        let hand = content
            .cameras
            .iter()
            .find(|camera| camera.kind == CameraKind::Hand);
        let held = hand.and_then(|camera| {
            self.camera_drag
                .ui(ui, pane, &view_camera, geometry, camera)
        });
        if let Some(pose) = held {
            context.send(Command::TakeCamera(Some(pose)));
        }
        if let Some(kind) = labels::cameras(ui, pane, &view_camera, &content.cameras) {
            self.apply(ViewRequest::Through(kind), geometry, &content.cameras);
        }
        response.widget_info(|| {
            let words = format!("3-D view of {count} points. {headline}");
            WidgetInfo::labeled(Role::Image, true, words)
        });
    }

    /// Turns, shifts and zooms as the pointer says.
    fn steer(
        &mut self,
        ui: &Ui,
        geometry: &SceneGeometry,
        response: &Response,
        cameras: &[SceneCamera],
    ) {
        let size = response.rect.size();
        let delta = response.drag_delta();
        let shifts = response.dragged_by(egui::PointerButton::Secondary)
            || response.dragged_by(egui::PointerButton::Middle)
            || ui.input(|input| input.modifiers.shift);
        let is_dragged = response.dragged() && delta != Vec2::ZERO;
        let pose = self
            .looked_through(cameras)
            .map(|camera| camera.scene_from_camera);
        if let (true, false, Some(pose)) = (is_dragged, shifts, pose) {
            // Whoever turns leaves the camera.
            self.orbit = Some(Orbit::leaving(&pose, 4.0 * geometry.camera_m()));
            self.through = None;
        }
        let zoomed = response.hover_pos().and_then(|at| {
            let (scroll, pinch) =
                ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
            let factor = f64::from(pinch) * (0.004 * f64::from(scroll)).exp();
            (factor != 1.0).then_some((factor, at - response.rect.min.to_vec2()))
        });
        let (middle, radius_m) = self.overview(geometry, cameras);
        let overview = Orbit::overview(middle, radius_m);
        match (&mut self.through, pose) {
            (Some(through), Some(_)) => {
                if is_dragged {
                    through.shifted += delta;
                }
                if let Some((factor, at)) = zoomed {
                    let middle = (0.5 * size).to_pos2();
                    let k = factor as f32;
                    through.magnified *= factor;
                    through.shifted = (1.0 - k) * (at - middle) + k * through.shifted;
                }
            }
            _ => {
                if !is_dragged && zoomed.is_none() {
                    return;
                }
                let orbit = self.orbit.get_or_insert(overview);
                match (is_dragged, shifts) {
                    (true, true) => orbit.pan(delta, size),
                    (true, false) => orbit.turn(delta),
                    (false, _) => {}
                }
                if let Some((factor, at)) = zoomed {
                    orbit.zoom(1.0 / factor, at, size);
                }
            }
        }
    }

    /// What is seen as long as nobody has turned the scene: reference, estimates and truth together.
    fn overview(&self, geometry: &SceneGeometry, cameras: &[SceneCamera]) -> (Point3<f64>, f64) {
        let centres: Vec<Point3<f64>> = cameras.iter().map(SceneCamera::centre).collect();
        geometry.overview(&centres, f64::from(self.height_over_width))
    }

    fn looked_through<'a>(&self, cameras: &'a [SceneCamera]) -> Option<&'a SceneCamera> {
        let wanted = self.through?.kind;
        cameras.iter().find(|camera| camera.kind == wanted)
    }

    fn view_camera(
        &self,
        geometry: &SceneGeometry,
        size: Vec2,
        cameras: &[SceneCamera],
    ) -> ViewCamera {
        match (self.through, self.looked_through(cameras)) {
            (Some(through), Some(camera)) => {
                ViewCamera::of_camera(camera.scene_from_camera, &camera.intrinsics, size)
                    .magnified(through.magnified, (0.5 * size).to_pos2())
                    .shifted(through.shifted)
            }
            _ => {
                let overview = || {
                    let (middle, radius_m) = self.overview(geometry, cameras);
                    Orbit::overview(middle, radius_m)
                };
                self.orbit.unwrap_or_else(overview).view_camera(size)
            }
        }
    }

    /// The cloud's points, made ready once.
    fn points(&mut self, context: &ViewContext<'_>, geometry: &SceneGeometry) -> Arc<Points> {
        self.cloud = match context.problem().filter(|_| self.layers.cloud) {
            Some(problem) => {
                let (reference, colored) = (&problem.reference, progress::colored(context));
                let wanted = self.layers.coloring;
                let is_current =
                    |cloud: &PreparedCloud| cloud.is(geometry, reference, colored, wanted);
                let made = || PreparedCloud::new(geometry, reference, colored, wanted);
                Some(self.cloud.take().filter(is_current).unwrap_or_else(made))
            }
            None => None,
        };
        let cloud = self.cloud.as_ref();
        cloud.map_or_else(
            || Arc::clone(&self.nothing),
            |cloud| Arc::clone(&cloud.points),
        )
    }

    /// Draws what is in space; answers with what is to be written beside the grid.
    fn draw(
        &self,
        ui: &Ui,
        pane: Rect,
        geometry: &SceneGeometry,
        content: &SceneContent,
        view_camera: &ViewCamera,
        points: Arc<Points>,
    ) -> Vec<ground::GridLabel> {
        let visuals = ui.visuals();
        let mut lines = Vec::new();
        let mut faces = Vec::new();
        let mut marks = Vec::new();
        if self.layers.grid {
            let text = visuals.text_color();
            let (grid, beside) = ground::grid(
                geometry,
                text.gamma_multiply(0.25),
                text.gamma_multiply(0.6),
            );
            lines.extend(grid);
            marks = beside;
        }
        if self.layers.cost {
            faces = content.search.faces(geometry);
        }
        if self.layers.path {
            lines.extend(ground::path(geometry, &content.path, theme::ESTIMATE));
        }
        if self.layers.rays {
            lines.extend_from_slice(&content.rays.lines);
        }
        let through = self.looked_through(&content.cameras);
        for camera in &content.cameras {
            if through.is_none_or(|through| through.kind != camera.kind) {
                lines.extend(camera.lines());
            }
        }
        match &self.painter {
            Some(painter) => {
                let frame = Frame {
                    view_camera: *view_camera,
                    background: visuals.extreme_bg_color,
                    points,
                    lines,
                    faces,
                };
                painter.paint(&ui.painter_at(pane), pane, frame);
            }
            None => {
                ui.painter()
                    .rect_filled(pane, 0.0, visuals.extreme_bg_color);
            }
        }
        marks
    }

    /// The photo over what its camera sees, and the border of its image.
    fn photo(
        &self,
        ui: &Ui,
        context: &ViewContext<'_>,
        pane: Rect,
        view_camera: &ViewCamera,
        camera: &SceneCamera,
    ) {
        let Some(problem) = context.problem() else {
            return;
        };
        let (ctx, textures) = (ui.ctx(), context.textures);
        let texture = if camera.kind.is_query() {
            textures.of(ctx, "photo in space", &problem.query, |query| {
                color_image(&picture::photo(&query.photo))
            })
        } else {
            textures.of(ctx, "photo in space", &problem.reference, |reference| {
                color_image(&picture::photo(&reference.photo))
            })
        };
        let intrinsics = &camera.intrinsics;
        let corner = |x: f64, y: f64| {
            view_camera.place_pixel(intrinsics, &Point2::new(x, y)) + pane.min.to_vec2()
        };
        let (width, height) = (f64::from(intrinsics.width), f64::from(intrinsics.height));
        let image = Rect::from_two_pos(corner(-0.5, -0.5), corner(width - 0.5, height - 0.5));
        let painter = ui.painter_at(pane);
        let uv = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
        let tint = Color32::WHITE.gamma_multiply(self.layers.photo);
        painter.image(texture.id(), image, uv, tint);
        let border = Stroke::new(2.0, camera.color);
        painter.rect_stroke(image, 0.0, border, StrokeKind::Outside);
    }

    fn legend(&self, ui: &Ui, pane: Rect, context: &ViewContext<'_>, content: &SceneContent) {
        let mut bars = Vec::new();
        if let Some(cloud) = &self.cloud
            && cloud.coloring != Coloring::Photo
        {
            let (low, high) = cloud.range_m;
            let title = match (cloud.coloring, self.layers.coloring) {
                (Coloring::Depth, _) => "m from the reference",
                (_, Coloring::Photo) => "m above the ground (not coloured by the photo yet)",
                _ => "m above the ground",
            };
            bars.push(Bar {
                title: title.to_owned(),
                ends: [format!("{low:.1}"), format!("{high:.1}")],
                color: theme::turbo,
            });
        }
        if let Some((least, greatest)) = content.search.costs().filter(|_| self.layers.cost) {
            let method = context.searching_method();
            bars.push(Bar {
                title: format!("cost of {}; grey: no say", method.name().to_uppercase()),
                ends: [format!("{greatest:.4}"), format!("{least:.4}")],
                color: theme::viridis,
            });
        }
        let Rays {
            inliers,
            outliers,
            undecided,
            ..
        } = content.rays;
        let mut words = Vec::new();
        if self.layers.rays && inliers + outliers > 0 {
            words.push((format!("–– {inliers} inliers"), rays::inlier_color()));
            words.push((format!("- - {outliers} outliers"), rays::outlier_color()));
        }
        if self.layers.rays && undecided > 0 {
            words.push((format!("–– {undecided} lifted matches"), theme::CAMERA));
        }
        labels::legend(ui, pane, &bars, &words);
    }

    /// Where one looks from, and what is under the pointer.
    fn headline(
        &self,
        view_camera: &ViewCamera,
        response: &Response,
        geometry: &SceneGeometry,
        content: &SceneContent,
    ) -> String {
        let mut words = match (self.through, self.looked_through(&content.cameras)) {
            (Some(through), Some(_)) => format!("Through {}", through.kind.name()),
            (Some(through), None) => format!("{} has no pose at this step", through.kind.name()),
            (None, _) => "From outside".to_owned(),
        };
        let under = response.hover_pos().and_then(|at| {
            let ray = view_camera.ray(at - response.rect.min.to_vec2());
            let met = ray.meets(&geometry.on_ground(0.0, 0.0, 0.0), &geometry.up())?;
            let place = geometry.scene_from_reference.inverse() * met;
            (place.coords.norm() < 3.0 * geometry.radius_m).then_some(place)
        });
        if let Some(place) = under {
            let cell = content.search.cell_at(place.x, place.z);
            let cell = cell.filter(|_| self.layers.cost);
            match cell.map(|cell| (cell.offset, cell.cost)) {
                Some((offset, Some(cost))) => words.push_str(&format!(
                    "; cost {cost:.4} at ({:.1}, {:.1}) m",
                    offset.right_m, offset.forward_m
                )),
                Some((offset, None)) => words.push_str(&format!(
                    "; no say at ({:.1}, {:.1}) m",
                    offset.right_m, offset.forward_m
                )),
                None => words.push_str(&format!("; ground at ({:.1}, {:.1}) m", place.x, place.z)),
            }
        }
        words
    }
}
