//! Text fields that keep the focus.

use egui::{Key, Response, TextEdit, Ui};

/// A line to write in, and whether Enter was pressed in it. It keeps the focus until Escape or a click elsewhere, so that
/// what is typed next is no command.
pub(crate) fn text_field(ui: &mut Ui, field: TextEdit<'_>) -> (Response, bool) {
    let response = ui.add(field);
    let has_entered = response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
    if has_entered {
        response.request_focus();
    }
    (response, has_entered)
}
