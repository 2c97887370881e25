//! The lines that correct a mistake in the files of a scene.

/// What to write into the files of a scene, so that it is read otherwise.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Correction {
    /// The lines.
    pub lines: Vec<String>,
    /// Where they belong.
    pub place: Place,
}

/// A place in the files of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// `scene.toml`, above its tables.
    Description,
    /// `scene.toml`, in its table of the camera.
    Camera,
    /// `scene.toml`, in its table of clouds.
    Clouds,
    /// The first line of the file with the poses.
    PosesHeader,
    /// The value of a metre in depth images: in `depth_per_metre.txt`, or in `scene.toml`.
    DepthPerMetre,
}

impl Place {
    /// The place in words.
    pub fn about(self) -> &'static str {
        match self {
            Self::Description => "in scene.toml, above [camera]",
            Self::Camera => "in scene.toml, in [camera]",
            Self::Clouds => "in scene.toml, in [clouds]",
            Self::PosesHeader => "as the first line of the file with the poses",
            Self::DepthPerMetre => "in depth_per_metre.txt, a file in the scene's folder",
        }
    }
}
