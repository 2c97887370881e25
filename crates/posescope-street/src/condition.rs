//! Weather and time of day.

/// Weather and time of day of a traversal. It also decides which cars are parked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub enum Condition {
    /// An even grey sky, no shadows.
    Overcast,
    /// A low sun in a blue sky: long shadows, dazzling walls.
    Sun,
    /// Street lamps, lit windows, the car's own head lamps, and a noisy, blurred image.
    Night,
    /// A wet road that mirrors the street, falling rain, drops on the lens.
    Rain,
    /// Snow on the ground, on roofs and cars; bare trees, falling flakes.
    Snow,
}

impl Condition {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Overcast, Self::Sun, Self::Night, Self::Rain, Self::Snow];

    /// Its name, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Overcast => "overcast",
            Self::Sun => "sun",
            Self::Night => "night",
            Self::Rain => "rain",
            Self::Snow => "snow",
        }
    }
}
