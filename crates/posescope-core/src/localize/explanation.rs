//! What was tried to make a wrong result right, and what helped.

use serde::{Deserialize, Serialize};

use crate::geometry::PoseError;

/// What was tried to make a wrong result right.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Explanation {
    /// What made it right, in the order in which it was tried.
    pub helped: Vec<Helped>,
    /// The arguments of each run that made nothing right; not in files.
    #[serde(skip)]
    pub failed: Vec<Vec<String>>,
    /// How often the query was localised again.
    pub runs: usize,
    /// Whether all was tried that was to be; a run that was cancelled did not come to its end.
    pub complete: bool,
}

impl Explanation {
    /// The remedy to recommend. They are tried in the order of what mends most, so it is the first that helped; one frame
    /// of the map in the place of another says the least about the cause.
    pub fn best(&self) -> Option<&Helped> {
        self.helped.iter().find(|helped| !helped.names_a_frame()).or(self.helped.first())
    }
}

/// A change that made a wrong result right.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Helped {
    /// The arguments that repeat it, beside those of the run.
    pub args: Vec<String>,
    /// The error of the pose then.
    pub error: PoseError,
}

impl Helped {
    /// Whether it names a frame as the reference, in the place of a way to choose references.
    pub fn names_a_frame(&self) -> bool {
        self.args.windows(2).any(|pair| pair[0] == "--reference" && !pair[1].contains(':'))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_of_what_helped_is_the_first_that_is_more_than_another_frame() {
        let helped = |option: &str, translation_m: f64| Helped {
            args: vec![option.to_owned(), "a".to_owned()],
            error: PoseError { translation_m, rotation_deg: 1.0, max_euler_deg: 1.0 },
        };
        let frame = helped("--reference", 0.1);
        let all = vec![frame.clone(), helped("--set", 0.5), helped("--method", 0.2)];
        let mut ranked = frame.clone();
        ranked.args[1] = "retrieve:3".to_owned();
        assert!(frame.names_a_frame() && !ranked.names_a_frame());
        let explanation = |helped| Explanation { helped, failed: vec![], runs: 3, complete: true };
        assert_eq!(explanation(all).best().expect("it helped").args[0], "--set");
        assert_eq!(explanation(vec![frame.clone()]).best(), Some(&frame));
        assert_eq!(Explanation::default().best(), None);
    }
}
