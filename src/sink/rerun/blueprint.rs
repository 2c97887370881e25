//! The layout of a recording in the stock viewer: the world, and a row per method.

use rerun::SeriesLines;
use rerun::blueprint::components::{Corner2D, Eye3DKind};
use rerun::external::re_sdk_types::blueprint::archetypes::{EyeControls3D, LineGrid3D, PlotLegend};

use super::entities;
use super::layout::{BlueprintNode, BlueprintView};
use super::stream::Stream;
use crate::cost::ExplanationKind;
use crate::estimator::{self, Entry, Family};
use crate::features::FeatureState;
use crate::geometry::Pose;
use crate::localize::QueryResult;
use crate::method::Method;
use crate::palette;
use crate::params::Params;
use crate::problem::Problem;
use crate::proof::responsible;

/// Ranked frames per row; car photos are wide.
const RANKS_PER_ROW: usize = 3;

/// The input of a layout.
pub(super) struct LayoutInput<'a> {
    /// The methods of the run.
    pub(super) methods: &'a [Method],
    /// Their parameters, which decide how they search.
    pub(super) params: &'a Params,
    /// The first problem; its reference defines the points of view.
    pub(super) first: &'a Problem,
    /// The number of references of a query.
    pub(super) references: usize,
    /// The number of ranked frames with a picture.
    pub(super) ranked: usize,
    /// What to show first.
    pub(super) focus: &'a Focus,
    /// Whether the recording has pages of a lesson.
    pub(super) has_pages: bool,
}

/// What the layout shows first.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Focus {
    /// The estimators behind wrong or missing results; for a hybrid, the one whose pose it took.
    pub(super) wrong: Vec<Method>,
    /// The methods with a picture that proves the failure.
    pub(super) proven: Vec<Method>,
    /// Places that the view of the world must include, in the frame of the first reference camera \[m\].
    pub(super) places: Vec<[f64; 3]>,
}

impl Focus {
    /// From the results of a query so far.
    pub(super) fn of(
        first: &Problem,
        truth: Option<&Pose>,
        results: &[QueryResult],
        proven: &[Method],
    ) -> Self {
        let wrong = results.iter().filter(|result| is_wrong(result));
        // What is right is at the truth.
        let far = results.iter().filter(|result| truth.is_none() || is_wrong(result));
        let estimates = far.filter_map(|result| result.pose.as_ref()?.to_pose());
        let in_reference = |pose: &Pose| -> [f64; 3] {
            first.reference_from_query(pose).translation.vector.into()
        };
        Self {
            wrong: wrong.filter_map(responsible).flat_map(recorded_with).collect(),
            proven: proven.to_vec(),
            places: estimates.chain(truth.copied()).map(|pose| in_reference(&pose)).collect(),
        }
    }
}

/// The methods whose events show what a method does.
pub(super) fn recorded_with(method: Method) -> Vec<Method> {
    estimator::find(method).map_or(vec![method], Entry::recorded_methods)
}

/// Whether a result is wrong or missing, or has a failure verdict.
pub(super) fn is_wrong(result: &QueryResult) -> bool {
    let mut verdicts = result.diagnosis.iter();
    result.is_suspect() || verdicts.any(|one| one.code.is_failure())
}

/// Sends the layout for a run.
pub(super) fn send(stream: &mut Stream, input: &LayoutInput<'_>) {
    stream.send_layout(&root(input));
}

/// Logs names and colours of the plots.
pub(super) fn log_styles(stream: &mut Stream, methods: &[Method], params: &Params) {
    let names = |names: &[&str]| SeriesLines::new().with_names(names.iter().copied());
    if shows_features(methods, params) {
        let best = names(&["best inliers"]);
        stream.log_static(entities::RANSAC_BEST, &best);
    }
    let direct = searches(methods);
    for &method in &direct {
        let best = names(&["best cost"]).with_colors([super::color(palette::ESTIMATE)]);
        stream.log_static(&entities::direct(method, "best"), &best);
    }
    for method in direct.into_iter().filter(|&method| has_histogram(method)) {
        let entropies = names(&["H(query)", "H(synthetic)", "H(both)"]);
        stream.log_static(&entities::direct(method, "entropy"), &entropies);
    }
}

/// Whether features are matched.
fn shows_features(methods: &[Method], params: &Params) -> bool {
    let mut recorded = methods.iter().flat_map(|&method| recorded_with(method));
    recorded.any(|method| family(method, params).is_some_and(|of| Family::MATCHING.contains(&of)))
}

fn family(method: Method, params: &Params) -> Option<Family> {
    estimator::find(method)?.family(params)
}

/// The methods that search a cost, each of which has a row.
fn searches(methods: &[Method]) -> Vec<Method> {
    let recorded: Vec<Method> = methods.iter().flat_map(|&method| recorded_with(method)).collect();
    estimator::direct_methods(&recorded)
}

