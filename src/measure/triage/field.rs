//! The fields of a result for conditions, orders and tables.

use std::cmp::Ordering;

use crate::diagnosis::{Code, Confidence, Grade};
use crate::localize::QueryResult;
use crate::opinion::Standing;
use crate::scale::LengthUnit;
use crate::table::{Align, grouped, three_digits};
use crate::text::UnknownWord;

/// A field of a result, which is a column of tables. Tables list their fields; all else about a column is here.
pub struct Field {
    /// The name in conditions and orders.
    pub name: &'static str,
    /// The heading in the report, without the unit.
    heading: &'static str,
    about: &'static str,
    /// The unit of its numbers; empty for text and for numbers without unit.
    pub unit: &'static str,
    /// The width of its column in the window \[points\].
    pub width: f32,
    /// Digits after the decimal point; `None` for text.
    pub decimals: Option<usize>,
    read: Read,
    check: fn(&str) -> Result<(), UnknownWord>,
}

impl PartialEq for Field {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl std::fmt::Debug for Field {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

/// The value of a field.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Words.
    Words(String),
    /// A number.
    Number(f64),
    /// The result has no such value.
    None,
}

impl Value {
    /// Compares two values of one field. Missing values come last in either direction.
    pub(super) fn compare(&self, other: &Self, descending: bool) -> Ordering {
        let forward = match (self, other) {
            (Self::None, Self::None) => return Ordering::Equal,
            (Self::None, _) => return Ordering::Greater,
            (_, Self::None) => return Ordering::Less,
            (Self::Number(a), Self::Number(b)) => a.total_cmp(b),
            (Self::Words(a), Self::Words(b)) => a.cmp(b),
            (Self::Words(_), Self::Number(_)) => Ordering::Greater,
            (Self::Number(_), Self::Words(_)) => Ordering::Less,
        };
        if descending { forward.reverse() } else { forward }
    }
}

impl Field {
    /// Every field.
    pub const ALL: &[Self] = &[
        words("query", "the query frame", |r| r.query.clone()).wide(84.0),
        words("scene", "the scene of the references", |r| r.scene.clone()),
        words("queries", "the scene of the query", |r| {
            r.query_scene.clone().unwrap_or_else(|| r.scene.clone())
        }),
        words("reference", "the reference frames", |r| r.references.join(" ")).wide(110.0),
        words("method", "the method", |r| r.method.to_string()).wide(56.0),
        words("fusion", "the fusion", |r| {
            r.fusion.as_ref().map_or(String::new(), ToString::to_string)
        }),
        words("grade", "right, wrong, no pose or unmeasured", |r| r.grade.to_string())
            .called("result")
            .wide(104.0)
            .only(|word| word.parse::<Grade>().map(drop)),
        words("confidence", "trusted, unsure or low", |r| {
            r.confidence_word().map_or(String::new(), |word| word.to_string())
        })
        .only(|word| word.parse::<Confidence>().map(drop)),
        words("opinion", "confirmed, contradicted or undecided, of another system's pose", |r| {
            r.opinion.as_ref().map_or(String::new(), |opinion| opinion.standing.to_string())
        })
        .only(|word| word.parse::<Standing>().map(drop))
        .wide(84.0),
        words("code", "the primary verdict", |r| {
            r.diagnosis.first().map_or(String::new(), |d| d.code.to_string())
        })
        .wide(48.0)
        .only(|word| word.to_uppercase().parse::<Code>().map(drop)),
        words("cause", "the primary verdict as a phrase", |r| {
            r.diagnosis.first().map_or(String::new(), |d| d.code.title().to_owned())
        })
        .wide(120.0),
        words("codes", "all verdicts", |r| {
            let codes: Vec<&str> = r.diagnosis.iter().map(|d| d.code.name()).collect();
            codes.join(" ")
        }),
        number("error", "distance from the truth", "m", 3, |r| Some(r.error?.translation_m)),
        number("rotation", "rotation from the truth", "°", 2, |r| Some(r.error?.rotation_deg))
            .wide(64.0),
        number("start", "distance of the reference from the truth", "m", 3, |r| {
            Some(r.initial_error?.translation_m)
        })
        .called("distance"),
        number("probability", "probability of being right", "", 3, |r| {
            let own = r.confidence.as_ref().map(|known| known.probability);
            own.or_else(|| Some(r.opinion.as_ref()?.probability))
        })
        .called("confidence")
        .wide(76.0),
        number("interval", "distance that 95 % of such poses stay within, if right", "m", 3, |r| {
            Some(r.confidence.as_ref()?.within_95?.m)
        }),
        number(
            "off",
            "distance of another system's pose from where posescope has it",
            "m",
            3,
            |r| r.opinion.as_ref()?.distance_m(),
        ),
        number(
            "turned",
            "angle of another system's pose from that where posescope has it",
            "°",
            2,
            |r| r.opinion.as_ref()?.offset_deg,
        ),
        number("keypoints", "keypoints of the query", "", 0, |r| {
            Some(r.counts?.query_keypoints as f64)
        }),
        number("reference_keypoints", "keypoints of the reference", "", 0, |r| {
            Some(r.counts?.reference_keypoints as f64)
        }),
        number("unique", "unique matches, with a depth or not", "", 0, |r| {
            Some(r.counts?.unique as f64)
        }),
        number("matches", "matches with a depth", "", 0, |r| Some(r.counts?.with_depth as f64)),
        number("inliers", "inliers", "", 0, |r| Some(r.counts?.inliers as f64)),
        number("cost", "cost at the result", "", 4, |r| Some(r.cost.as_ref()?.best)),
        number("truth_cost", "cost at the truth", "", 4, |r| r.cost.as_ref()?.truth),
        number("shuffled", "cost of shuffled pixels", "", 4, |r| r.cost.as_ref()?.shuffled),
        number("evaluations", "hypotheses that were scored", "", 0, |r| {
            Some(r.cost.as_ref()?.evaluations as f64)
        }),
        number("coverage", "share of the photo covered at the result", "", 3, |r| {
            Some(r.cost.as_ref()?.coverage_best)
        }),
        number("basin", "radius around the truth from which the search finds it", "m", 1, |r| {
            r.cost.as_ref()?.basin_m
        }),
        number(
            "margin",
            "cost of the best minimum elsewhere above that at the truth",
            "",
            4,
            |r| r.cost.as_ref()?.basin_margin,
        ),
        number("radius", "the uncertainty radius", "m", 1, |r| Some(r.setting?.radius_m)),
        number("references", "requested number of references", "", 0, |r| {
            Some(r.setting?.references as f64)
        }),
        number("helped", "number of remedies that helped", "", 0, |r| {
            Some(r.explanation.as_ref()?.helped.len() as f64)
        }),
    ];

