//! What cannot be written as SVG.

/// What cannot be written as SVG.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotDrawn {
    /// The graphics card paints it, and nobody knows of what.
    #[error(
        "the graphics card paints this, so that only its pixels are known: a PNG can hold them"
    )]
    Painted,
    /// A picture that nobody has kept.
    #[error("a picture in it is no longer there")]
    Lost,
    /// A picture could not be packed.
    #[error("a picture in it could not be written as PNG")]
    Unpacked,
    /// A shape that SVG has no counterpart of.
    #[error("it holds a shape that is not written as SVG")]
    Shape,
}
