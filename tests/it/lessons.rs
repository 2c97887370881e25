//! Lessons: their claims, and the way through each of them.

use egui::{Key, Modifiers};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use posescope::app::{App, Setup, ViewName};
use posescope::diagnosis::Code;
use posescope::lesson::{Answer, Lesson, Moment, Results};
use posescope::localize::{NoObserver, QueryResult};
use posescope::measure::Field;
use posescope::session::{RunMode, RunState};
use posescope::sink::rerun::entities;
use rerun::TextDocument;

use crate::binary::{has, refused, run_in, write};
use crate::recording::chunks;
use crate::window::{app, finish, is_said, press, run_until_idle, send};

/// A lesson on the small world, whose frames cost nothing.
const SMALL: &str = r#"+++
title = "A small lesson"
about = "everything that a lesson can do"
minutes = 1
[setting]
scene = "walls"
query = "1"
method = ["fb", "mi"]
+++

## The beginning

```page
at = "after fb.match"
show = ["images", "surface"]
[question]
ask = "Which is it?"
choices = ["the one", "the other"]
right = 2
because = "It was said in the beginning, of {fb.unique} matches."
reveal = "after fb"
```

These words are read first. FB has {fb.keypoints} keypoints.

## The map

```page
at = "mi.position_coarse"
show = ["surface"]
[question]
ask = "Where is it?"
place = "mi"
because = "There it is."
reveal = "after mi"
```

## The end

```page
at = "end"
show = ["lockstep"]
lockstep = 3
```
"#;

fn small(setup: Setup) -> Harness<'static, App> {
    let lesson = Lesson::parse("small", SMALL).expect("a lesson");
    let mut window = Harness::builder()
        .with_size([1500.0, 950.0])
        .build_eframe(|creation| App::new(creation, setup).with_lesson(lesson));
    run_until_idle(&mut window);
    window.run_steps(3);
    window
}

fn walls() -> Setup {
    let mut setup = crate::window::setup();
    setup.mode = posescope::session::RunMode::Running;
    setup.task.protocol.methods = ["fb", "mi"].map(|name| name.parse().expect("a method")).to_vec();
    setup
}

#[test]
fn a_question_is_answered_before_anything_of_the_answer_is_shown() {
    let mut window = small(walls());
    assert!(is_said(&window, "The beginning") && is_said(&window, "These words are read first"));
    let moment: Moment = "after fb.match".parse().expect("a moment");
    let at = |window: &Harness<'_, App>| app(window).cursor();
    let found = moment.find(app(&window).run());
    assert_eq!(Some(at(&window)), found);
    assert!(!is_said(&window, "● right"), "The page gives the answer away");
    assert!(!is_said(&window, "It was said in the beginning"));
    assert!(!app(&window).options.shows_truth);

    press(&mut window, Modifiers::NONE, Key::Num1);
    window.run_steps(2);
    assert!(is_said(&window, "the one  ▲ wrong") && is_said(&window, "the other  ● right"));
    assert!(is_said(&window, "It was said in the beginning"));
    let moment: Moment = "after fb".parse().expect("a moment");
    assert_eq!(Some(at(&window)), moment.find(app(&window).run()));

    // Pages are turned by keys, to the ends and no further.
    press(&mut window, Modifiers::NONE, Key::PageUp);
    assert!(is_said(&window, "The beginning"));
    press(&mut window, Modifiers::NONE, Key::PageDown);
    assert!(is_said(&window, "The map"));
}

#[test]
fn numbers_of_a_page_are_those_of_the_run_that_is_shown() {
    let number = |window: &Harness<'_, App>, field: &str| {
        let result = app(window).run().results().next().expect("FB's").clone();
        Field::find(field).expect("a field").spoken(&result, false)
    };
    let mut window = small(Setup { mode: RunMode::Paused, ..walls() });
    assert!(is_said(&window, "FB has … keypoints."));
    press(&mut window, Modifiers::NONE, Key::Space);
    finish(&mut window);
    window.run_steps(2);
    let all = number(&window, "keypoints");
    assert!(is_said(&window, &format!("FB has {all} keypoints.")), "{all}");
    press(&mut window, Modifiers::NONE, Key::Num1);
    let unique = number(&window, "unique");
    assert!(is_said(&window, &format!("of {unique} matches.")), "{unique}");

    // They follow the parameters.
    send(&mut window, |app| app.app_state_mut().set_param("surf.max_keypoints", "20"));
    finish(&mut window);
    window.run_steps(2);
    let fewer = number(&window, "keypoints");
    assert_ne!(fewer, all);
    assert!(is_said(&window, &format!("FB has {fewer} keypoints.")), "{fewer}");
}

