//! Checks a scene: what it contains and lacks, whether its numbers are plausible, and which of the usual
//! mistakes would explain a misfit.
//!
//! A mistake is tested by reading the scene as if the mistake had been made. It is reported if cloud and photos
//! then fit better than as stated, by more than the variation between frames can explain.

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
pub use reading::{Mistake, Subject};
pub use trial::{Agreement, Finding};

use trial::Sample;

/// The findings on a scene.
pub struct Examination {
    /// The contents of the scene.
    pub inventory: Inventory,
    /// Implausible things in it.
    pub remarks: Vec<Remark>,
    /// How well the scene fits its own photos; `None` if nothing can be compared.
    pub agreement: Option<Agreement>,
    /// The mistake that explains the misfit.
    pub finding: Option<Finding>,
    /// The compared frames.
    pub compared: Vec<usize>,
    /// The cloud of the first compared frame on its photo, with the route of the camera below.
    pub picture: Option<RgbImage>,
}

impl Examination {
    /// Whether the scene is unusable or contains a mistake.
    pub fn is_broken(&self) -> bool {
        let mut remarks = self.remarks.iter();
        self.finding.is_some() || remarks.any(|remark| matches!(remark, Remark::Broken(_)))
    }
}

/// The mistake that explains why clouds and photos do not fit, if any does.
///
/// # Errors
/// A compared frame that cannot be read.
pub fn mistake(scene: &dyn Scene) -> Result<Option<Finding>, SceneError> {
    Ok(Sample::read(scene)?.diagnose().1)
}

/// Examines a scene. Errors of single files become remarks.
///
/// # Errors
/// A compared frame that cannot be read.
pub fn examine(scene: &dyn Scene) -> Result<Examination, SceneError> {
    let (inventory, remarks) = inventory::take(scene);
    let poses: Vec<Pose> = (0..scene.frames().len()).filter_map(|at| scene.pose(at)).collect();
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
    // A cloud that is out of view may have the wrong axes, so it is still examined.
    if !has_clouds && !examination.remarks.iter().all(is_readable) {
        return Ok(examination);
    }
    let sample = Sample::read(scene)?;
    let Some(&first) = sample.anchors.first() else {
        return Ok(examination);
    };
    let (agreement, finding) = sample.diagnose();
    examination.agreement = Some(agreement);
    examination.finding = finding;
    let cloud = sample.seen(first).map(|(photo, seen)| picture::cloud_on(photo, &seen));
    examination.picture = route::below(cloud, &poses);
    examination.compared = sample.anchors;
    Ok(examination)
}
