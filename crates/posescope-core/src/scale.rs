//! For posescope's own crates: may change in any version.
//!
//! How large a scene is, compared with the streets of the paper.

use serde::{Deserialize, Serialize};

use crate::geometry::{Pose, PoseError};

/// The length that is to a scene what one metre is to the streets of the paper.
///
/// A view changes with the ratio of a step to the distance of what is seen. So where everything is ten times nearer,
/// steps, radii and tolerances must be ten times shorter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scale {
    /// The length that stands for one metre, above 0.
    metre: f64,
    /// Whether lengths are in metres. A model from photos alone has a unit of its own.
    is_metric: bool,
}

/// A depth that still belongs to the scale of the paper: in KITTI, the median depth of what a camera sees of a scan is 11 to
/// 13 m.
const STREET_DEPTH_M: f64 = 10.0;

impl Scale {
    /// That of the paper's streets.
    pub const PAPER: Self = Self { metre: 1.0, is_metric: true };

    /// The scale of a scene in which things have this typical depth \[m, or the unit of the scene\]. It is 1, 2 or 5
    /// times a power of ten, so that the lengths that follow from it are short numbers.
    pub fn of_depth(depth: f64, is_metric: bool) -> Self {
        let exact = if depth.is_finite() { depth / STREET_DEPTH_M } else { 1.0 };
        let powers = (-3..=3).map(|power| 10_f64.powi(power));
        let mut steps = powers.flat_map(|power| [1.0, 2.0, 5.0].map(|digit| short(digit * power)));
        let below = steps.rfind(|step| *step <= exact);
        // Beyond that, the unit is wrong.
        Self { metre: below.unwrap_or(1e-3), is_metric }
    }

    /// The length that stands for one metre.
    pub fn metre(self) -> f64 {
        self.metre
    }

    /// Whether lengths are in metres.
    pub fn is_metric(self) -> bool {
        self.is_metric
    }

    /// The least typical depth of scenes with this scale \[m, or the unit of the scene\].
    pub fn least_depth(self) -> f64 {
        self.length(STREET_DEPTH_M)
    }

    /// The unit of lengths.
    pub fn unit(self) -> LengthUnit {
        if self.is_metric { LengthUnit::Metre } else { LengthUnit::Model }
    }

    /// Whether it is that of the paper, in metres.
    pub fn is_paper(self) -> bool {
        self == Self::PAPER
    }

    /// A length at this scale that stands for `paper_m` metres in the paper.
    pub fn length(self, paper_m: f64) -> f64 {
        if self.metre == 1.0 { paper_m } else { short(self.metre * paper_m) }
    }

    /// How far from a reference to search by default.
    ///
    /// The radii of the paper are 10 to 25 m. Streets have 15 m. Elsewhere cameras turn more from place to place, and
    /// the nearest radius finds most.
    pub fn radius(self) -> f64 {
        const STREET_M: f64 = 15.0;
        const ELSEWHERE_M: f64 = 10.0;
        if self.metre == 1.0 { STREET_M } else { self.length(ELSEWHERE_M) }
    }

    /// What is given per metre in the paper, per unit of length at this scale.
    pub fn per_length(self, paper_per_m: f64) -> f64 {
        if self.metre == 1.0 { paper_per_m } else { short(paper_per_m / self.metre) }
    }

    /// Whether two poses of a search are one: at one place and with one heading.
    pub(crate) fn is_same_pose(self, a: &Pose, b: &Pose) -> bool {
        const SAME_M: f64 = 0.3;
        const SAME_DEG: f64 = 1.0;
        let between = PoseError::between(a, b);
        between.translation_m <= self.length(SAME_M) && between.rotation_deg <= SAME_DEG
    }

    /// Whether its length is one.
    pub(crate) fn is_sound(self) -> bool {
        self.metre.is_finite() && self.metre > 0.0
    }
}

impl Default for Scale {
    fn default() -> Self {
        Self::PAPER
    }
}

/// The number without its last digits, which come from the arithmetic.
fn short(number: f64) -> f64 {
    format!("{number:.9e}").parse().unwrap_or(number)
}

/// The unit of lengths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Option<String>", into = "Option<String>")]
pub enum LengthUnit {
    /// The metre.
    #[default]
    Metre,
    /// That of a model which has no metric scale; written as null.
    Model,
}

impl LengthUnit {
    pub(crate) fn is_metre(&self) -> bool {
        *self == Self::Metre
    }

    /// Words about lengths in metres, as words about as many of this unit: `0.25 m` becomes `0.25 units` in a model
    /// without metric scale, and `(m)` becomes `(units)`.
    pub fn words(self, text: &str) -> String {
        const METRE: &str = " m";
        if self.is_metre() {
            return text.to_owned();
        }
        let text = text.replace("[m]", "[units]").replace("(m)", "(units)");
        let mut parts = text.split(METRE);
        let mut words = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let is_after_number = words.ends_with(|c: char| c.is_ascii_digit() || c == ')');
            let ends_here = !part.starts_with(|c: char| c.is_alphanumeric() || c == '²');
            words += if is_after_number && ends_here { " units" } else { METRE };
            words += part;
        }
        words
    }
}

impl From<LengthUnit> for Option<String> {
    fn from(unit: LengthUnit) -> Self {
        unit.is_metre().then(|| "m".to_owned())
    }
}

impl From<Option<String>> for LengthUnit {
    fn from(unit: Option<String>) -> Self {
        if unit.is_some() { Self::Metre } else { Self::Model }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streets_have_the_scale_of_the_paper_and_rooms_a_smaller_one() {
        let metre = |depth: f64| Scale::of_depth(depth, true).metre();
        assert_eq!([10.0, 12.0, 19.9].map(metre), [1.0; 3]);
        assert_eq!([1.0, 1.84].map(metre), [0.1; 2]);
        assert_eq!([2.0, 4.9, 5.0, 50.0].map(metre), [0.2, 0.2, 0.5, 5.0]);
        assert_eq!([0.0, 1e-9, 1e9, f64::NAN].map(metre), [1e-3, 1e-3, 5e3, 1.0]);
        assert!(Scale::of_depth(12.0, true).is_paper());
        assert!(!Scale::of_depth(12.0, false).is_paper());
    }

    #[test]
    fn lengths_follow_the_scale_and_have_few_digits() {
        let room = Scale::of_depth(1.8, true);
        assert_eq!(room.length(0.2), 0.02);
        assert_eq!((room.radius(), Scale::PAPER.radius()), (1.0, 15.0));
        assert_eq!(room.per_length(3.0), 30.0);
        assert_eq!(Scale::PAPER.length(0.004), 0.004);
    }

    #[test]
    fn a_model_without_scale_has_units_where_a_scene_has_metres() {
        let text =
            "It is 12.5 m off, 3 m² and 4 metres, in frame m; 2 mm, 0.3 m. Ahead [m], (1, 2) m";
        assert_eq!(LengthUnit::Metre.words(text), text);
        let words = "It is 12.5 units off, 3 m² and 4 metres, in frame m; 2 mm, 0.3 units. Ahead [units], (1, 2) units";
        assert_eq!(LengthUnit::Model.words(text), words);
    }
}