#[test]
fn only_the_beginning_of_a_method_is_captioned_as_its_beginning() {
    let mut window = small(walls());
    let ends: Vec<usize> =
        app(&window).run().spans().iter().map(|span| span.records.end - 1).collect();
    let starts: Vec<usize> =
        app(&window).run().spans().iter().map(|span| span.records.start).collect();
    for (places, is_beginning) in [(starts, true), (ends, false)] {
        assert!(!places.is_empty());
        for place in places {
            send(&mut window, move |app| app.app_state_mut().move_cursor(place));
            let is_so = is_said(&window, "The method begins with two photos");
            assert_eq!(is_so, is_beginning, "at {place}");
        }
    }
}

#[test]
fn a_place_is_guessed_on_the_empty_map_and_measured_afterwards() {
    let mut window = small(walls());
    press(&mut window, Modifiers::NONE, Key::PageDown);
    window.run_steps(3);
    assert!(is_said(&window, "Nothing is chosen yet"));
    // No cell has a cost, and there is a map to click at.
    assert!(is_said(&window, "position, coarse, 0 of"));
    let map = window.get_by_label_contains("Cost map").rect();
    let ahead = map.min + map.size() * egui::vec2(0.5, 0.3);
    window.hover_at(ahead);
    window.run_steps(2);
    window.drag_at(ahead);
    window.drop_at(ahead);
    window.run_steps(3);
    assert!(is_said(&window, "m ahead of the reference"));
    assert!(!is_said(&window, "MI puts it"));
    press(&mut window, Modifiers::NONE, Key::Enter);
    window.run_steps(3);
    assert!(is_said(&window, "MI puts it") && is_said(&window, "There it is."));

    press(&mut window, Modifiers::NONE, Key::PageDown);
    window.run_steps(2);
    let options = &app(&window).options;
    assert_eq!(options.lockstep, Some(3));
    press(&mut window, Modifiers::NONE, Key::Period);
    assert_eq!(app(&window).options.lockstep, Some(4));
    assert!(!is_said(&window, "● right"), "no method is done at its fourth step");
    send(&mut window, |app| {
        app.app_state_mut().options.lockstep = Some(usize::MAX - 1);
    });
    assert_eq!(window.query_all_by_label_contains("● right").count(), 2, "a panel each");

    window.get_by_label("Close the lesson").click();
    window.run_steps(3);
    assert!(!is_said(&window, "A small lesson"));
    press(&mut window, Modifiers::NONE, Key::PageDown);
    assert!(is_said(&window, "No lesson is open"));
}

