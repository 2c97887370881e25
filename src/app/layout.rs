//! Where the views are: a tree of tabs and splits that a person can rearrange.

use std::collections::BTreeMap;

use eframe::egui_wgpu::RenderState;
use egui_tiles::{Behavior, SimplificationOptions, TileId, Tiles, Tree, UiResponse};

use super::arrangement::Arrangement;
use super::command::{Command, Queue};
use super::state::AppState;
use super::view_context::ViewContext;
use super::view_options::CompareMode;
use super::views::{self, View};

/// The tree of views, and the views themselves.
pub(super) struct Layout {
    arrangement: Arrangement,
    tree: Tree<String>,
    views: BTreeMap<&'static str, ViewPair>,
    /// The view that has all the room, if one has.
    alone: Option<String>,
}

/// A view has what it remembers once for each of two runs.
struct ViewPair {
    present: Box<dyn View>,
    kept: Box<dyn View>,
}

impl Layout {
    pub(super) fn new(render_state: Option<&RenderState>) -> Self {
        let views = views::ALL
            .iter()
            .map(|entry| {
                let pair = ViewPair {
                    present: (entry.new)(render_state),
                    kept: (entry.new)(render_state),
                };
                (entry.name, pair)
            })
            .collect();
        Self {
            arrangement: Arrangement::default(),
            tree: inspecting(),
            views,
            alone: None,
        }
    }

    /// What the window is arranged for.
    pub(super) fn arrangement(&self) -> Arrangement {
        self.arrangement
    }

    /// Puts every view to its first place in an arrangement.
    pub(super) fn arrange(&mut self, arrangement: Arrangement) {
        self.arrangement = arrangement;
        self.tree = match arrangement {
            Arrangement::Inspect => inspecting(),
            Arrangement::Teach => teaching(),
            Arrangement::Batch => sorting(),
        };
        self.alone = None;
    }

    /// Shows these views alone, the first one largest.
    pub(super) fn present(&mut self, names: &[String]) {
        self.tree = presenting(names);
        self.alone = None;
    }

    /// Gives a view all the room; without one, that under the pointer, or goes back.
    pub(super) fn maximize(&mut self, view: Option<&str>, pointer: Option<egui::Pos2>) {
        self.alone = match (view, &self.alone) {
            (Some(view), _) => Some(view.to_owned()),
            (None, Some(_)) => None,
            (None, None) => self.view_at(pointer),
        };
    }

    /// Whether one view has all the room.
    pub(super) fn is_maximized(&self) -> bool {
        self.alone.is_some()
    }

    fn view_at(&self, pointer: Option<egui::Pos2>) -> Option<String> {
        let pointer = pointer?;
        let visible = self.tree.active_tiles().into_iter();
        let mut panes = visible.filter_map(|id| match self.tree.tiles.get(id)? {
            egui_tiles::Tile::Pane(pane) => Some((self.tree.tiles.rect(id)?, pane)),
            egui_tiles::Tile::Container(_) => None,
        });
        let (_, pane) = panes.find(|(rect, _)| rect.contains(pointer))?;
        Some(pane.clone())
    }

    /// The tabs that a view is among.
    fn home_of(&self, name: &str) -> Option<TileId> {
        let mut tiles = self.tree.tiles.iter();
        let found =
            tiles.find(|(_, tile)| matches!(tile, egui_tiles::Tile::Pane(pane) if pane == name));
        self.tree.tiles.parent_of(*found?.0)
    }

    /// Brings a view to the front; a view that was closed comes back to where it was.
    pub(super) fn show(&mut self, name: &str) {
        if self.alone.is_some() {
            self.alone = Some(name.to_owned());
        }
        let is_wanted = |pane: &String| pane == name;
        let found = self.tree.tiles.iter().find_map(|(id, tile)| match tile {
            egui_tiles::Tile::Pane(pane) if is_wanted(pane) => Some(*id),
            _ => None,
        });
        let id = found.unwrap_or_else(|| {
            let id = self.tree.tiles.insert_pane(name.to_owned());
            // Beside those that are like it, where there are any.
            let kin = KIN.iter().filter(|kin| kin.contains(&name)).copied();
            let kin = kin.flatten().find_map(|kin| self.home_of(kin));
            match kin.or(self.tree.root()) {
                Some(home) => {
                    self.tree
                        .move_tile_to_container(id, home, usize::MAX, false);
                }
                None => self.tree.root = Some(id),
            }
            id
        });
        self.tree.tiles.set_visible(id, true);
        self.tree.make_active(|tile, _| tile == id);
    }

    /// Draws the view that has all the room, with nothing around it.
    pub(super) fn alone_ui(&mut self, ui: &mut egui::Ui, state: &AppState, commands: &Queue) {
        let Some(name) = &self.alone else { return };
        let mut panes = Panes {
            views: &mut self.views,
            state,
            commands,
        };
        panes.draw_pane(ui, name);
    }

