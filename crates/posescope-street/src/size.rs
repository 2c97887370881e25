//! Sizes of the images, and the camera that takes them.

use posescope_core::camera::Intrinsics;

/// Size of the images.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub enum Size {
    /// 620 × 188 pixels.
    Half,
    /// 1241 × 376 pixels.
    Full,
}

impl Size {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Half, Self::Full];

    /// Its name, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Half => "half",
            Self::Full => "full",
        }
    }

    /// The camera that takes images of this size.
    pub fn intrinsics(self) -> Intrinsics {
        let full = Intrinsics {
            fx: 718.856,
            fy: 718.856,
            cx: 607.1928,
            cy: 185.2157,
            width: 1241,
            height: 376,
        };
        // Pixel (0, 0) is the centre of a pixel: the image begins at −0.5.
        let half = |c: f64| (c + 0.5) / 2.0 - 0.5;
        match self {
            Self::Full => full,
            Self::Half => Intrinsics {
                fx: full.fx / 2.0,
                fy: full.fy / 2.0,
                cx: half(full.cx),
                cy: half(full.cy),
                width: full.width / 2,
                height: full.height / 2,
            },
        }
    }
}
