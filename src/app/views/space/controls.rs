//! The bars above the picture: what is shown, where one looks from, where the camera goes.

use egui::containers::menu::{MenuButton, MenuConfig};
use egui::{PopupCloseBehavior, RichText, Slider, Ui};

use super::cameras::{CameraKind, SceneCamera};
use super::cloud::Coloring;
use crate::app::camera::NamedPose;
use crate::app::{ACTIONS, Command, ViewContext};
use crate::method::Method;

/// What of the scene is shown.
#[derive(Clone, Debug)]
pub(super) struct Layers {
    pub(super) cloud: bool,
    pub(super) coloring: Coloring,
    pub(super) cost: bool,
    pub(super) relief: bool,
    pub(super) path: bool,
    pub(super) rays: bool,
    pub(super) grid: bool,
    /// How much of the photo covers what one sees through its camera.
    pub(super) photo: f32,
}

impl Default for Layers {
    fn default() -> Self {
        Self {
            cloud: true,
            coloring: Coloring::default(),
            cost: true,
            relief: false,
            path: true,
            rays: true,
            grid: true,
            photo: 0.25,
        }
    }
}

/// What a button asks of the view itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ViewRequest {
    /// Look at the scene as at first.
    Reset,
    /// Look from above.
    Top,
    /// Look through a camera.
    Through(CameraKind),
    /// Blink between two poses, or stop blinking.
    Blink,
}

/// The buttons for where one looks from.
pub(super) fn looks(
    ui: &mut Ui,
    methods: &[Method],
    layers: &mut Layers,
    cameras: &[SceneCamera],
    through: Option<CameraKind>,
) -> Option<ViewRequest> {
    let mut request = None;
    let mut button = |ui: &mut Ui, text: &str, help: &str, wanted: ViewRequest| {
        if ui.button(text).on_hover_text(help).clicked() {
            request = Some(wanted);
        }
    };
    layers_menu(ui, layers);
    let help = "From behind and above. Drag to turn, with Shift or the right button to shift, wheel to zoom";
    button(ui, "Reset view", help, ViewRequest::Reset);
    button(ui, "Top", "From straight above", ViewRequest::Top);
    ui.weak("through");
    for kind in CameraKind::to_look_through(methods) {
        let camera = cameras.iter().find(|camera| camera.kind == kind);
        let text = format!("{} {}", kind.shape(), kind.name());
        let selected = through == Some(kind);
        let response = ui.add_enabled(
            camera.is_some() || selected,
            egui::Button::selectable(selected, text),
        );
        let response = match camera {
            Some(camera) => response.on_hover_text(format!("Look through it\n{}", camera.about)),
            None => response.on_disabled_hover_text("There is no such pose at this step"),
        };
        if response.clicked() {
            request = Some(ViewRequest::Through(kind));
        }
    }
    if through.is_some() {
        let slider = Slider::new(&mut layers.photo, 0.0..=1.0)
            .show_value(false)
            .text("photo");
        ui.add(slider)
            .on_hover_text("How much of the photo lies over the cloud");
    }
    request
}

fn layers_menu(ui: &mut Ui, layers: &mut Layers) {
    let config = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
    MenuButton::new("Layers").config(config).ui(ui, |ui| {
        ui.checkbox(&mut layers.cloud, "Cloud");
        ui.horizontal(|ui| {
            ui.add_space(18.0);
            for coloring in Coloring::ALL {
                ui.add_enabled_ui(layers.cloud, |ui| {
                    ui.selectable_value(&mut layers.coloring, coloring, coloring.name());
                });
            }
        });
        ui.checkbox(&mut layers.cost, "Cost on the ground");
        ui.add_enabled(
            layers.cost,
            egui::Checkbox::new(&mut layers.relief, "Cost as height"),
        );
        ui.checkbox(&mut layers.path, "Way of the search");
        ui.checkbox(&mut layers.rays, "Rays to lifted points");
        ui.checkbox(&mut layers.grid, "Grid");
    });
}

/// The buttons for where the camera in hand goes.
pub(super) fn jumps(ui: &mut Ui, context: &ViewContext<'_>, blinks: bool) -> Option<ViewRequest> {
    ui.weak("camera to");
    for target in NamedPose::ALL {
        let command = Command::JumpCamera(target);
        let action = ACTIONS.iter().find(|action| action.command == command);
        let key = action.map_or(String::new(), |action| action.keys_text(ui.ctx()));
        let is_there = context.named_pose(target).is_some()
            && (target != NamedPose::Truth || context.options.shows_truth);
        let mut text = egui::text::LayoutJob::default();
        let style = ui.style();
        RichText::new(target.name()).append_to(
            &mut text,
            style,
            egui::FontSelection::Default,
            egui::Align::Center,
        );
        RichText::new(format!(" {key}")).weak().small().append_to(
            &mut text,
            style,
            egui::FontSelection::Default,
            egui::Align::Center,
        );
        let response = ui.add_enabled(is_there, egui::Button::new(text));
        let response = response.on_disabled_hover_text("There is no such pose at this step");
        if response.clicked() {
            context.send(command);
        }
    }
    let mut request = None;
    let can_blink = context.camera().is_some() && context.named_pose(NamedPose::Last).is_some();
    let response = ui.add_enabled(
        can_blink || blinks,
        egui::Button::selectable(blinks, "Blink poses"),
    );
    let help = "Change between this pose and the last one, again and again";
    if response
        .on_hover_text(help)
        .on_disabled_hover_text("Jump to two poses first")
        .clicked()
    {
        request = Some(ViewRequest::Blink);
    }
    let release = ui.add_enabled(context.camera().is_some(), egui::Button::new("Let go"));
    let release = release.on_hover_text("Put the camera in hand away (Esc)");
    if release.clicked() {
        context.send(Command::TakeCamera(None));
    }
    request
}
