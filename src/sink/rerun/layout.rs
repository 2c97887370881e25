//! Blueprints: containers and views with their properties.
//!
//! Rerun's own blueprint types lack view properties, such as the camera of a 3-D view, and have random ids.

use rerun::blueprint::components::{
    ColumnShare, ContainerKind, IncludedContent, LoopMode, PanelState, PlayState, QueryExpression,
    RootContainer, RowShare, TimelineName, ViewClass,
};
use rerun::components::Name;
use rerun::external::re_log_types::BlueprintActivationCommand;
use rerun::external::re_sdk_types::blueprint::archetypes::{
    ContainerBlueprint, PanelBlueprint, TimePanelBlueprint, ViewBlueprint, ViewContents,
    ViewportBlueprint,
};
use rerun::{AsComponents, RecordingStream, RecordingStreamBuilder, RecordingStreamResult};
use xxhash_rust::xxh3::xxh3_128;

use super::entities::{APPLICATION_ID, STEP_TIMELINE};

/// A view.
pub(super) struct BlueprintView {
    class: &'static str,
    name: String,
    origin: String,
    contents: Vec<String>,
    properties: Vec<(&'static str, Box<dyn AsComponents>)>,
}

impl BlueprintView {
    /// A view of everything at and below `origin`.
    pub(super) fn new(
        class: &'static str,
        name: impl Into<String>,
        origin: impl Into<String>,
    ) -> Self {
        Self {
            class,
            name: name.into(),
            origin: origin.into(),
            contents: vec!["$origin/**".to_owned()],
            properties: Vec::new(),
        }
    }

    /// Restricts the content to these expressions (`+ /world/**`, `- /world/search/**`).
    pub(super) fn of(mut self, contents: impl IntoIterator<Item = impl Into<String>>) -> Self {
        self.contents = contents.into_iter().map(Into::into).collect();
        self
    }

    /// Adds a property of the view; `name` is that of the archetype.
    pub(super) fn with(
        mut self,
        name: &'static str,
        property: impl AsComponents + 'static,
    ) -> Self {
        self.properties.push((name, Box::new(property)));
        self
    }
}

/// A node of the layout.
pub(super) enum BlueprintNode {
    /// Nodes with their shares of the width or height, and the title of the tab that they are in.
    Container { kind: ContainerKind, name: Option<String>, children: Vec<(f32, BlueprintNode)> },
    /// A single view.
    View(Box<BlueprintView>),
}

impl BlueprintNode {
    /// Side by side, with shares of the width, below this title.
    pub(super) fn row(name: &str, children: Vec<(f32, Self)>) -> Self {
        Self::Container { kind: ContainerKind::Horizontal, name: Some(name.to_owned()), children }
    }

    /// Stacked, with shares of the height.
    pub(super) fn column(children: Vec<(f32, Self)>) -> Self {
        Self::Container { kind: ContainerKind::Vertical, name: None, children }
    }

    /// Tabs; the first one is open.
    pub(super) fn tabs(children: impl IntoIterator<Item = Self>) -> Self {
        let children = children.into_iter().map(|child| (1.0, child)).collect();
        Self::Container { kind: ContainerKind::Tabs, name: None, children }
    }
}

impl From<BlueprintView> for BlueprintNode {
    fn from(view: BlueprintView) -> Self {
        Self::View(Box::new(view))
    }
}

/// Sends a layout with a recording, with the time panel on `step` at the end of the run. The last layout is used. Each
/// `revision` has its own id, because a viewer keeps its state of a known layout.
pub(super) fn send(
    root: &BlueprintNode,
    recording_id: &str,
    revision: i64,
    recording: &RecordingStream,
) -> RecordingStreamResult<()> {
    let (stream, storage) = RecordingStreamBuilder::new(APPLICATION_ID)
        .recording_id(format!("{recording_id}-blueprint-{revision}"))
        .blueprint()
        .memory()?;
    stream.set_time_sequence("blueprint", 0);
    log_node(&stream, root, "root")?;
    let viewport = ViewportBlueprint::new()
        .with_root_container(RootContainer(id("root").to_be_bytes().into()))
        .with_auto_layout(false)
        .with_auto_views(false);
    stream.log("viewport", &viewport)?;
    let time_panel = TimePanelBlueprint::new()
        .with_state(PanelState::Expanded)
        .with_timeline(TimelineName::from(STEP_TIMELINE))
        .with_play_state(PlayState::Following)
        .with_loop_mode(LoopMode::Off);
    stream.log("time_panel", &time_panel)?;
    for panel in ["blueprint_panel", "selection_panel"] {
        stream.log(panel, &PanelBlueprint::new().with_state(PanelState::Collapsed))?;
    }
    if let Some(info) = stream.store_info() {
        let activation = BlueprintActivationCommand {
            blueprint_id: info.store_id,
            make_active: true,
            make_default: true,
        };
        recording.send_blueprint(storage.take(), activation);
    }
    Ok(())
}

/// Logs a node with its children; `place` is its path in the tree.
fn log_node(
    stream: &RecordingStream,
    node: &BlueprintNode,
    place: &str,
) -> RecordingStreamResult<()> {
    let (kind, name, children) = match node {
        BlueprintNode::View(view) => return log_view(stream, view, place),
        BlueprintNode::Container { kind, name, children } => (*kind, name, children),
    };
    let mut contents = Vec::new();
    for (index, (_, child)) in children.iter().enumerate() {
        let place = format!("{place}/{index}");
        log_node(stream, child, &place)?;
        contents.push(IncludedContent(path_of(child, &place).as_str().into()));
    }
    let container = ContainerBlueprint::new(kind).with_contents(contents);
    let shares = children.iter().map(|(share, _)| (*share).into());
    let container = match kind {
        ContainerKind::Vertical => container.with_row_shares(shares.map(RowShare)),
        _ => container.with_col_shares(shares.map(ColumnShare)),
    };
    let container = match name {
        Some(name) => container.with_display_name(Name(name.as_str().into())),
        None => container,
    };
    stream.log(path_of(node, place), &container)
}

fn log_view(
    stream: &RecordingStream,
    view: &BlueprintView,
    place: &str,
) -> RecordingStreamResult<()> {
    let BlueprintView { class, name, origin, contents, properties } = view;
    let path = view_path(place, class);
    let expressions = contents.iter().map(|line| QueryExpression(line.as_str().into()));
    stream.log(format!("{path}/ViewContents"), &ViewContents::new(expressions))?;
    let blueprint = ViewBlueprint::new(ViewClass((*class).into()))
        .with_display_name(Name(name.as_str().into()))
        .with_space_origin(origin.as_str());
    stream.log(path.as_str(), &blueprint)?;
    for (name, property) in properties {
        stream.log(format!("{path}/{name}"), property.as_ref())?;
    }
    Ok(())
}

fn path_of(node: &BlueprintNode, place: &str) -> String {
    match node {
        BlueprintNode::View(view) => view_path(place, view.class),
        BlueprintNode::Container { .. } => format!("container/{}", uuid(place)),
    }
}

/// A viewer keeps its state of a view by id, and uses the layout of the previous recording until it has read the
/// next one. So an id must have the same class in all recordings.
fn view_path(place: &str, class: &str) -> String {
    format!("view/{}", uuid(&format!("{place} {class}")))
}

/// A stable id: the same layout has the same ids in every recording.
fn id(place: &str) -> u128 {
    xxh3_128(place.as_bytes())
}

fn uuid(place: &str) -> String {
    let hex = format!("{:032x}", id(place));
    let parts = [&hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..]];
    parts.join("-")
}
