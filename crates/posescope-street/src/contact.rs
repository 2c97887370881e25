//! Where a ray meets a solid.

use nalgebra::{Vector2, Vector3};

/// The part of a solid that a ray met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// The face towards +z of the solid's frame: what looks at the street.
    Front,
    /// The face towards −z.
    Back,
    /// A face towards ±x.
    Side,
    /// A horizontal face.
    Flat,
    /// A slope of a roof.
    Slope,
    /// The skin of a cylinder or an ellipsoid.
    Round,
    /// The roof, bonnet or another plain panel of a car.
    Panel,
    /// The flank of a car below the windows.
    Flank,
    /// The front of a car.
    Nose,
    /// The rear of a car.
    Tail,
    /// The side windows of a car.
    Pane,
    /// The windscreen or the rear window of a car.
    Screen,
    /// The tread of a wheel.
    Tread,
    /// The outer face of a wheel.
    Wheel,
}

/// Where a ray met a solid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    /// Distance along the ray \[m\].
    pub(super) distance: f64,
    /// Outward normal, of unit length.
    pub(super) normal: Vector3<f64>,
    /// Coordinates on the surface \[m\]: along it from its left edge as seen from outside, and up
    /// from the solid's base.
    pub(super) uv: Vector2<f64>,
    /// The part of the solid that was met.
    pub(super) part: Part,
}