/// Goes through a lesson to its end, answering by keys, and hands out the results of each variant.
fn go_through(lesson: &Lesson) -> Vec<(String, Vec<QueryResult>)> {
    let first = lesson.setting(&lesson.pages[0].variant);
    let open = first.open(&|_| None).expect("a setting");
    let setup = Setup::of_lesson(open, std::env::temp_dir());
    let mut window = Harness::builder()
        .with_size([1500.0, 950.0])
        .build_eframe(|creation| App::new(creation, setup).with_lesson(lesson.clone()));
    let mut results: Vec<(String, Vec<QueryResult>)> = Vec::new();
    let mut known = Results::new();
    for page in &lesson.pages {
        assert_eq!(run_until_idle(&mut window), RunState::Finished, "{}", page.title);
        window.run_steps(3);
        assert!(is_said(&window, &page.title), "{}", page.title);
        let state = app(&window);
        let shown: Vec<QueryResult> = state.run().results().cloned().collect();
        known.insert(page.variant.clone(), shown.clone());
        let (page, missing) = page.filled(&known);
        assert!(missing.is_empty(), "{}: no number for {missing:?}", page.title);
        if results.last().is_none_or(|(variant, _)| *variant != page.variant) {
            results.push((page.variant.clone(), shown));
        }
        check_moment(&window, &page.at, &page.title);
        if let Some(question) = &page.question {
            let reason: String = question.because.chars().take(20).collect();
            assert!(!is_said(&window, &reason), "{}: told before it is asked", page.title);
            match &question.answer {
                Answer::Choice { right, .. } => {
                    let keys = [Key::Num1, Key::Num2, Key::Num3, Key::Num4];
                    press(&mut window, Modifiers::NONE, keys[*right]);
                }
                Answer::Place(_) => {
                    press(&mut window, Modifiers::ALT, Key::ArrowUp);
                    press(&mut window, Modifiers::NONE, Key::Enter);
                }
            }
            window.run_steps(2);
            assert!(is_said(&window, &reason), "{}: {reason}", page.title);
            check_moment(&window, &question.reveal, &page.title);
        }
        press(&mut window, Modifiers::NONE, Key::PageDown);
    }
    results
}

fn check_moment(window: &Harness<'_, App>, moment: &Moment, title: &str) {
    let state = app(window);
    let place = match moment {
        Moment::End => state.run().len() - 1,
        moment => moment.find(state.run()).unwrap_or_else(|| panic!("{title}: no {moment}")),
    };
    assert_eq!(state.cursor(), place, "{title}: {moment}");
}

/// The lesson that every change is held to.
const ONE: &str = "four-points";

#[test]
fn every_lesson_shows_views_that_there_are() {
    for lesson in Lesson::all().expect("our own") {
        for view in lesson.pages.iter().flat_map(|page| &page.show) {
            assert!(ViewName::find(view).is_some(), "{}: {view}", lesson.name);
        }
    }
}

#[test]
fn a_lesson_is_gone_through_to_its_end_and_its_claims_hold() {
    claims_hold(|lesson| lesson.name == ONE);
}

#[test]
#[ignore = "takes half a minute; .ci/nightly runs it"]
fn every_lesson_is_gone_through_to_its_end_and_its_claims_hold() {
    claims_hold(|lesson| lesson.name != ONE);
}

fn claims_hold(is_meant: impl Fn(&Lesson) -> bool) {
    let lessons = Lesson::all().expect("our own").into_iter();
    let mut untrue = Vec::new();
    for lesson in lessons.filter(is_meant) {
        let mut results = go_through(&lesson);
        // What no page shows is run for its claims alone.
        for (variant, setting) in &lesson.variants {
            if !results.iter().any(|(shown, _)| shown == variant) {
                let job = setting.open(&|_| None).expect("a setting");
                let told = job.work(0, &mut NoObserver, |_| {}).expect("results");
                results.push((variant.clone(), told));
            }
        }
        for claim in &lesson.claims {
            let of_variant = results.iter().filter(|(variant, _)| *variant == claim.variant);
            let is_met = of_variant
                .flat_map(|(_, results)| results)
                .any(|result| claim.holds.is_met(result));
            let (name, variant) = (&lesson.name, &claim.variant);
            if !is_met {
                untrue.push(format!("{name}, {variant}: no result with {}", claim.holds.text()));
            }
        }
    }
    assert!(untrue.is_empty(), "{untrue:#?}");
}

#[test]
fn lessons_are_listed_and_recorded() {
    let folder = tempfile::tempdir().expect("a folder");
    let listed = run_in(folder.path(), "lesson").ok().out;
    for lesson in Lesson::all().expect("our own") {
        has(&listed, &format!("{} ~ {}", lesson.name, lesson.title));
    }
    let broken = "+++\ntitle = \"a\"\nabot = \"b\"\n+++\n";
    write(folder.path().join("broken.md"), broken);
    let setting =
        "[setting]\nscene = \"street\"\nquery = \"70\"\nreference = [\"62\"]\nmethod = [\"fb\"]";
    let unfilled = format!(
        "+++\ntitle = \"a\"\nabout = \"b\"\nminutes = 1\n{setting}\n+++\n\n## One\n\n{{fb.cost}}\n"
    );
    write(folder.path().join("unfilled.md"), &unfilled);
    let table = "
        2 | lesson nonsense | four-points
        3 | lesson broken.md | line 3
        3 | lesson unfilled.md --save a.rrd | no result has a number for {fb.cost}
    ";
    refused(folder.path(), table);
}

