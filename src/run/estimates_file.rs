//! The argument of `--estimates`: poses of another system.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use crate::method::Method;

/// A file of poses and the method name of their system: `superglue=poses.txt`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EstimatesFile {
    /// The name.
    pub method: Method,
    /// The file.
    pub path: PathBuf,
}

impl FromStr for EstimatesFile {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let split = text.split_once('=').filter(|(_, path)| !path.is_empty());
        let (name, path) = split.ok_or_else(|| {
            let file = if text.contains('=') { "poses.txt" } else { text };
            format!("NAME=FILE expected; give the poses a name, such as superglue={file}")
        })?;
        let ours = crate::estimator::methods().find(|method| method.name() == name);
        if let Some(method) = ours {
            return Err(format!(
                "{method} is a built-in method; choose another name for these poses"
            ));
        }
        Ok(Self {
            method: Method::called(name).map_err(|error| error.to_string())?,
            path: path.into(),
        })
    }
}

impl fmt::Display for EstimatesFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.method, self.path.display())
    }
}

posescope_core::serde_as_text!(EstimatesFile);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_poses_needs_a_name_of_its_own() {
        let file: EstimatesFile = "superglue=a=b.txt".parse().expect("a name and a file");
        assert_eq!(file.method.name(), "superglue");
        assert_eq!(file.path, PathBuf::from("a=b.txt"));
        assert_eq!(file.to_string().parse(), Ok(file));
        for wrong in ["superglue", "superglue=", "=a.txt", "mi=a.txt", "Super Glue=a.txt"] {
            assert!(wrong.parse::<EstimatesFile>().is_err(), "{wrong}");
        }
    }
}
