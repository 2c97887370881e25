//! The way of another system's poses from above, coloured by how far off each seems.

use maud::{Markup, html};
use nalgebra::Point2;

use super::super::{ReportedResult, RunReport};
use crate::chart::{Chart, GroundAxes, Mark, Shape};
use crate::estimator;
use crate::geometry::Pose;
use crate::localize::{PoseReport, QueryResult};
use crate::method::Method;
use crate::opinion::{BetterPose, Opinion, Standing};
use crate::palette;
use crate::route::from_above;

/// The routes of all other systems whose poses have a second opinion, with remarks on them.
pub(super) fn routes(report: &RunReport, remarks: &[String]) -> Markup {
    let is_foreign = |method: &&Method| estimator::find(**method).is_none();
    let methods = report.run.protocol.methods.iter().filter(is_foreign);
    let charts: Vec<(Chart, usize)> = methods.filter_map(|method| route(report, *method)).collect();
    html! {
        @if !charts.is_empty() {
            section aria-labelledby="route" {
                h2 id="route" { "Where poses seem off" }
                p { "Each dot is a query, seen from above, where posescope has it, or else where its pose is. A line leads to the \
                     pose that is contradicted. Rest the pointer on a dot for its second opinion." }
                @for remark in remarks { p { (remark) } }
                @for (chart, left_out) in charts {
                    figure.plot style="max-width:48rem" {
                        (chart.svg(None))
                        figcaption {
                            (chart.title)
                            @if left_out > 0 { "; " (left_out) " poses far outside are not drawn" }
                        }
                    }
                }
            }
        }
    }
}

/// A query on the way.
struct Placed<'a> {
    one: &'a ReportedResult,
    opinion: &'a Opinion,
    given: Pose,
    own: Option<Pose>,
}

/// The route of a method, and how many poses are too far away to be drawn.
fn route(report: &RunReport, method: Method) -> Option<(Chart, usize)> {
    let results = report.results.iter().filter(|one| one.result.method == method);
    let placed: Vec<Placed<'_>> = results
        .filter_map(|one| {
            let opinion = one.result.opinion.as_ref()?;
            let given = one.result.pose.as_ref().and_then(PoseReport::to_pose)?;
            let own = opinion.own.as_ref().and_then(BetterPose::to_pose);
            Some(Placed { one, opinion, given, own })
        })
        .collect();
    // The own poses span the plane, which wild ones may not.
    let known: Vec<Pose> = placed.iter().filter_map(|one| one.own).collect();
    let of_given = placed.iter().map(|one| one.given);
    let all: Vec<Pose> = known.iter().copied().chain(of_given).collect();
    let places = from_above(&all)?;
    let (own_places, given_places) = places.split_at(known.len());
    let is_far = far_from(if own_places.is_empty() { given_places } else { own_places });
    let mut own_places = own_places.iter();
    let (mut dots, mut lines, mut left_out) = (Vec::new(), Vec::new(), 0);
    for (one, given) in placed.iter().zip(given_places) {
        let own = one.own.and_then(|_| own_places.next());
        match own {
            _ if own.is_none() && is_far(given) => left_out += 1,
            Some(own) if one.opinion.standing == Standing::Contradicted => {
                if is_far(given) {
                    left_out += 1;
                } else {
                    lines.push([*own, *given]);
                }
                dots.push((one, *own));
            }
            own => dots.push((one, *own.unwrap_or(given))),
        }
    }
    let shown: Vec<Point2<f64>> =
        dots.iter().map(|(_, at)| *at).chain(lines.iter().flatten().copied()).collect();
    let axes = GroundAxes::of(&shown)?;
    let line = lines.iter().map(|ends| {
        let ends = ends.iter().map(|at| axes.place(at)).collect();
        Mark::new(Shape::Line(ends), palette::ESTIMATE)
    });
    let mut marks: Vec<Mark> = line.collect();
    marks.extend(dots.iter().map(|(one, at)| dot(one, axes.place(at))));
    let legend = [
        ("confirmed", palette::TRUTH),
        ("contradicted", palette::ESTIMATE),
        ("undecided", palette::NO_POSE),
    ];
    let chart = Chart {
        title: format!("Second opinions on the poses of {method}, from above"),
        x: axes.x,
        y: axes.y,
        marks,
        legend: legend.map(|(name, color)| (name.to_owned(), color)).to_vec(),
    };
    Some((chart.in_words_of(report.unit()), left_out))
}

/// The dot of a query: filled where the opinion is decided.
fn dot(one: &Placed<'_>, at: (f64, f64)) -> Mark {
    let (color, filled) = match one.opinion.standing {
        Standing::Confirmed => (palette::TRUTH, true),
        Standing::Contradicted => (palette::ESTIMATE, true),
        Standing::Undecided => (palette::NO_POSE, false),
    };
    let result: &QueryResult = &one.one.result;
    let title = format!("{}: {}", result.query, one.opinion.words());
    let link = result.is_suspect().then(|| format!("#f{}", one.one.number));
    Mark { link, ..Mark::new(Shape::Dot { at, filled }, color).titled(title) }
}

/// Whether a place lies far outside of others.
fn far_from(places: &[Point2<f64>]) -> impl Fn(&Point2<f64>) -> bool {
    let corners = places.first().map(|first| {
        places.iter().fold((*first, *first), |(least, most), at| (least.inf(at), most.sup(at)))
    });
    move |at: &Point2<f64>| {
        corners.is_none_or(|(least, most)| {
            let room = (most - least).norm().max(10.0);
            let beyond = (least - at).sup(&(at - most)).max();
            beyond > room || !beyond.is_finite()
        })
    }
}
