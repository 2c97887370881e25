//! `survey.html`: where photos are localised in a map, why not elsewhere, and how far confidence can be trusted there.

use std::collections::BTreeMap;

use maud::{Markup, html};
use nalgebra::Point2;

use super::SurveyRequest;
use super::answers::{Answer, GROUPS, Part, Surveyed};
use super::places::{self, Place};
use crate::chart::{Axis, Chart, GroundAxes, Mark, Shape};
use crate::diagnosis::{Code, Grade};
use crate::geometry::Pose;
use crate::palette::{self, Rgb};
use crate::report::{document, table};
use crate::route::from_above;
use crate::scale::LengthUnit;
use crate::scene::{Scene, SceneSize};
use crate::table::Table;

/// A photo near a reference, and what became of it.
struct Photo<'a> {
    name: &'a str,
    at: Option<Point2<f64>>,
    answers: Vec<&'a Answer>,
}

impl Photo<'_> {
    fn right(&self) -> usize {
        self.answers.iter().filter(|answer| answer.grade == Grade::Right).count()
    }

    fn words(&self) -> String {
        let of = |answer: &&Answer| match (answer.grade, answer.code) {
            (Grade::Right, _) => format!("{} right", answer.method.label()),
            (grade, None) => format!("{} {grade}", answer.method.label()),
            (grade, Some(code)) => format!("{} {grade}, {code}", answer.method.label()),
        };
        let words: Vec<String> = self.answers.iter().map(of).collect();
        format!("{}: {}", self.name, words.join("; "))
    }
}

