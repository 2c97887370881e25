//! The run at a glance: one sentence, a bar for each method, and the causes by their frequency.

use maud::{Markup, html};

use super::words::{capital, class_of};
use crate::diagnosis::Grade;
use crate::measure::{Bar, Overview};

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
        }
    }
}

fn bar(bar: &Bar) -> Markup {
    let counts = Grade::ALL.map(|grade| (grade, bar.count(grade)));
    let counts: Vec<(Grade, usize)> = counts.into_iter().filter(|(_, count)| *count > 0).collect();
    let words: Vec<String> =
        counts.iter().map(|(grade, count)| format!("{count} {grade}")).collect();
    let spoken = format!("{}: {}", bar.name, words.join(", "));
    html! {
        div.bar {
            span.name { (bar.name) }
            div.parts role="img" aria-label=(spoken) title=(spoken) {
                @for (grade, count) in &counts {
                    span class={ "part " (class_of(*grade)) } style={ "flex-grow:" (count) } {
                        b { (count) } " " (grade)
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
