//! The scene in space: the cloud, the cameras, the rays, the search on the ground.

mod cameras;
mod cloud;
mod controls;
mod gpu;
mod ground;
mod hand;
mod labels;
mod lens;
mod orbit;
mod rays;
mod site;
mod story;

use std::sync::Arc;
use std::time::Duration;

use eframe::egui_wgpu::RenderState;
use egui::{Color32, Rect, Response, Role, Sense, Stroke, StrokeKind, Ui, Vec2, WidgetInfo};
use nalgebra::Point2;

use super::View;
use crate::app::camera::NamedPose;
use crate::app::textures::color_image;
use crate::app::{Command, ViewContext, theme};
use crate::picture;
use cameras::{Camera, Who};
use cloud::{Cloud, Coloring};
use controls::{Layers, Wish};
use gpu::{Frame, Painter, Points};
use ground::CostGround;
use hand::Hand;
use labels::Bar;
use lens::Lens;
use orbit::Orbit;
use rays::Rays;
use site::Site;
use story::{FeatureStory, SearchStory};

/// How long one of two poses is shown while they blink.
const BLINK: Duration = Duration::from_millis(600);

/// The view.
pub struct Space {
    /// `None` where there is no graphics card to draw with.
    painter: Option<Painter>,
    layers: Layers,
    orbit: Option<Orbit>,
    through: Option<Through>,
    hand: Hand,
    cloud: Option<Cloud>,
    /// The points of no cloud.
    nothing: Arc<Points>,
    /// When the camera in hand changes its pose next, in egui's time \[s\]; `None` while it does not.
    next_flip: Option<f64>,
}

/// A camera that one looks through, and how much the picture is magnified and shifted.
#[derive(Clone, Copy)]
struct Through {
    who: Who,
    magnified: f64,
    shifted: Vec2,
}

/// All that is there to be drawn at the cursor.
struct Content {
    cameras: Vec<Camera>,
    search: CostGround,
    path: Vec<crate::grid::Offset>,
    rays: Rays,
}

impl Space {
    /// A view for a window, with a graphics card or without.
    pub fn new(state: Option<&RenderState>) -> Self {
        Self {
            painter: state.map(Painter::new),
            layers: Layers::default(),
            orbit: None,
            through: None,
            hand: Hand::default(),
            cloud: None,
            nothing: Arc::default(),
            next_flip: None,
        }
    }
}

impl View for Space {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let Some(site) = Site::of(context) else {
            ui.weak("There is no scene before the query and its reference are read");
            return;
        };
        let content = self.content(context, &site);
        let through = self.through.map(|through| through.who);
        let looks = ui.horizontal_wrapped(|ui| {
            controls::looks(
                ui,
                &context.state.setup.task.protocol.methods,
                &mut self.layers,
                &content.cameras,
                through,
            )
        });
        let jumps =
            ui.horizontal_wrapped(|ui| controls::jumps(ui, context, self.next_flip.is_some()));
        if let Some(wish) = looks.inner.or(jumps.inner) {
            self.grant(wish, &site);
        }
        self.blink(ui, context);
        self.say_trouble(ui);
        self.pane(ui, context, &site, &content);
    }
}

impl Space {
    fn content(&self, context: &ViewContext<'_>, site: &Site) -> Content {
        let features = FeatureStory::at(context);
        let search = SearchStory::at(context);
        let relief_m = if self.layers.relief {
            0.2 * site.radius_m
        } else {
            0.0
        };
        Content {
            cameras: cameras::cameras(context, site, &features, &search),
            rays: rays::rays(site, &features, context.state.selected_feature),
            search: CostGround::new(&search, &context.run.params.grid).with_relief(relief_m),
            path: search.path,
        }
    }

    fn grant(&mut self, wish: Wish, site: &Site) {
        let middle = site.on_ground(0.0, 0.2 * site.radius_m, 0.0);
        match wish {
            Wish::Reset => {
                self.orbit = Some(Orbit::overview(middle, site.radius_m));
                self.through = None;
            }
            Wish::Top => {
                self.orbit = Some(Orbit::from_above(middle, site.radius_m));
                self.through = None;
            }
            Wish::Through(who) => {
                let is_new = self.through.is_none_or(|through| through.who != who);
                self.through = is_new.then_some(Through {
                    who,
                    magnified: 1.0,
                    shifted: Vec2::ZERO,
                });
            }
            Wish::Blink => {
                self.next_flip = match self.next_flip {
                    Some(_) => None,
                    None => Some(0.0),
                };
            }
        }
    }