    pub(super) fn ui(&mut self, ui: &mut egui::Ui, state: &AppState, commands: &Queue) {
        let mut panes = Panes {
            views: &mut self.views,
            state,
            commands,
        };
        if let Some(name) = &mut self.alone {
            ui.horizontal(|ui| {
                ui.strong(title(name));
                let restore = ui.small_button("All views").on_hover_text("Back (M)");
                if restore.clicked() {
                    commands.send(Command::Maximize(None));
                }
            });
            panes.draw_pane(ui, name);
        } else {
            self.tree.ui(&mut panes, ui);
        }
    }

    /// Where a view is drawn \[points\], if it is in sight.
    pub(super) fn place_of(&self, name: &str) -> Option<egui::Rect> {
        let id = self.tree.tiles.iter().find_map(|(id, tile)| match tile {
            egui_tiles::Tile::Pane(pane) if pane == name => Some(*id),
            _ => None,
        })?;
        self.tree.tiles.rect(id)
    }

    /// The arrangement, to be saved.
    pub(super) fn to_json(&self) -> serde_json::Result<serde_json::Value> {
        serde_json::to_value(&self.tree)
    }

    /// Goes back to a saved arrangement.
    pub(super) fn restore(&mut self, saved: serde_json::Value) -> serde_json::Result<()> {
        self.tree = serde_json::from_value(saved)?;
        Ok(())
    }
}

/// Before and behind the name on a tab \[points\].
const TAB_GAP: f32 = 5.0;

/// Views that are looked for beside each other. One that a layout does not have is opened among its kin.
const KIN: [&[&str]; 3] = [
    &["charts", "batch"],
    &["images", "retrieval", "synthetic", "beside", "lockstep"],
    &["report", "differences", "log"],
];

/// Views in tabs.
fn tabs(tiles: &mut Tiles<String>, names: &[&str]) -> TileId {
    let panes: Vec<_> = names
        .iter()
        .filter(|name| views::ALL.iter().any(|entry| entry.name == **name))
        .map(|name| tiles.insert_pane((*name).to_owned()))
        .collect();
    tiles.insert_tab_tile(panes)
}

/// Gives the parts of a split their shares of its room.
fn share(tiles: &mut Tiles<String>, container: TileId, shares: &[(TileId, f32)]) {
    if let Some(egui_tiles::Tile::Container(egui_tiles::Container::Linear(linear))) =
        tiles.get_mut(container)
    {
        for (tile, share) in shares {
            linear.shares.set_share(*tile, *share);
        }
    }
}

fn tree(root: TileId, tiles: Tiles<String>) -> Tree<String> {
    Tree::new(egui::Id::unique("views"), root, tiles)
}

fn inspecting() -> Tree<String> {
    let mut tiles = Tiles::default();
    let lists = [views::QUERIES, "references", views::PARAMETERS];
    let lists = tabs(&mut tiles, &lists);
    let pictures = tabs(
        &mut tiles,
        &["images", "retrieval", "synthetic", "beside", "lockstep"],
    );
    let space = tabs(&mut tiles, &["space", "ransac", "breakpoints"]);
    let surface = tabs(&mut tiles, &["surface"]);
    let histogram = tabs(&mut tiles, &["histogram", "fusion"]);
    let words = tabs(
        &mut tiles,
        &["report", "differences", "batch", "charts", "log"],
    );
    let lower = tiles.insert_horizontal_tile(vec![surface, histogram]);
    let middle = tiles.insert_vertical_tile(vec![pictures, lower]);
    let right = tiles.insert_vertical_tile(vec![space, words]);
    let root = tiles.insert_horizontal_tile(vec![lists, middle, right]);
    let thirds = [(lists, 0.24), (middle, 0.47), (right, 0.29)];
    share(&mut tiles, root, &thirds);
    // Photos of drives are wide; the map with its legend needs more room than the histogram.
    share(&mut tiles, middle, &[(pictures, 0.44), (lower, 0.56)]);
    share(&mut tiles, lower, &[(surface, 0.62), (histogram, 0.38)]);
    tree(root, tiles)
}

fn teaching() -> Tree<String> {
    let mut tiles = Tiles::default();
    let indirect = tabs(&mut tiles, &["images", "synthetic"]);
    let direct = tabs(&mut tiles, &["surface", "ransac", "histogram"]);
    let space = tabs(&mut tiles, &["space"]);
    let lower = tiles.insert_horizontal_tile(vec![direct, space]);
    let root = tiles.insert_vertical_tile(vec![indirect, lower]);
    tree(root, tiles)
}

/// The first view above the others, which are beside each other; each has its name on a tab.
fn presenting(names: &[String]) -> Tree<String> {
    let mut tiles = Tiles::default();
    let mut panes = names.iter().map(|name| tabs(&mut tiles, &[name.as_str()]));
    let Some(first) = panes.next() else {
        return teaching();
    };
    let others: Vec<TileId> = panes.collect();
    let root = match others.as_slice() {
        [] => first,
        [other] => tiles.insert_vertical_tile(vec![first, *other]),
        _ => {
            let lower = tiles.insert_horizontal_tile(others);
            tiles.insert_vertical_tile(vec![first, lower])
        }
    };
    tree(root, tiles)
}