/// Numbers that stand in the words of a lesson by hand, with the reason: none of them comes from a run.
const BY_HAND: &[(&str, &str, &str)] = &[
    ("four-points", "64 numbers", "the length of a descriptor of SURF"),
    ("four-points", "*P3P*", "a name"),
    ("pixels-to-cost", "1 less the normalised", "a definition"),
    ("lock-step", "by fifty", "what the key does"),
    ("light", "gamma of 0.4", "the setting"),
    ("light", "key 3", "a key"),
    ("grid", "within 15 m", "the radius by default"),
    ("grid", "steps of 1 m", "the step by default"),
    ("grid", "steps are 4 m", "the setting"),
    ("grid", "disc is 30 m", "the setting"),
    ("grid", "(rows − 1)(columns − 1) / 2N", "a formula"),
    ("distance", "Fifteen metres", "the name of the variant"),
    ("distance", "Twenty metres", "the name of the variant"),
    ("distance", "Twenty-five metres", "the name of the variant"),
    ("references", "000072", "the name of a reference of the setting"),
    ("references", "000059 and 000060", "the names of references of the setting"),
    ("lost", "only to 25 m", "the setting"),
    ("reading-a-failure", "the twenty", "mi.finalists by default"),
];

/// Words for numbers that are too large to be a count of what the words themselves list.
const NUMBER_WORDS: &str = "eleven twelve thirteen fourteen fifteen sixteen seventeen eighteen nineteen twenty thirty \
    forty fifty sixty seventy eighty ninety hundred thousand million";

/// The numbers in a text that stand neither in placeholders nor in code.
fn numbers_by_hand(text: &str) -> Vec<String> {
    let without = |text: &str, open: char, close: char| {
        let (mut kept, mut rest) = (String::new(), text);
        while let Some((before, after)) = rest.split_once(open) {
            kept += before;
            rest = after.split_once(close).map_or("", |(_, after)| after);
        }
        kept + rest
    };
    let text = without(&without(text, '`', '`'), '{', '}');
    let is_number = |word: &str| {
        let word = word.to_lowercase();
        word.contains(|c: char| c.is_ascii_digit())
            || NUMBER_WORDS.split_whitespace().any(|number| number == word)
    };
    let words = text.split(|c: char| !c.is_alphanumeric()).filter(|word| is_number(word));
    let words = words.filter(|word| word.parse::<Code>().is_err());
    words.map(str::to_owned).collect()
}

/// All that a lesson says on its pages.
fn texts_of(lesson: &Lesson) -> Vec<String> {
    let mut texts = Vec::new();
    for page in &lesson.pages {
        let lines: Vec<&str> = page.text.lines().map(without_mark).collect();
        texts.extend([page.title.clone(), lines.join(" ")]);
        let Some(question) = &page.question else { continue };
        texts.extend([question.ask.clone(), question.because.clone()]);
        if let Answer::Choice { choices, .. } = &question.answer {
            texts.extend(choices.clone());
        }
    }
    texts
}

#[test]
fn lessons_name_nothing_by_its_place_or_by_what_a_lecture_does_not_show() {
    for lesson in Lesson::all().expect("our own") {
        for text in texts_of(&lesson) {
            // The views stand elsewhere in another window, and a lecture has no card.
            for words in ["card", "lower view", "upper view", "view above", "view below"] {
                assert!(!text.contains(words), "{}: {words} in: {text}", lesson.name);
            }
        }
    }
}

/// A line without the number that makes it an item of a list.
fn without_mark(line: &str) -> &str {
    match line.split_once(". ") {
        Some((mark, words)) if mark.parse::<u32>().is_ok() => words,
        _ => line,
    }
}

