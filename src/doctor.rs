//! Checking a scene: what is there and what is missing, whether its numbers can be what they say they are,
//! and which of the usual mistakes would explain what does not fit.
//!
//! A mistake is tried by reading the scene otherwise. It is named where points then fall on the photos
//! better than in what the scene says, by more than their differences from frame to frame can explain.

mod agreement;
mod inventory;
mod picture;
mod reading;
mod route;
mod trial;

use crate::geometry::Pose;
use crate::image::RgbImage;
use crate::scene::{Scene, SceneError};

pub use inventory::{Inventory, Remark};
pub use reading::Mistake;
pub use trial::{Agreement, Finding};

use trial::Sample;

/// What was found.
pub struct Examination {
    /// What is there.
    pub inventory: Inventory,
    /// What is hardly right in it.
    pub remarks: Vec<Remark>,
    /// How well the scene fits its own photos; `None` where nothing can be compared.
    pub agreement: Option<Agreement>,
    /// The mistake that explains what does not fit.
    pub finding: Option<Finding>,
    /// Frames that were compared.
    pub compared: Vec<usize>,
    /// The cloud of the first of them on its photo, and below it the way of the camera.
    pub picture: Option<RgbImage>,
}

impl Examination {
    /// Whether the scene cannot work.
    pub fn is_broken(&self) -> bool {
        let mut remarks = self.remarks.iter();
        self.finding.is_some() || remarks.any(|remark| matches!(remark, Remark::Broken(_)))
    }
}

/// Examines a scene. What is wrong with single files is a remark.
///
/// # Errors
/// Frames that are compared and cannot be read.
pub fn examine(scene: &dyn Scene) -> Result<Examination, SceneError> {
    let (inventory, remarks) = inventory::take(scene);
    let poses: Vec<Pose> = (0..scene.frames().len())
        .filter_map(|at| scene.pose(at))
        .collect();
    let mut examination = Examination {
        inventory,
        remarks,
        agreement: None,
        finding: None,
        compared: Vec::new(),
        picture: route::below(None, &poses),
    };
    let is_readable = |remark: &Remark| !matches!(remark, Remark::Broken(_));
    let has_clouds = !examination.inventory.clouds.is_empty();
    // A cloud that is out of view may be in the wrong axes: that is looked at all the same.
    if !has_clouds && !examination.remarks.iter().all(is_readable) {
        return Ok(examination);
    }
    let sample = Sample::read(scene)?;
    if sample.is_empty() {
        return Ok(examination);
    }
    let (agreement, finding) = sample.diagnose();
    examination.agreement = Some(agreement);
    examination.finding = finding;
    examination.compared = sample.anchors().to_vec();
    let first = sample.anchors().first();
    let cloud = first.and_then(|&anchor| {
        let (photo, seen) = sample.seen(anchor)?;
        Some(picture::cloud_on(photo, &seen))
    });
    examination.picture = route::below(cloud, &poses);
    Ok(examination)
}
