//! Checks a scene: what it contains and lacks, whether its numbers are plausible, and which of the usual
//! mistakes would explain a misfit.
//!
//! Three measures say how well clouds, photos, cameras and poses fit together: whether the poses explain the features
//! that photos share, whether points keep their grey values from photo to photo, and whether depth edges lie on image
//! edges. A mistake is tested by reading the scene as if the mistake had been made. It is reported if it then fits as
//! well as scenes without a mistake, and better than as stated by more than the variation between frames can explain.
//! Where a reading has numbers of its own, half of the frames choose them and the others test them; where clouds show
//! outlines of things, these must fall on edges of the photos.

mod agreement;
mod calibration;
mod correction;
mod inventory;
mod matches;
mod picture;
mod reading;
mod route;
mod sample;
mod search;
mod trial;
mod two;

use crate::geometry::Pose;
use crate::image::RgbImage;
use crate::scene::Scene;

pub use calibration::{CALIBRATION_STEPS, Calibration, Estimate, NotJudged, calibration};
pub use correction::{Correction, Place};
pub use inventory::{Inventory, Remark, unseen_map};
pub use reading::{Mistake, Subject};
pub use sample::{Agreement, FramePair};
pub use trial::{Finding, Fit};

use sample::Sample;
use trial::SURFACES;

/// The findings on a scene.
pub struct Examination {
    /// The contents of the scene.
    pub inventory: Inventory,
    /// Implausible things in it.
    pub remarks: Vec<Remark>,
    /// How well the scene fits its own photos; `None` if nothing can be compared.
    pub agreement: Option<Agreement>,
    /// The step of the clouds' coordinates \[m\], if it is too coarse to find mistakes.
    pub coarse_step_m: Option<f64>,
    /// Whether it fits, if anything can be compared.
    pub fit: Option<Fit>,
    /// The mistake that explains the misfit.
    pub finding: Option<Finding>,
    /// The compared frames.
    pub compared: Vec<usize>,
    /// The cloud of the first compared frame on its photo, with the route of the camera below.
    pub picture: Option<RgbImage>,
}

impl Examination {
    /// Whether the scene is unusable, contains a mistake, or does not fit its photos for a reason that is not known.
    pub fn is_broken(&self) -> bool {
        let mut remarks = self.remarks.iter();
        self.finding.is_some()
            || self.fit == Some(Fit::Unexplained)
            || remarks.any(|remark| matches!(remark, Remark::Broken(_)))
    }
}

/// The mistake that explains why clouds and photos do not fit, if any does, and how closely pairs of frames fit each
/// other. Photos and clouds that cannot be read do not count.
pub fn fit(scene: &dyn Scene) -> (Option<Finding>, Vec<FramePair>) {
    let sample = Sample::read(scene);
    let pairs = sample.frame_pairs();
    let mistake = match scene.cloud_facts().coarse_step_m {
        None => sample.diagnose().2,
        Some(_) => None,
    };
    (mistake, pairs)
}

/// Examines a scene. Errors of single files become remarks.
pub fn examine(scene: &dyn Scene) -> Examination {
    let (inventory, remarks) = inventory::take(scene);
    let poses: Vec<Pose> = (0..scene.frames().len()).filter_map(|at| scene.pose(at)).collect();
    let mut examination = Examination {
        inventory,
        remarks,
        agreement: None,
        coarse_step_m: None,
        fit: None,
        finding: None,
        compared: Vec::new(),
        picture: route::below(None, &poses),
    };
    let is_readable = |remark: &Remark| !matches!(remark, Remark::Broken(_));
    let has_clouds = !examination.inventory.clouds.is_empty();
    // A cloud that is out of view may have the wrong axes, so it is still examined.
    if !has_clouds && !examination.remarks.iter().all(is_readable) {
        return examination;
    }
    let sample = Sample::read(scene);
    for why in &sample.unreadable {
        let is_known = |remark: &Remark| matches!(remark, Remark::Broken(known) | Remark::Odd(known) if known == why);
        if !examination.remarks.iter().any(is_known) {
            examination.remarks.push(Remark::Odd(why.clone()));
        }
    }
    let smooth = sample.smooth_share();
    if smooth < SURFACES {
        let why = format!(
            "clouds: {:.0} % of neighbouring points have like depths; it is about 90 % of scans, so these depths are noise \
             or are read in a wrong order",
            100.0 * smooth
        );
        examination.remarks.push(Remark::Odd(why));
    }
    let Some(&first) = sample.anchors.first() else {
        return examination;
    };
    let cloud = sample.seen(first).map(|(photo, seen)| picture::cloud_on(photo, &seen));
    examination.picture = route::below(cloud, &poses);
    examination.compared = sample.anchors.clone();
    let (agreement, fit, finding) = sample.diagnose();
    examination.agreement = Some(agreement);
    // Coarse clouds look turned, shifted or of another camera by chance.
    examination.coarse_step_m = scene.cloud_facts().coarse_step_m;
    if examination.coarse_step_m.is_none() {
        examination.fit = Some(fit);
        examination.finding = finding;
    }
    examination
}
