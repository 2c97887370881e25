//! What a picture shows, in the layout of the graphics card.

use std::sync::Arc;

use egui::Color32;

use crate::app::views::space::view_camera::{NEAR_M, ViewCamera};

/// A point of the cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spot {
    /// Position in the scene \[m\].
    pub(crate) at: [f32; 3],
    pub(crate) color: Color32,
}

/// A stroke from one place to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Line {
    /// Both ends, in the scene \[m\].
    pub(crate) ends: [[f32; 3]; 2],
    pub(crate) color: Color32,
    /// Width in egui's points.
    pub(crate) width: f32,
}

/// Points that stay as they are, in the layout of the graphics card.
#[derive(Debug, Default)]
pub(crate) struct Points {
    pub(super) bytes: Vec<u8>,
}

impl Points {
    pub(crate) fn new(spots: impl Iterator<Item = Spot>) -> Self {
        let mut bytes = Vec::new();
        spots.for_each(|spot| spot.write(&mut bytes));
        Self { bytes }
    }

    pub(crate) fn len(&self) -> usize {
        self.bytes.len() / Spot::BYTES
    }
}

impl Spot {
    pub(super) const BYTES: usize = 16;

    pub(super) fn write(&self, bytes: &mut Vec<u8>) {
        write_floats(bytes, &self.at);
        bytes.extend(self.color.to_array());
    }
}

impl Line {
    pub(super) const BYTES: usize = 32;

    pub(super) fn write(&self, bytes: &mut Vec<u8>) {
        write_floats(bytes, self.ends.as_flattened());
        bytes.extend(self.color.to_array());
        write_floats(bytes, &[self.width]);
    }
}

fn write_floats(bytes: &mut Vec<u8>, floats: &[f32]) {
    bytes.extend(floats.iter().flat_map(|float| float.to_le_bytes()));
}

/// All that one picture shows.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    pub(crate) view_camera: ViewCamera,
    pub(crate) background: Color32,
    /// The cloud. It is uploaded again only when it is another one.
    pub(crate) points: Arc<Points>,
    pub(crate) lines: Vec<Line>,
}

impl PartialEq for Frame {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.points, &other.points)
            && self.view_camera == other.view_camera
            && self.background == other.background
            && self.lines == other.lines
    }
}

impl Frame {
    /// What the shaders know as `View`.
    pub(super) fn view(&self, size_px: [u32; 2], scale: f32) -> Vec<u8> {
        /// Least and greatest size of a point, in egui's points.
        const POINT: [f32; 2] = [1.5, 3.0];
        /// Size of a point of the cloud \[m\], where it comes out between the two.
        const POINT_M: f32 = 0.06;
        let focal_px = self.view_camera.focal[0] as f32 * scale;
        let mut bytes = Vec::new();
        write_floats(&mut bytes, self.view_camera.clip_from_scene().as_flattened());
        write_floats(&mut bytes, &size_px.map(|side| side as f32));
        write_floats(&mut bytes, &POINT.map(|side| side * scale));
        write_floats(&mut bytes, &[POINT_M * focal_px, scale, NEAR_M as f32, 0.0]);
        bytes
    }
}
