//! The codes of verdicts.

use std::fmt;
use std::str::FromStr;

use crate::text::UnknownWord;

macro_rules! codes {
    ($($(#[doc = $about:literal])+ $name:ident),+ $(,)?) => {
        /// What is wrong with a result, in short. `docs/diagnosis.md` tells each at length.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum Code {
            $($(#[doc = $about])+ $name),+
        }

        impl Code {
            /// All codes, in the order in which lists of them are written.
            pub const ALL: &[Self] = &[$(Self::$name),+];

            /// The code as it is written: `D3`.
            pub fn name(self) -> &'static str {
                match self { $(Self::$name => stringify!($name)),+ }
            }

            /// What it means, in one phrase.
            pub fn about(self) -> &'static str {
                match self { $(Self::$name => concat!($($about),+).trim_ascii()),+ }
            }
        }
    };
}

codes! {
    /// the reference does not see the query's scene
    R1,
    /// too few features
    R2,
    /// too few true matches
    R3,
    /// the depths of the matches are missing or wrong
    R4,
    /// the inliers do not fix the pose
    R5,
    /// MLESAC missed a pose that the truth supports
    R6,
    /// the pose was right and refused
    R7,
    /// the pose was accepted and is wrong
    R8,
    /// the pose is outside the prior
    R9,
    /// the minimum covers too little
    D1,
    /// the cost prefers another place
    D2,
    /// the search missed a cheaper pose near the truth
    D3,
    /// the truth is outside the grid
    D4,
    /// nothing tells the hypotheses apart
    D5,
    /// the images look too different
    D6,
    /// height, pitch or roll, which are not searched, are off
    D7,
    /// the minimum is on the rim of the grid
    D8,
    /// the grid is too large to be searched
    D9,
    /// one reference dragged the fusion
    F1,
    /// the method takes one reference at a time
    F2,
    /// the hybrid kept a bad pose of its first method
    H1,
    /// the right place was ranked too low
    V1,
    /// another system gave no answer
    E1,
    /// low confidence
    L1,
    /// the ground truth or a calibration is suspect
    X1,
    /// a bug
    X9,
}

impl Code {
    /// Whether it says that something failed: all but [`Code::L1`], which says that nobody knows.
    pub fn is_failure(self) -> bool {
        self != Self::L1
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Code {
    type Err = UnknownWord;

    fn from_str(name: &str) -> Result<Self, UnknownWord> {
        let found = Self::ALL.iter().find(|code| code.name() == name);
        found
            .copied()
            .ok_or_else(|| UnknownWord::among(name, "code", Self::ALL.iter().map(|c| c.name())))
    }
}

crate::serde_as_text!(Code);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_read_back_from_its_name_and_says_what_it_means() {
        for &code in Code::ALL {
            assert_eq!(code.name().parse(), Ok(code));
            assert!(code.about().len() > 4, "{code}: {}", code.about());
        }
        assert!("D0".parse::<Code>().is_err());
    }
}
