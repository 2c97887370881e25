//! The run at a glance: one sentence, a bar for each method, and the causes by their frequency.

use maud::{Markup, html};

use super::words::{capital, class_of};
use crate::diagnosis::Grade;
use crate::measure::{Bar, Overview};
use crate::opinion::Standing;

/// One bar for each method, with the count in each part.
pub(super) fn methods(overview: &Overview) -> Markup {
    let occurs = |grade: &Grade| overview.bars.iter().any(|bar| bar.count(*grade) > 0);
    html! {
        section aria-labelledby="methods" {
            h2 id="methods" { "Results of each method" }
            @for one in &overview.bars { (bar(one)) }
            p.legend {
                @for grade in Grade::ALL.into_iter().filter(occurs) {
                    span { i class={ "part " (class_of(grade)) } {} " " (grade) } " "
                }
            }
            @if overview.bars.iter().any(has_opinions) {
                h2 { "Second opinions on other systems" }
                @for one in overview.bars.iter().filter(|bar| has_opinions(bar)) {
                    (parts(&one.name, &opinions(one)))
                }
            }
        }
    }
}

fn bar(bar: &Bar) -> Markup {
    let counts = Grade::ALL.map(|grade| (grade.word(), class_of(grade), bar.count(grade)));
    parts(&bar.name, &counts)
}

fn has_opinions(bar: &Bar) -> bool {
    bar.opinions.iter().any(|count| *count > 0)
}

/// The second opinions in the colours of what they stand for.
fn opinions(bar: &Bar) -> [Part; 3] {
    let [confirmed, undecided, contradicted] = bar.opinions;
    [
        (Standing::Confirmed.word(), class_of(Grade::Right), confirmed),
        (Standing::Contradicted.word(), class_of(Grade::Wrong), contradicted),
        (Standing::Undecided.word(), class_of(Grade::Unmeasured), undecided),
    ]
}

/// A part of a bar: what it is, its CSS class, and the count.
type Part = (&'static str, &'static str, usize);

fn parts(name: &str, parts: &[Part]) -> Markup {
    let parts: Vec<&Part> = parts.iter().filter(|(_, _, count)| *count > 0).collect();
    let words: Vec<String> =
        parts.iter().map(|(what, _, count)| format!("{count} {what}")).collect();
    let spoken = format!("{name}: {}", words.join(", "));
    html! {
        div.bar {
            span.name { (name) }
            div.parts role="img" aria-label=(spoken) title=(spoken) {
                @for (what, class, count) in &parts {
                    span class={ "part " (class) } style={ "flex-grow:" (count) } {
                        b { (count) } " " (what)
                    }
                }
            }
        }
    }
}

/// The causes of the failures; each shows the results with it.
pub(super) fn causes(overview: &Overview) -> Markup {
    let most = overview.causes.first().map_or(1, |(_, times)| *times);
    html! {
        @if !overview.causes.is_empty() {
            section aria-labelledby="causes" {
                h2 id="causes" { "Causes of the failures" }
                ul.causes {
                    @for (code, times) in &overview.causes {
                        li {
                            span {
                                a href="#queries" data-cause=(code) title="Show the results with this cause" {
                                    (capital(code.title()))
                                }
                                " " span.code { (code) }
                            }
                            span.times {
                                i style={ "width:" (format!("{:.0}", 100.0 * *times as f64 / most as f64)) "%" } {}
                                b { (times) }
                            }
                        }
                    }
                }
            }
        }
    }
}