    /// Further columns of tables, which cannot be used in conditions.
    pub const POSE: &[Self] = &[
        number("max_euler", "greatest Euler angle from the truth", "°", 2, |r| {
            Some(r.error?.max_euler_deg)
        }),
        number("x", "x of the camera in the world", "m", 3, |r| position(r, 0)),
        number("y", "y of the camera in the world", "m", 3, |r| position(r, 1)),
        number("z", "z of the camera in the world", "m", 3, |r| position(r, 2)),
        number("qx", "x of the quaternion of the rotation to the world", "", 4, |r| {
            quaternion(r, 0)
        }),
        number("qy", "y of the quaternion", "", 4, |r| quaternion(r, 1)),
        number("qz", "z of the quaternion", "", 4, |r| quaternion(r, 2)),
        number("qw", "scalar of the quaternion", "", 4, |r| quaternion(r, 3)),
    ];

    /// The field with this name, for the columns of a table. A name that no field has does not compile.
    pub const fn named(name: &str) -> &'static Self {
        let mut at = 0;
        while at < Self::ALL.len() {
            if is_equal(Self::ALL[at].name, name) {
                return &Self::ALL[at];
            }
            at += 1;
        }
        panic!("no field has this name")
    }

    /// The field with this name.
    ///
    /// # Errors
    /// An unknown name; the error lists all names.
    pub fn find(name: &str) -> Result<&'static Self, UnknownWord> {
        let mut all = Self::ALL.iter();
        let names = Self::ALL.iter().map(|field| field.name);
        all.find(|field| field.name == name).ok_or_else(|| UnknownWord::among(name, "field", names))
    }

    /// Whether it can have this value. No word at all stands for a missing one.
    ///
    /// # Errors
    /// A word that it never has; the error lists those that it has.
    pub(super) fn check(&self, word: &str) -> Result<(), UnknownWord> {
        if word.is_empty() { Ok(()) } else { (self.check)(word) }
    }

    /// The same field, of which only these values make sense.
    const fn only(self, check: fn(&str) -> Result<(), UnknownWord>) -> Self {
        Self { check, ..self }
    }

    /// The same field with another heading than its name.
    const fn called(self, heading: &'static str) -> Self {
        Self { heading, ..self }
    }

    /// The same field in a column of this width \[points\].
    const fn wide(self, width: f32) -> Self {
        Self { width, ..self }
    }

    /// The heading of its column in the report, with its unit.
    pub fn heading(&self) -> String {
        match self.unit {
            "" => self.heading.to_owned(),
            unit => format!("{} ({unit})", self.heading),
        }
    }

    /// What it is, with its unit.
    pub fn about(&self) -> String {
        match self.unit {
            "" => self.about.to_owned(),
            unit => format!("{} [{unit}]", self.about),
        }
    }

    /// The alignment of its column in a table.
    pub fn align(&self) -> Align {
        match self.decimals {
            Some(_) => Align::Right,
            None => Align::Left,
        }
    }

    /// Its value in a result.
    pub fn of(&self, result: &QueryResult) -> Value {
        match self.read {
            Read::Words(read) => Value::Words(read(result)),
            Read::Number(read) => read(result).map_or(Value::None, Value::Number),
        }
    }

    /// Its value with all digits; empty if missing.
    pub fn whole(&self, result: &QueryResult) -> String {
        match self.of(result) {
            Value::Number(number) => number.to_string(),
            _ => self.text(result),
        }
    }

    /// Its value as shown; empty if missing.
    pub fn text(&self, result: &QueryResult) -> String {
        match self.of(result) {
            Value::Words(words) => words,
            Value::Number(number) => format!("{number:.*}", self.decimals.unwrap_or(0)),
            Value::None => String::new(),
        }
    }

    /// Its value as a sentence says it, perhaps in percent: `1,648`, `4 cm`, `13.9 m`, `0.924`, `95 %`. Empty if
    /// missing.
    pub fn spoken(&self, result: &QueryResult, in_percent: bool) -> String {
        let Value::Number(number) = self.of(result) else {
            return self.text(result);
        };
        match self.unit {
            _ if in_percent && number < 0.1 => format!("{:.1} %", 100.0 * number),
            _ if in_percent => format!("{:.0} %", 100.0 * number),
            "m" if number < 0.995 && result.unit == LengthUnit::Metre => {
                let decimals = usize::from(number < 0.01);
                format!("{:.decimals$} cm", 100.0 * number)
            }
            "m" => result.unit.words(&format!("{number:.1} m")),
            "°" if number < 0.1 => format!("{number:.2}°"),
            "°" => format!("{number:.1}°"),
            _ if self.decimals == Some(0) => grouped(number, 0),
            _ => three_digits(number),
        }
    }
}