    fn blink(&mut self, ui: &Ui, context: &ViewContext<'_>) {
        let Some(next) = self.next_flip else { return };
        if context.state.camera.is_none() || context.state.named_pose(NamedPose::Last).is_none() {
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

    fn pane(&mut self, ui: &mut Ui, context: &ViewContext<'_>, site: &Site, content: &Content) {
        let size = ui.available_size().max(Vec2::splat(60.0));
        let (pane, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        self.steer(ui, site, &response, &content.cameras);
        let lens = self.lens(site, size, &content.cameras);

        let points = self.points(context, site);
        let count = points.len();
        let marks = self.draw(ui, pane, site, content, &lens, points);
        let through = self.looked_through(&content.cameras);
        if let Some(camera) = through {
            self.photo(ui, context, pane, &lens, camera);
        }
        labels::marks(ui, pane, &lens, &marks);
        self.legend(ui, pane, context, content);
        let headline = self.headline(&lens, &response, site, content);
        labels::headline(ui, pane, &headline);

        let hand = content
            .cameras
            .iter()
            .find(|camera| camera.who == Who::Hand);
        let held = hand.and_then(|camera| self.hand.ui(ui, pane, &lens, site, camera));
        if let Some(pose) = held {
            context.send(Command::TakeCamera(Some(pose)));
        }
        if let Some(who) = labels::cameras(ui, pane, &lens, &content.cameras) {
            self.grant(Wish::Through(who), site);
        }
        response.widget_info(|| {
            let words = format!("3-D view of {count} points. {headline}");
            WidgetInfo::labeled(Role::Image, true, words)
        });
    }

    /// Turns, shifts and zooms as the pointer says.
    fn steer(&mut self, ui: &Ui, site: &Site, response: &Response, cameras: &[Camera]) {
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
            self.orbit = Some(Orbit::leaving(&pose, 4.0 * site.camera_m()));
            self.through = None;
        }
        let zoomed = response.hover_pos().and_then(|at| {
            let (scroll, pinch) =
                ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
            let factor = f64::from(pinch) * (0.004 * f64::from(scroll)).exp();
            (factor != 1.0).then_some((factor, at - response.rect.min.to_vec2()))
        });
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
                let overview =
                    Orbit::overview(site.on_ground(0.0, 0.2 * site.radius_m, 0.0), site.radius_m);
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

    fn looked_through<'a>(&self, cameras: &'a [Camera]) -> Option<&'a Camera> {
        let wanted = self.through?.who;
        cameras.iter().find(|camera| camera.who == wanted)
    }

    fn lens(&self, site: &Site, size: Vec2, cameras: &[Camera]) -> Lens {
        match (self.through, self.looked_through(cameras)) {
            (Some(through), Some(camera)) => {
                Lens::of_camera(camera.scene_from_camera, &camera.intrinsics, size)
                    .magnified(through.magnified, (0.5 * size).to_pos2())
                    .shifted(through.shifted)
            }
            _ => {
                let middle = site.on_ground(0.0, 0.2 * site.radius_m, 0.0);
                let overview = || Orbit::overview(middle, site.radius_m);
                self.orbit.unwrap_or_else(overview).lens(size)
            }
        }
    }

    /// The cloud's points, made ready once.
    fn points(&mut self, context: &ViewContext<'_>, site: &Site) -> Arc<Points> {
        self.cloud = match context.problem().filter(|_| self.layers.cloud) {
            Some(problem) => {
                let (reference, colored) = (&problem.reference, story::colored(context));
                let wanted = self.layers.coloring;
                let is_current = |cloud: &Cloud| cloud.is(site, reference, colored, wanted);
                let made = || Cloud::new(site, reference, colored, wanted);
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
        site: &Site,
        content: &Content,
        lens: &Lens,
        points: Arc<Points>,
    ) -> Vec<ground::Mark> {
        let visuals = ui.visuals();
        let mut lines = Vec::new();
        let mut faces = Vec::new();
        let mut marks = Vec::new();
        if self.layers.grid {
            let text = visuals.text_color();
            let (grid, beside) =
                ground::grid(site, text.gamma_multiply(0.25), text.gamma_multiply(0.6));
            lines.extend(grid);
            marks = beside;
        }
        if self.layers.cost {
            faces = content.search.faces(site);
        }
        if self.layers.path {
            lines.extend(ground::path(site, &content.path, theme::ESTIMATE));
        }
        if self.layers.rays {
            lines.extend_from_slice(&content.rays.lines);
        }
        let through = self.looked_through(&content.cameras);
        for camera in &content.cameras {
            if through.is_none_or(|through| through.who != camera.who) {
                lines.extend(camera.lines());
            }
        }
        match &self.painter {
            Some(painter) => {
                let frame = Frame {
                    lens: *lens,
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
    fn photo(&self, ui: &Ui, context: &ViewContext<'_>, pane: Rect, lens: &Lens, camera: &Camera) {
        let Some(problem) = context.problem() else {
            return;
        };
        let (ctx, textures) = (ui.ctx(), &context.state.textures);
        let texture = match camera.who.is_query() {
            true => textures.of(ctx, "photo in space", &problem.query, |query| {
                color_image(&picture::photo(&query.photo))
            }),
            false => textures.of(ctx, "photo in space", &problem.reference, |reference| {
                color_image(&picture::photo(&reference.photo))
            }),
        };
        let intrinsics = &camera.intrinsics;
        let corner =
            |x: f64, y: f64| lens.place_pixel(intrinsics, &Point2::new(x, y)) + pane.min.to_vec2();
        let (width, height) = (f64::from(intrinsics.width), f64::from(intrinsics.height));
        let image = Rect::from_two_pos(corner(-0.5, -0.5), corner(width - 0.5, height - 0.5));
        let painter = ui.painter_at(pane);
        let uv = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
        let tint = Color32::WHITE.gamma_multiply(self.layers.photo);
        painter.image(texture.id(), image, uv, tint);
        let border = Stroke::new(2.0, camera.who.color());
        painter.rect_stroke(image, 0.0, border, StrokeKind::Outside);
    }

    fn legend(&self, ui: &Ui, pane: Rect, context: &ViewContext<'_>, content: &Content) {
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
    fn headline(&self, lens: &Lens, response: &Response, site: &Site, content: &Content) -> String {
        let mut words = match (self.through, self.looked_through(&content.cameras)) {
            (Some(through), Some(_)) => format!("Through {}", through.who.name()),
            (Some(through), None) => format!("{} has no pose at this step", through.who.name()),
            (None, _) => "From outside".to_owned(),
        };
        let under = response.hover_pos().and_then(|at| {
            let ray = lens.ray(at - response.rect.min.to_vec2());
            let met = ray.meets(&site.on_ground(0.0, 0.0, 0.0), &site.up())?;
            let place = site.scene_from_reference.inverse() * met;
            (place.coords.norm() < 3.0 * site.radius_m).then_some(place)
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