fn sorting() -> Tree<String> {
    let mut tiles = Tiles::default();
    let batch = tabs(
        &mut tiles,
        &["batch", "charts", views::QUERIES, "references"],
    );
    let pictures = tabs(&mut tiles, &["images", "synthetic"]);
    let words = tabs(&mut tiles, &["surface", "ransac", "report"]);
    let right = tiles.insert_vertical_tile(vec![pictures, words]);
    let root = tiles.insert_horizontal_tile(vec![batch, right]);
    share(&mut tiles, root, &[(batch, 0.55), (right, 0.45)]);
    tree(root, tiles)
}

/// What the tree draws its panes with.
struct Panes<'a> {
    views: &'a mut BTreeMap<&'static str, ViewPair>,
    state: &'a AppState,
    commands: &'a Queue,
}

fn title(name: &str) -> &str {
    let entry = views::ALL.iter().find(|entry| entry.name == name);
    entry.map_or(name, |entry| entry.title)
}

impl Panes<'_> {
    fn draw_pane(&mut self, ui: &mut egui::Ui, pane: &str) {
        let Some(pair) = self.views.get_mut(pane) else {
            ui.weak(format!("There is no view `{pane}`"));
            return;
        };
        egui::Frame::NONE.inner_margin(6.0).show(ui, |ui| {
            let present = ViewContext::present(self.state, self.commands);
            let kept = ViewContext::kept(self.state, self.commands);
            match (self.state.options.compare_mode, kept) {
                (CompareMode::Kept, Some(kept)) => draw(ui, "A", &mut pair.kept, &kept),
                (CompareMode::SideBySide, Some(kept)) => ui.columns(2, |columns| {
                    draw(&mut columns[0], "A", &mut pair.kept, &kept);
                    draw(&mut columns[1], "B", &mut pair.present, &present);
                }),
                _ => draw(ui, "B", &mut pair.present, &present),
            }
        });
    }
}

impl Behavior<String> for Panes<'_> {
    fn pane_ui(&mut self, ui: &mut egui::Ui, _tile: TileId, pane: &mut String) -> UiResponse {
        self.draw_pane(ui, pane);
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, pane: &String) -> egui::WidgetText {
        title(pane).into()
    }

    fn top_bar_right_ui(
        &mut self,
        tiles: &Tiles<String>,
        ui: &mut egui::Ui,
        _tile: TileId,
        tabs: &egui_tiles::Tabs,
        _scroll_offset: &mut f32,
    ) {
        let active = tabs.active.and_then(|id| tiles.get(id));
        if let Some(egui_tiles::Tile::Pane(pane)) = active {
            let help = format!("All the room for {} (M)", title(pane));
            let button = ui.small_button("■").on_hover_text(&help);
            button.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &help));
            if button.clicked() {
                self.commands.send(Command::Maximize(views::name_of(pane)));
            }
        }
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions {
            all_panes_must_have_tabs: true,
            ..SimplificationOptions::default()
        }
    }

    fn is_tab_closable(&self, _tiles: &Tiles<String>, _tile: TileId) -> bool {
        true
    }

    fn tab_title_spacing(&self, _visuals: &egui::Visuals) -> f32 {
        TAB_GAP
    }

    /// A closed view is hidden: so it keeps its place until it is wanted again.
    fn on_tab_close(&mut self, tiles: &mut Tiles<String>, tile: TileId) -> bool {
        close(tiles, tile);
        false
    }
}

fn close(tiles: &mut Tiles<String>, tile: TileId) {
    tiles.set_visible(tile, false);
}

fn draw(ui: &mut egui::Ui, run: &str, view: &mut Box<dyn View>, context: &ViewContext<'_>) {
    ui.push_id(run, |ui| {
        // The present run alone needs no name: nothing moves for a run that is kept beside it.
        let is_compared = context.options.compare_mode != CompareMode::Present;
        if is_compared && context.other_run().is_some() {
            ui.weak(match run {
                "A" => "A, kept",
                _ => "B, present",
            });
        }
        view.ui(ui, context);
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pane(layout: &Layout, name: &str) -> TileId {
        let mut tiles = layout.tree.tiles.iter();
        let found = tiles.find(|(_, tile)| matches!(tile, egui_tiles::Tile::Pane(p) if p == name));
        *found.expect("a view of the first layout").0
    }

    #[test]
    fn a_view_that_was_closed_comes_back_to_its_old_place() {
        let mut layout = Layout::new(None);
        for name in ["surface", "report"] {
            let id = pane(&layout, name);
            let home = layout.tree.tiles.parent_of(id);
            close(&mut layout.tree.tiles, id);
            assert!(!layout.tree.is_visible(id));
            layout.show(name);
            assert!(layout.tree.is_visible(id));
            assert_eq!(layout.tree.tiles.parent_of(pane(&layout, name)), home);
        }
    }
}