pub(super) fn page(
    scene: &dyn Scene,
    request: &SurveyRequest,
    radius_m: f64,
    methods: &[Surveyed],
    answers: &[Answer],
    places: &[Place<'_>],
) -> String {
    let size = SceneSize::of(scene);
    let unit = size.scale.unit();
    let photos = photos(scene, answers, Part::Near);
    let title = format!("survey of {}", scene.name());
    let in_unit = |table: Table| table.in_words_of(unit);
    let body = html! {
        header {
            h1 { (title) }
            p.headline { (headline(methods, radius_m, unit)) }
        }
        main {
            section aria-labelledby="where" {
                h2 id="where" { "Where photos are localised" }
                p { "Each dot is a photo of the map, localised from a reference within " (unit.words(&format!("{radius_m} m")))
                    ", seen from above. Rest the pointer on it for the methods." }
                @if let Some(chart) = route(&photos, scene) {
                    figure.plot style="max-width:48rem" {
                        (chart.in_words_of(unit).svg(None)) figcaption { "The map from above" }
                    }
                }
                (further(&photos, radius_m, unit))
            }
            @if let Some(chart) = places::chart(places, scene) {
                section aria-labelledby="places" {
                    h2 id="places" { "Where photos will be localised" }
                    p { "Each dot is a frame of the map, as if it were a photo that is searched from another one, "
                        (unit.words(&places::from_where(request.spacing_m, radius_m))) ". How likely that succeeds follows from the photos above: how far \
                         their references were away and turned, and what became of those nearby. Rest the pointer on it \
                         for the methods; " code { (super::PLACES) } " has the numbers." }
                    figure.plot style="max-width:48rem" {
                        (chart.in_words_of(unit).svg(None)) figcaption { "The map from above" }
                    }
                    (table(&places::summary(places)))
                }
            }
            section aria-labelledby="methods" {
                h2 id="methods" { "Each method" }
                (table(&in_unit(found(methods, answers))))
            }
            section aria-labelledby="why" {
                h2 id="why" { "Why not elsewhere" }
                @let causes = causes(answers);
                @if causes.rows.is_empty() {
                    p { "Each method localises every photo that is near a reference." }
                } @else { (table(&causes)) }
            }
            section aria-labelledby="trust" {
                h2 id="trust" { "How far to trust a pose here" }
                p { "Probabilities are fitted on generated towns. The survey moves them so that they hold in this map. \
                     Here, every photo is judged by the numbers of the other half of the photos. Runs use the numbers of \
                     all photos." }
                (table(&trust(methods)))
                div.plots {
                    @for one in methods {
                        figure.plot { (reliability(one).svg(None)) figcaption { (one.method.label()) } }
                    }
                }
            }
            section aria-labelledby="limits" {
                h2 id="limits" { "What a survey cannot know" }
                ul {
                    li { "Its photos are the map's own. Another day, another camera and people in the way are not in them. \
                          --degrade shows what worse light does." }
                    li { "Right means near the pose that the map states. Where the map's poses are off, they are off here too." }
                    li { "Photos far from their reference and mirrored ones stand for queries that do not show the place: "
                         (count(answers, Part::Far)) " and " (count(answers, Part::Mirrored)) " of them." }
                }
            }
            section aria-labelledby="asked" {
                h2 id="asked" { "What was run" }
                dl {
                    dt { "scene" } dd { (request.scene) }
                    dt { "radius" } dd { (unit.words(&format!("{radius_m} m"))) }
                    @if let Some(spacing) = request.spacing_m { dt { "spacing" } dd { (unit.words(&format!("{spacing} m"))) } }
                    @if !request.degrade.is_none() { dt { "degrade" } dd { (request.degrade) } }
                    dt { "seed" } dd { (request.seed) }
                    dt { "version" } dd { "posescope " (env!("CARGO_PKG_VERSION")) }
                }
                p { "The folders near, far, mirrored and worse are runs: posescope view FOLDER shows every photo." }
            }
        }
    };
    document(&title, "", &body)
}

fn count(answers: &[Answer], part: Part) -> usize {
    let first = answers.first().map(|answer| answer.method);
    answers.iter().filter(|answer| answer.part == part && Some(answer.method) == first).count()
}

/// What the map can do, in one sentence.
fn headline(methods: &[Surveyed], radius_m: f64, unit: LengthUnit) -> String {
    let best = methods.iter().max_by_key(|one| one.near.1);
    best.map_or(String::new(), |one| {
        let (photos, right) = one.near;
        let reach = unit.words(&format!("{radius_m} m"));
        format!(
            "{} localises {right} of {photos} photos of this map from a reference within {reach}",
            one.method.label()
        )
    })
}

/// The photos of a part, in the order of the scene.
fn photos<'a>(scene: &'a dyn Scene, answers: &'a [Answer], part: Part) -> Vec<Photo<'a>> {
    let mut by_frame: BTreeMap<usize, Vec<&Answer>> = BTreeMap::new();
    for answer in answers.iter().filter(|answer| answer.part == part) {
        if let Ok(frame) = scene.find(&answer.query) {
            by_frame.entry(frame).or_default().push(answer);
        }
    }
    let poses: Vec<Pose> = by_frame.keys().filter_map(|&frame| scene.pose(frame)).collect();
    let mut places = from_above(&poses).unwrap_or_default().into_iter();
    by_frame
        .into_iter()
        .map(|(frame, answers)| Photo {
            name: &scene.frames()[frame],
            at: scene.pose(frame).and_then(|_| places.next()),
            answers,
        })
        .collect()
}

/// The map from above. `None` for fewer than two photos.
fn route(photos: &[Photo<'_>], scene: &dyn Scene) -> Option<Chart> {
    let placed: Vec<(&Photo<'_>, Point2<f64>)> =
        photos.iter().filter_map(|photo| Some((photo, photo.at?))).collect();
    let axes = GroundAxes::of(&placed.iter().map(|(_, at)| *at).collect::<Vec<_>>())?;
    let methods = photos.iter().map(|photo| photo.answers.len()).max()?;
    let color = |right: usize| -> (Rgb, bool) {
        match right {
            0 => (palette::ESTIMATE, true),
            right if right < methods => (palette::TRUTH, false),
            _ => (palette::TRUTH, true),
        }
    };
    let marks = placed.iter().map(|(photo, at)| {
        let (color, filled) = color(photo.right());
        Mark::new(Shape::Dot { at: axes.place(at), filled }, color).titled(photo.words())
    });
    let legend = [
        ("all methods", palette::TRUTH),
        ("some (hollow)", palette::TRUTH),
        ("none", palette::ESTIMATE),
    ];
    Some(Chart {
        title: format!("Photos of {} that are localised", scene.name()),
        marks: marks.collect(),
        x: axes.x,
        y: axes.y,
        legend: legend.map(|(name, color)| (name.to_owned(), color)).to_vec(),
    })
}

/// Where a further reference would help most: places with several photos that no method localises.
fn further(photos: &[Photo<'_>], radius_m: f64, unit: LengthUnit) -> Markup {
    let places = places_to_mend(photos, 0.5 * radius_m);
    let reach = unit.words(&format!("{} m", 0.5 * radius_m));
    let lost = photos.iter().filter(|photo| photo.right() == 0).count();
    html! {
        @if lost == 0 {
            p { "Every photo is localised by a method." }
        } @else if places.is_empty() {
            p { (lost) " of " (photos.len()) " photos are localised by no method, and no two of them lie within " (reach) " of each other." }
        } @else {
            p { "A further reference would help most here:" }
            ul {
                @for (name, lost, all) in &places {
                    li { "near frame " code { (name) } ": " (lost) " of " (all) " photos within " (reach) " are localised by no method" }
                }
            }
        }
    }
}

/// Places with several photos that no method localises, the worst first: the frame in the middle, how many, and how
/// many photos there are in all.
fn places_to_mend<'a>(photos: &[Photo<'a>], reach_m: f64) -> Vec<(&'a str, usize, usize)> {
    const MOST: usize = 5;
    let mut lost: Vec<(&str, Point2<f64>)> = photos
        .iter()
        .filter(|photo| photo.right() == 0)
        .filter_map(|photo| Some((photo.name, photo.at?)))
        .collect();
    let is_near = |a: &Point2<f64>, b: &Point2<f64>| (a - b).norm() <= reach_m;
    let mut found = Vec::new();
    while found.len() < MOST {
        let around = |at: &Point2<f64>| lost.iter().filter(|(_, other)| is_near(at, other)).count();
        let counted = lost.iter().map(|(name, at)| (*name, *at, around(at)));
        // The first of equally bad places.
        let worst = counted.fold(None, |worst: Option<(&str, Point2<f64>, usize)>, one| {
            worst.filter(|known| known.2 >= one.2).or(Some(one))
        });
        let Some((name, at, count)) = worst.filter(|worst| worst.2 > 1) else {
            break;
        };
        let all = photos.iter().filter_map(|photo| photo.at).filter(|other| is_near(&at, other));
        found.push((name, count, all.count()));
        lost.retain(|(_, other)| !is_near(&at, other));
    }
    found
}

fn percent(part: usize, all: usize) -> String {
    if all == 0 { "–".to_owned() } else { format!("{:.0} %", 100.0 * part as f64 / all as f64) }
}

/// What each method finds, by part.
fn found(methods: &[Surveyed], answers: &[Answer]) -> Table {
    let header = ["method", "part", "photos", "right", "wrong", "no pose", "median error (m)"];
    let mut rows = Table::new("methods", "Photos by what became of them", header);
    rows.align[1] = crate::table::Align::Left;
    rows.shared = 1;
    for one in methods {
        for part in [Part::Near, Part::Worse, Part::Far, Part::Mirrored] {
            let own = || {
                answers.iter().filter(|answer| answer.method == one.method && answer.part == part)
            };
            let of = |grade: Grade| own().filter(|answer| answer.grade == grade).count();
            let all = own().count();
            if all == 0 {
                continue;
            }
            let mut errors: Vec<f64> = own()
                .filter(|answer| answer.grade == Grade::Right)
                .filter_map(|answer| answer.error_m)
                .collect();
            errors.sort_by(f64::total_cmp);
            let median = errors.get(errors.len() / 2);
            rows.push([
                one.method.label(),
                part.name().to_owned(),
                all.to_string(),
                of(Grade::Right).to_string(),
                of(Grade::Wrong).to_string(),
                of(Grade::NoPose).to_string(),
                median.map_or("–".to_owned(), |error| format!("{error:.3}")),
            ]);
        }
    }
    rows
}

/// The causes of failures near a reference, the most frequent first.
fn causes(answers: &[Answer]) -> Table {
    let header = ["method", "photos", "start (m)", "cause"];
    let mut rows = Table::new("causes", "Photos near a reference that have no right pose", header);
    rows.align[3] = crate::table::Align::Note;
    let mut by_cause: BTreeMap<(usize, Option<Code>), Vec<&Answer>> = BTreeMap::new();
    let near = answers.iter().filter(|answer| answer.part == Part::Near);
    let mut methods = Vec::new();
    for answer in near.filter(|answer| answer.grade.is_failure()) {
        let place = methods.iter().position(|method| *method == answer.method);
        let place = place.unwrap_or_else(|| {
            methods.push(answer.method);
            methods.len() - 1
        });
        by_cause.entry((place, answer.code)).or_default().push(answer);
    }
    let mut causes: Vec<_> = by_cause.into_iter().collect();
    causes.sort_by_key(|((method, code), of)| (*method, std::cmp::Reverse(of.len()), *code));
    for ((method, code), of) in causes {
        let mut starts: Vec<f64> = of.iter().filter_map(|answer| answer.start_m).collect();
        starts.sort_by(f64::total_cmp);
        let start = starts.get(starts.len() / 2);
        let words = code.map_or("not known".to_owned(), |code| format!("{code} {}", code.title()));
        rows.push([
            methods[method].label(),
            of.len().to_string(),
            start.map_or("–".to_owned(), |start| format!("{start:.1}")),
            words,
        ]);
    }
    rows
}

/// How well confidence says what is true, before and with the survey.
fn trust(methods: &[Surveyed]) -> Table {
    let header = [
        "method",
        "right",
        "wrong",
        "right and trusted, as fitted",
        "wrong and trusted",
        "right and trusted, with survey",
        "wrong and trusted",
        "interval of position",
        "of rotation",
    ];
    let mut rows = Table::new("trust", "Poses, and how many of them are trusted", header);
    for one in methods {
        let (before, after) = (one.before(), one.after());
        let factor =
            |of: Option<f64>| of.map_or("–".to_owned(), |factor| format!("× {factor:.2}"));
        rows.push([
            one.method.label(),
            before.right.to_string(),
            before.wrong.to_string(),
            percent(before.right_trusted, before.right),
            percent(before.wrong_trusted, before.wrong),
            percent(after.right_trusted, after.right),
            percent(after.wrong_trusted, after.wrong),
            factor(one.numbers.map(|numbers| numbers.position)),
            factor(one.numbers.map(|numbers| numbers.rotation)),
        ]);
    }
    rows
}

/// How many poses of a probability are right, before the survey and with it, each with its 90 % interval.
fn reliability(one: &Surveyed) -> Chart {
    let diagonal = Mark::new(Shape::Line(vec![(0.0, 0.0), (100.0, 100.0)]), palette::NO_POSE);
    let mut marks = vec![diagonal];
    let kinds = [
        ("as fitted", one.as_fitted(), palette::UNDECIDED),
        ("with survey", one.by_halves(), palette::REFERENCE),
    ];
    for (name, poses, color) in &kinds {
        for (at, ends) in GROUPS.windows(2).enumerate() {
            let is_last = at + 2 == GROUPS.len();
            let is_in = |p: f64| p >= ends[0] && (p < ends[1] || is_last);
            let group: Vec<_> = poses.iter().filter(|(p, _)| is_in(*p)).collect();
            if group.is_empty() {
                continue;
            }
            let count = group.len() as f64;
            let said = group.iter().map(|(p, _)| p).sum::<f64>() / count;
            let right = group.iter().filter(|(_, is_right)| *is_right).count();
            let share = right as f64 / count;
            let (low, high) = interval(share, count);
            let x = 100.0 * said;
            let bar = vec![(x, 100.0 * low), (x, 100.0 * high)];
            let words = format!("{name}: {right} of {} right, {x:.0} % stated", group.len());
            marks.push(Mark::new(Shape::Line(bar), *color).titled(words.clone()));
            let dot = Shape::Dot { at: (x, 100.0 * share), filled: true };
            marks.push(Mark::new(dot, *color).titled(words));
        }
    }
    Chart {
        title: format!(
            "How many poses of {} are right, over the stated probability",
            one.method.label()
        ),
        x: Axis::percent("stated probability (%)"),
        y: Axis::percent("poses that are right (%)"),
        marks,
        legend: kinds.into_iter().map(|(name, _, color)| (name.to_owned(), color)).collect(),
    }
}

/// The 90 % interval of a share that was seen in so many cases (Wilson 1927).
fn interval(share: f64, count: f64) -> (f64, f64) {
    const Z: f64 = 1.645;
    let wide = 1.0 + Z * Z / count;
    let middle = (share + Z * Z / (2.0 * count)) / wide;
    let half = Z / wide * (share * (1.0 - share) / count + Z * Z / (4.0 * count * count)).sqrt();
    ((middle - half).max(0.0), (middle + half).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::Method;

    fn answer(query: &str, grade: Grade) -> Answer {
        Answer {
            part: Part::Near,
            method: Method::FB,
            query: query.to_owned(),
            grade,
            error_m: None,
            start_m: None,
            code: None,
            judged: None,
            tried: None,
        }
    }

    #[test]
    fn a_further_reference_helps_most_where_most_photos_are_lost() {
        let answers: Vec<Answer> = (0..20)
            .map(|at| {
                // Photos 4 to 7 and 15 to 16 are lost, and 11 alone.
                let is_lost = (4..8).contains(&at) || (15..17).contains(&at) || at == 11;
                answer(&at.to_string(), if is_lost { Grade::NoPose } else { Grade::Right })
            })
            .collect();
        let photo = |(at, answer): (usize, &'static Answer)| Photo {
            name: &answer.query,
            at: Some(Point2::new(0.0, at as f64)),
            answers: vec![answer],
        };
        let answers: &'static [Answer] = answers.leak();
        let photos: Vec<Photo<'static>> = answers.iter().enumerate().map(photo).collect();
        // Around photo 5, four of those within two metres are lost: 4, 5, 6 and 7 of 3 to 7.
        assert_eq!(places_to_mend(&photos, 2.0), [("5", 4, 5), ("15", 2, 5)]);
        assert_eq!(places_to_mend(&photos[8..12], 2.0), []);
    }

    #[test]
    fn a_share_that_was_seen_often_is_known_well() {
        assert_eq!(interval(1.0, 10.0).1, 1.0);
        let (few, many) = (interval(0.5, 10.0), interval(0.5, 1000.0));
        assert!(few.0 < many.0 && many.1 < few.1, "{few:?} {many:?}");
        // Of a coin thrown a thousand times, 47.4 to 52.6 % are heads in 90 % of cases.
        assert!((many.0 - 0.474).abs() < 1e-3 && (many.1 - 0.526).abs() < 1e-3, "{many:?}");
    }
}
