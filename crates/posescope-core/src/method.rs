//! The methods that are compared, by the names that the paper gives them.

use std::fmt;
use std::str::FromStr;

use crate::text::UnknownWord;

/// An estimator, as the paper abbreviates it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Method {
    /// FB, the indirect feature-based method.
    Feature,
    /// PM, the direct photometric method.
    Photometric,
    /// MI, the direct mutual-information method.
    MutualInformation,
    /// HY, the hybrid of FB and MI.
    Hybrid,
}

impl Method {
    /// The order in which methods run and are listed.
    pub const ALL: [Self; 4] = [
        Self::Feature,
        Self::Photometric,
        Self::MutualInformation,
        Self::Hybrid,
    ];

    /// The short name on the command line, in results and in recordings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Feature => "fb",
            Self::Photometric => "pm",
            Self::MutualInformation => "mi",
            Self::Hybrid => "hy",
        }
    }

    /// The method of a short name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|method| method.name() == name)
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Method {
    type Err = UnknownWord;

    fn from_str(name: &str) -> Result<Self, UnknownWord> {
        let names = Self::ALL.map(Self::name);
        Self::from_name(name).ok_or_else(|| UnknownWord::among(name, "method", names))
    }
}

crate::serde_as_text!(Method);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_is_read_as_it_is_written() {
        for method in Method::ALL {
            assert_eq!(method.to_string().parse(), Ok(method));
            let json = serde_json::to_string(&method).expect("a string");
            assert_eq!(json, format!("\"{}\"", method.name()));
            assert_eq!(serde_json::from_str::<Method>(&json).ok(), Some(method));
        }
        let error = "xx".parse::<Method>().expect_err("unknown").to_string();
        assert_eq!(error, "`xx` is no method; fb, pm, mi or hy expected");
    }
}
