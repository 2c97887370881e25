//! A picture of the window, without a window.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use image::RgbImage;

use super::App;
use super::headless::Painter;
use super::selection::KnownResults;
use super::setup::Setup;
use super::window::WindowError;
use crate::method::Method;
use crate::session::{Part, RunState};

/// What is to be in the picture.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The moment of the run.
    pub moment: ShotTime,
    /// Size of the picture \[px\].
    pub size_px: [u32; 2],
    /// Pixels per point: how large words and marks are.
    pub scale: f32,
    /// The theme.
    pub theme: egui::Theme,
}

/// A moment of a run that has come to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShotTime {
    /// The end of the run.
    End,
    /// The end of a method's part.
    Method(Method),
    /// The step of a number.
    Step(usize),
}

impl FromStr for ShotTime {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "end" {
            return Ok(Self::End);
        }
        if let Ok(step) = text.parse() {
            return Ok(Self::Step(step));
        }
        Method::called(text)
            .map(Self::Method)
            .map_err(|_| format!("{text}: `end`, a method or the number of a step expected"))
    }
}

impl fmt::Display for ShotTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::End => f.write_str("end"),
            Self::Method(method) => method.fmt(f),
            Self::Step(step) => step.fmt(f),
        }
    }
}

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum ShotError {
    /// There is nothing to draw with.
    #[error(transparent)]
    Window(#[from] WindowError),
    /// The run ended early.
    #[error("{0}")]
    Broken(String),
    /// The run has no such moment.
    #[error("{0}")]
    Unknown(String),
    /// The adapter failed.
    #[error("{0}")]
    Paint(String),
}

/// Runs what is set up to its end and paints the window.
///
/// # Errors
/// [`ShotError`] where there is no such moment, nothing to draw with, or bad data.
pub fn shoot(setup: Setup, results: KnownResults, shot: &Shot) -> Result<RgbImage, ShotError> {
    let painter = Painter::new(shot.size_px)?;
    let mut window = Window::new(setup, results, shot, &painter);
    let output = window.shown()?;
    painter.paint(&window.ctx, output).map_err(ShotError::Paint)
}

/// The application with nothing around it.
struct Window<'a> {
    app: App,
    ctx: egui::Context,
    painter: &'a Painter,
    shot: &'a Shot,
    frames: usize,
}

impl<'a> Window<'a> {
    /// Between two looks at what other threads have done.
    const PAUSE: Duration = Duration::from_millis(5);

    fn new(setup: Setup, results: KnownResults, shot: &'a Shot, painter: &'a Painter) -> Self {
        let ctx = egui::Context::default();
        ctx.set_theme(shot.theme);
        let app = App::of(&ctx, setup).with_results(results);
        // Nothing moves in a picture.
        ctx.all_styles_mut(|style| style.animation_time = 0.0);
        Self { app, ctx, painter, shot, frames: 0 }
    }

    /// The frame that was asked for.
    fn shown(&mut self) -> Result<egui::FullOutput, ShotError> {
        self.run_to_end()?;
        self.go_to(self.shot.moment)?;
        Ok(self.settled())
    }

    fn run_to_end(&mut self) -> Result<(), ShotError> {
        loop {
            self.app.update(&self.ctx);
            match self.app.app_state().run_state() {
                RunState::Finished => return Ok(()),
                RunState::Broken(why) => return Err(ShotError::Broken(why.clone())),
                RunState::Cancelled => {
                    return Err(ShotError::Broken("the run was cancelled".to_owned()));
                }
                // A breakpoint stopped it.
                RunState::Paused { .. } => self.app.state.run_to_end(),
                RunState::Loading | RunState::Running => std::thread::sleep(Self::PAUSE),
            }
        }
    }

    fn go_to(&mut self, moment: ShotTime) -> Result<(), ShotError> {
        let steps = self.app.app_state().run().len();
        match moment {
            // The window is at the cause by itself.
            ShotTime::End => {}
            ShotTime::Step(step) if step < steps => self.app.state.move_cursor(step),
            ShotTime::Step(step) => {
                return Err(ShotError::Unknown(format!(
                    "step {step}: the run has the steps 0 to {}",
                    steps.saturating_sub(1)
                )));
            }
            ShotTime::Method(method) => {
                let asked = &self.app.app_state().setup.task.protocol.methods;
                if !asked.contains(&method) {
                    let names: Vec<_> = asked.iter().map(|one| one.name()).collect();
                    return Err(ShotError::Unknown(format!(
                        "{method}: `end`, a step or a method of this run ({}) expected; add it to --method",
                        names.join(", ")
                    )));
                }
                let part = self.app.state.deciding_span(method).map(|span| span.part);
                let part = part.unwrap_or(Part::Reference(method, 0));
                self.app.state.show_outcome(part);
            }
        }
        Ok(())
    }

    /// A frame in which everything that was asked for is there.
    fn settled(&mut self) -> egui::FullOutput {
        /// Sizes are known one frame late, and pictures are asked for in the frame that wants them.
        const CALM_FRAMES: usize = 6;
        /// What still moves by then, moves forever.
        const PATIENCE: usize = 120;
        let mut calm = 0;
        let mut before = Vec::new();
        loop {
            self.app.update(&self.ctx);
            let mut output = self.frame();
            self.painter.take_textures(&mut output);
            let state = self.app.app_state();
            // A picture that has just come changes the layout of the frames after it.
            calm = if state.is_working_out() { 0 } else { calm + 1 };
            let is_still = output.shapes == before || calm >= PATIENCE;
            if calm >= CALM_FRAMES && is_still {
                return output;
            }
            before.clone_from(&output.shapes);
            if calm == 0 {
                std::thread::sleep(Self::PAUSE);
            }
        }
    }

    fn frame(&mut self) -> egui::FullOutput {
        let size = self.shot.size_px;
        let size = size.map(|side| side as f32 / self.ctx.pixels_per_point());
        let mut input = egui::RawInput {
            screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, size.into())),
            max_texture_side: Some(self.painter.max_side()),
            time: Some(self.frames as f64 / 60.0),
            focused: true,
            ..egui::RawInput::default()
        };
        if let Some(viewport) = input.viewports.get_mut(&egui::ViewportId::ROOT) {
            viewport.native_pixels_per_point = Some(self.shot.scale);
        }
        self.frames += 1;
        self.ctx.run_ui(input, |ui| self.app.content(ui))
    }
}