#[test]
fn no_measured_number_stands_in_a_lesson_by_hand() {
    assert_eq!(numbers_by_hand("345 of {fb.unique}, `--set a=4`, D3, fifteen"), ["345", "fifteen"]);
    let mut unused: Vec<(&str, &str)> = BY_HAND.iter().map(|one| (one.0, one.1)).collect();
    for lesson in Lesson::all().expect("our own") {
        for mut text in texts_of(&lesson) {
            for &(name, phrase, _) in BY_HAND {
                if name == lesson.name && text.contains(phrase) {
                    text = text.replace(phrase, "");
                    unused.retain(|one| *one != (name, phrase));
                }
            }
            let found = numbers_by_hand(&text);
            assert!(found.is_empty(), "{}: {found:?} stand by hand in: {text}", lesson.name);
        }
    }
    assert!(unused.is_empty(), "no lesson says {unused:?}");
}

/// The pages of a recording with their places on the timeline of decisions.
fn recorded_pages(path: &std::path::Path) -> Vec<(i64, String)> {
    let chunks = chunks(path);
    let mut pages = Vec::new();
    for chunk in chunks.iter().filter(|chunk| chunk.entity_path().to_string() == "/lesson") {
        let steps = chunk.timelines().iter().find_map(|(name, column)| {
            (name.as_str() == entities::STEP_TIMELINE).then(|| column.times_raw().to_vec())
        });
        let component = TextDocument::descriptor_text().component;
        let texts = chunk.iter_slices::<String>(component);
        for (step, text) in steps.expect("steps").into_iter().zip(texts) {
            pages.push((step, text[0].to_string()));
        }
    }
    pages.sort();
    pages
}

#[test]
fn a_recorded_lesson_turns_its_pages_in_order_and_answers_after_it_has_asked() {
    turn_their_pages(|lesson| lesson.name == ONE);
}

#[test]
#[ignore = "takes half a minute; .ci/nightly runs it"]
fn every_recorded_lesson_turns_its_pages_in_order() {
    turn_their_pages(|lesson| lesson.name != ONE);
}

fn turn_their_pages(is_meant: impl Fn(&Lesson) -> bool) {
    let folder = tempfile::tempdir().expect("a folder");
    let lessons = Lesson::all().expect("our own").into_iter();
    for lesson in lessons.filter(is_meant) {
        run_in(folder.path(), &format!("lesson {} --save a.rrd", lesson.name)).ok();
        let path = folder.path().join("a.rrd");
        let recorded = recorded_pages(&path);
        let all = lesson.pages.len();
        let wanted: Vec<String> = (lesson.pages.iter().enumerate())
            .flat_map(|(index, page)| {
                [Some(page.markdown(index + 1, all)), page.answered(index + 1, all)]
            })
            .flatten()
            .collect();
        let (steps, texts): (Vec<i64>, Vec<String>) = recorded.into_iter().unzip();
        assert_eq!(texts.len(), wanted.len(), "{}", lesson.name);
        for (text, wanted) in texts.iter().zip(&wanted) {
            assert!(is_filled(text, wanted), "{}: {text}\nis not\n{wanted}", lesson.name);
        }
        let mut distinct = steps.clone();
        distinct.dedup();
        assert_eq!(distinct, steps, "{}: two pages at one step", lesson.name);
        std::fs::remove_file(&path).expect("ours");
    }
}

/// Whether a text is another whose placeholders have become numbers.
fn is_filled(text: &str, template: &str) -> bool {
    let mut pieces = template.split('{');
    let mut rest = text.strip_prefix(pieces.next().unwrap_or_default());
    for piece in pieces {
        let words = piece.split_once('}').map_or("", |(_, words)| words);
        let end = if words.is_empty() {
            rest.map(str::len)
        } else {
            rest.and_then(|rest| rest.find(words))
        };
        rest =
            rest.zip(end).filter(|(_, end)| *end > 0).map(|(rest, end)| &rest[end + words.len()..]);
    }
    rest == Some("") && !text.contains('…')
}
