//! What leaves the window: recordings, pictures, sessions, the command line.

use std::path::Path;

use egui::Ui;

use super::command::{Command, Queue};
use super::desk::Desk;
use crate::evaluate::Watch as _;
use crate::sink::rerun::{Identity, RecordError, Recorder, Targets};
use crate::trace::Sink as _;

/// The menu.
pub(super) fn menu(ui: &mut Ui, desk: &Desk, commands: &Queue) {
    ui.menu_button("Save", |ui| {
        let folder = &desk.setup.folder;
        let name = &desk.setup.queries.frames()[desk.setup.query];
        let mut item = |text: &str, help: &str, command: Command| {
            if ui.button(text).on_hover_text(help).clicked() {
                commands.send(command);
            }
        };
        let path = folder.join(format!("{name}.rrd"));
        let text = format!("Recording: {}", path.display());
        item(
            &text,
            "All that was told so far, for the Rerun viewer",
            Command::SaveRecording(path),
        );
        let help = "Send the run to a Rerun viewer that is running on this machine";
        item("Stream to a Rerun viewer", help, Command::StreamRecording);
        let help = "Start a Rerun viewer and send the run to it";
        item("Spawn a Rerun viewer", help, Command::SpawnViewer);
        let help = "Put the command line that repeats this run on the clipboard (Ctrl+C)";
        item("Copy the command line", help, Command::CopyCommandLine);
        let help = "The whole window as PNG (Ctrl+P)";
        item("Picture of the window", help, Command::SavePicture(None));
        for entry in super::views::ALL {
            let text = format!("Picture of {}", entry.title);
            item(
                &text,
                "This view as PNG",
                Command::SavePicture(Some(entry.name)),
            );
        }
        let path = folder.join("session.json");
        let text = format!("Session: {}", path.display());
        item(
            &text,
            "Scene, query, settings and layout",
            Command::SaveSession(path.clone()),
        );
        item(
            "Restore the session",
            "Go back to the saved session",
            Command::RestoreSession(path),
        );
    });
}

impl Desk {
    /// Tells the run to a recording, from the history: nothing is computed anew.
    pub(super) fn record(&self, targets: &Targets) -> Result<(), RecordError> {
        let run = self.run();
        let Some(loaded) = run.loaded.as_deref() else {
            return Ok(());
        };
        let setup = &self.setup;
        let reference_names = setup.reference_frames.iter();
        let identity = Identity {
            scene: setup.references.name().to_owned(),
            queries: vec![setup.queries.frames()[setup.query].clone()],
            references: reference_names
                .map(|&frame| setup.references.frames()[frame].clone())
                .collect(),
            configuration: run.params.to_toml(),
            seed: setup.seed,
        };
        let mut recorder = Recorder::open(targets, &identity, &setup.methods)?;
        recorder.begin_query(0, &loaded.problems, loaded.truth.as_ref());
        for span in run.spans() {
            recorder.begin_method(span.reference, span.method);
            for record in &run.records()[span.records.clone()] {
                if recorder.accept(record).is_err() {
                    break;
                }
            }
            if let Some(result) = &span.result {
                recorder.end_method(result);
            }
        }
        recorder.close()
    }

    pub(super) fn save_recording(&mut self, path: &Path) {
        let folder = path.parent().unwrap_or(Path::new("."));
        if let Err(error) = std::fs::create_dir_all(folder) {
            self.note(format!("{}: {error}", folder.display()), true);
            return;
        }
        let targets = Targets {
            save: Some(path.to_owned()),
            ..Targets::default()
        };
        match self.record(&targets) {
            Ok(()) => self.note(format!("Recording: {}", path.display()), false),
            Err(error) => self.note(error.to_string(), true),
        }
    }
}