/// Whether a method's cost uses a joint histogram.
fn has_histogram(method: Method) -> bool {
    let cost = estimator::find(method).and_then(Entry::cost);
    cost.and_then(|cost| cost.explains()) == Some(ExplanationKind::JointHistogram)
}

/// The world and text on the left, a row per method on the right.
fn root(input: &LayoutInput<'_>) -> BlueprintNode {
    let LayoutInput { methods, params, first, references, ranked, focus, has_pages } = *input;
    let viewpoints = &Viewpoints(first);
    let document = |name, origin: &str| view("TextDocument", name, origin);
    let mut words = vec![
        document("Report", entities::REPORT),
        view("TextLog", "Log", entities::LOG),
        view("StateTimeline", "Stages", "stage"),
    ];
    if references > 1 {
        words.push(document("Fusion", entities::FUSION_TABLE));
    }
    if ranked > 0 {
        words.push(document("Ranking", entities::RETRIEVAL_TABLE));
    }
    let mut left =
        vec![(3.0, overview(viewpoints, &focus.places).into()), (2.0, BlueprintNode::tabs(words))];
    if has_pages {
        left.insert(0, (4.0, document("Lesson", entities::LESSON)));
    }
    let left = BlueprintNode::column(left);
    let mut rows = Vec::new();
    if shows_features(methods, params) {
        rows.push((1.0, feature_row()));
    }
    let mut direct = searches(methods);
    // The first tab, which is open, shows a failure.
    direct.sort_by_key(|method| !focus.wrong.contains(method));
    let share = match direct.first() {
        Some(first) if focus.wrong.contains(first) => 1.8,
        _ => 1.2,
    };
    let row = |method| search_row(method, methods, params, viewpoints);
    let direct: Vec<_> = direct.into_iter().map(row).collect();
    // Three rows would be too low for the photos.
    if rows.is_empty() {
        rows = equal(direct);
    } else if !direct.is_empty() {
        rows.push((share, BlueprintNode::tabs(direct)));
    }
    // The proofs come first: a recording of a failure opens on them.
    let proofs = focus.proven.iter().map(|&method| {
        let name = format!("Why {} is wrong", method.label());
        view("2D", name, entities::proof(method))
    });
    let mut tabs: Vec<BlueprintNode> = proofs.collect();
    tabs.push(BlueprintNode::row("Methods", equal([BlueprintNode::column(rows)])));
    if ranked > 0 {
        tabs.push(ranks(ranked));
    }
    let right = BlueprintNode::tabs(tabs);
    BlueprintNode::row("posescope", vec![(2.0, left), (3.0, right)])
}

/// The ranked frames, the best at the top left.
fn ranks(ranked: usize) -> BlueprintNode {
    let frame = |rank: &usize| {
        let name = format!("Rank {} (query above)", rank + 1);
        view("2D", name, entities::rank(*rank))
    };
    let ranks: Vec<usize> = (0..ranked).collect();
    let rows = ranks.chunks(RANKS_PER_ROW);
    let rows = rows.map(|chunk| BlueprintNode::row("ranks", equal(chunk.iter().map(frame))));
    BlueprintNode::row("Retrieval", equal([BlueprintNode::column(equal(rows))]))
}

fn overview(viewpoints: &Viewpoints<'_>, places: &[[f64; 3]]) -> BlueprintView {
    BlueprintView::new("3D", "World", "/")
        // The maps of PM and MI overlap, so each has its own view.
        .of(["+ /world/**", "- /world/search/**", "- /world/correspondences/outlier/**"])
        .with("EyeControls3D", viewpoints.behind(places))
        .with("LineGrid3D", LineGrid3D::new().with_visible(false))
}

fn feature_row() -> BlueprintNode {
    let photo = BlueprintView::new("2D", "Matches (query above reference)", "fb/matches/0").of([
        "+ $origin/**".to_owned(),
        format!("- $origin/{}/**", FeatureState::NAMES[0]),
        format!("- $origin/{}/**", FeatureState::NAMES[1]),
    ]);
    let photos = BlueprintNode::tabs([photo.into(), view("2D", "Query", "query")]);
    let [inliers, likelihood] =
        ["inliers", "log likelihood"].map(|what| format!("RANSAC {what} (timeline eval)"));
    let numbers = BlueprintNode::tabs(vec![
        plot("RANSAC best", entities::RANSAC_BEST),
        plot(inliers, entities::RANSAC_INLIERS),
        plot(likelihood, entities::RANSAC_LIKELIHOOD),
    ]);
    let funnel = BlueprintNode::tabs(vec![
        view("TextDocument", "Funnel", entities::FUNNEL_TABLE),
        view("BarChart", "Funnel chart", entities::FUNNEL),
    ]);
    let numbers = BlueprintNode::column(equal([numbers, funnel]));
    BlueprintNode::row("FB", vec![(3.0, photos), (2.0, numbers)])
}

