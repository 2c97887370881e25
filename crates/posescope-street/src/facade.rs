//! The design of a house's walls: its measures, what it is built of, where its door is.

use super::appearance::Rgb;

/// What a wall is built of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wall {
    /// Painted plaster.
    Plaster,
    /// Bricks.
    Brick,
    /// Plaster between timbers.
    Timber,
}

/// The face of the ground floor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum GroundFloor {
    /// Windows like those of the storeys above.
    Flats,
    /// Shop windows below a sign.
    Shop,
}

/// The design of a house's walls; lengths in metres.
#[derive(Clone, Debug)]
pub(super) struct Facade {
    /// Width of the front.
    pub(super) width: f64,
    /// Width of the sides.
    pub(super) depth: f64,
    /// Height of the eaves.
    pub(super) eaves: f64,
    /// Height of a storey.
    pub(super) storey: f64,
    /// Height of a window sill above its floor.
    pub(super) sill: f64,
    /// Width of a bay; each holds one window.
    pub(super) bay: f64,
    /// Width and height of a window.
    pub(super) window: [f64; 2],
    /// What the wall is built of.
    pub(super) wall: Wall,
    /// Colour of the wall.
    pub(super) colour: Rgb,
    /// Colour of surrounds and bands.
    pub(super) trim: Rgb,
    /// Height of the stone base.
    pub(super) plinth: f64,
    /// What the ground floor shows to the street.
    pub(super) ground: GroundFloor,
    /// Bay of the door in the front, from the left.
    pub(super) door: i32,
    /// Whether windows have wooden shutters beside them.
    pub(super) shutters: bool,
    /// Randomises the details.
    pub(super) seed: u32,
}