fn position(result: &QueryResult, axis: usize) -> Option<f64> {
    Some(result.pose.as_ref()?.position_m[axis])
}

fn quaternion(result: &QueryResult, part: usize) -> Option<f64> {
    Some(result.pose.as_ref()?.quaternion_xyzw[part])
}

/// How a value is read.
enum Read {
    Words(fn(&QueryResult) -> String),
    Number(fn(&QueryResult) -> Option<f64>),
}

/// The width of most columns \[points\].
const WIDTH: f32 = 60.0;

const fn words(name: &'static str, about: &'static str, read: fn(&QueryResult) -> String) -> Field {
    Field {
        name,
        heading: name,
        about,
        unit: "",
        width: WIDTH,
        decimals: None,
        read: Read::Words(read),
        check: |_| Ok(()),
    }
}

const fn number(
    name: &'static str,
    about: &'static str,
    unit: &'static str,
    decimals: usize,
    read: fn(&QueryResult) -> Option<f64>,
) -> Field {
    let read = Read::Number(read);
    Field { unit, decimals: Some(decimals), read, ..words(name, about, |_| String::new()) }
}

/// Whether two texts are equal, for constants.
pub(crate) const fn is_equal(one: &str, other: &str) -> bool {
    let (one, other) = (one.as_bytes(), other.as_bytes());
    let mut at = 0;
    while at < one.len() && at < other.len() && one[at] == other[at] {
        at += 1;
    }
    at == one.len() && at == other.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::metrics::tests::row;

    #[test]
    fn a_sentence_says_a_number_as_people_read_it() {
        let said = |error_m: f64, field: &str| {
            let mut result = row("1", "fb", Some(error_m));
            result.unit = if field == "start" { LengthUnit::Model } else { LengthUnit::Metre };
            result.initial_error = result.error;
            Field::find(field).expect("a field").spoken(&result, false)
        };
        for (error_m, field, words) in [
            (0.0041, "error", "0.4 cm"),
            (0.0413, "error", "4 cm"),
            (0.997, "error", "1.0 m"),
            (13.94, "error", "13.9 m"),
            (0.25, "start", "0.2 units"),
            (0.25, "rotation", "0.2°"),
            (0.04, "rotation", "0.04°"),
            (0.25, "cost", ""),
            (0.25, "method", "fb"),
        ] {
            assert_eq!(said(error_m, field), words, "{error_m} {field}");
        }
        let percent = |probability: f64| {
            let share = number("share", "", "", 3, |r| Some(r.error?.translation_m));
            share.spoken(&row("1", "fb", Some(probability)), true)
        };
        assert_eq!([0.016, 0.954].map(percent), ["1.6 %", "95 %"]);
        assert_eq!([grouped(1648.0, 0), three_digits(0.9244)], ["1,648", "0.924"]);
    }
}