/// The search of a direct method, step by step.
fn search_row(
    method: Method,
    methods: &[Method],
    params: &Params,
    viewpoints: &Viewpoints<'_>,
) -> BlueprintNode {
    let name = method.label();
    let of = |part: &str| entities::direct(method, part);
    let image = |what: &str, part: &str| view("2D", format!("{name} {what}"), of(part));
    let comparison = BlueprintNode::tabs(if !has_histogram(method) {
        vec![image("residual", "residual"), image("weights", "weights")]
    } else {
        vec![
            image("joint histogram (right: synthetic, up: query)", "joint_histogram"),
            plot(format!("{name} entropy"), of("entropy")),
        ]
    });
    let query = view("2D", "Query", entities::QUERY_IMAGE);
    let views = BlueprintNode::tabs(vec![image("synthetic", "synthetic"), query]);
    let mut maps = vec![
        map(method, methods, "cost", viewpoints).into(),
        map(method, methods, "coverage", viewpoints).into(),
        plot(format!("{name} best"), of("best")),
        plot(format!("{name} cost (timeline eval)"), of("cost")),
    ];
    // Others search all freedoms at once.
    if family(method, params) == Some(Family::Grid) {
        let yaw = view("BarChart", format!("{name} yaw [°]"), entities::yaw_curve(method));
        maps.insert(1, yaw);
    }
    let maps = BlueprintNode::tabs(maps);
    let views = BlueprintNode::column(equal([views, comparison]));
    BlueprintNode::row(&name, vec![(3.0, views), (2.0, maps)])
}

fn view(class: &'static str, name: impl Into<String>, origin: impl Into<String>) -> BlueprintNode {
    BlueprintView::new(class, name, origin).into()
}

/// Nodes with equal shares.
fn equal(nodes: impl IntoIterator<Item = BlueprintNode>) -> Vec<(f32, BlueprintNode)> {
    nodes.into_iter().map(|node| (1.0, node)).collect()
}

/// A surface of the grid search, seen from above.
fn map(
    method: Method,
    methods: &[Method],
    part: &str,
    viewpoints: &Viewpoints<'_>,
) -> BlueprintView {
    let name = format!("{} {part}", method.label());
    let mut contents = vec![
        format!("+ /{}/**", entities::search(method, part)),
        format!("+ /{}", entities::search(method, "path")),
        format!("+ /{}/label", entities::reference(0)),
        format!("+ /{}/label", entities::truth()),
    ];
    // Where only a method that runs this one was asked for, the result is that one's.
    let results: Vec<Method> = if methods.contains(&method) {
        vec![method]
    } else {
        methods.iter().copied().filter(|&asked| recorded_with(asked).contains(&method)).collect()
    };
    let label = |asked: &Method| format!("+ /{}/label", entities::estimate(*asked));
    contents.extend(results.iter().map(label));
    BlueprintView::new("3D", name, "/")
        .of(contents)
        .with("EyeControls3D", viewpoints.above())
        .with("LineGrid3D", LineGrid3D::new().with_visible(false))
}

fn plot(name: impl Into<String>, origin: impl Into<String>) -> BlueprintNode {
    let legend = PlotLegend::new().with_corner(Corner2D::LeftBottom);
    BlueprintView::new("TimeSeries", name, origin).with("PlotLegend", legend).into()
}

/// Points of view, fixed to the first reference camera.
struct Viewpoints<'a>(&'a Problem);

impl Viewpoints<'_> {
    /// Looks from behind the reference camera, far enough to see all places.
    fn behind(&self, places: &[[f64; 3]]) -> EyeControls3D {
        let up = [0.0, -1.0, 0.0];
        let Some(nearest) = places.iter().map(|place| place[2]).reduce(f64::min) else {
            return self.at([-2.0, -5.0, -9.0], [0.0, 0.0, 10.0], up);
        };
        let span = |axis: usize| {
            let values = || places.iter().map(|place| place[axis]);
            let (least, most) = (values().fold(0.0, f64::min), values().fold(0.0, f64::max));
            ((least + most) / 2.0, most - least)
        };
        let ((middle_x, wide), (middle_z, long)) = (span(0), span(2));
        let back = 9.0 + wide + 0.5 * long;
        self.at(
            [middle_x - 0.2 * back, -0.6 * back, nearest.min(0.0) - back],
            [middle_x, 0.0, middle_z],
            up,
        )
    }

    /// Looks down on the disc of the search, with the forward direction up.
    fn above(&self) -> EyeControls3D {
        let height = 2.2 * self.0.uncertainty_radius_m();
        self.at([0.0, -height, -0.01], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    }

    /// A point of view in the reference camera's frame; its centre is the drawn origin.
    fn at(&self, position: [f64; 3], target: [f64; 3], up: [f64; 3]) -> EyeControls3D {
        let rotation = self.0.reference().world_from_camera().rotation;
        let world = |v: [f64; 3]| -> [f32; 3] {
            (rotation * nalgebra::Vector3::from(v)).cast::<f32>().into()
        };
        EyeControls3D::new()
            .with_kind(Eye3DKind::Orbital)
            .with_position(world(position))
            .with_look_target(world(target))
            .with_eye_up(world(up))
    }
}
