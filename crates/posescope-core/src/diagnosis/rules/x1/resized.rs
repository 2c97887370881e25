//! Matches of another system whose keypoints are those of resized photos.

use super::*;
use crate::features::{Features, PairMatches};

/// Fewer keypoints may lie in one corner by chance.
const FEW_KEYPOINTS: usize = 30;
/// All keypoints of a resized photo lie within this share of its width and height.
const MOST: f64 = 0.85;
/// Factors of width and height that differ by less are one factor.
const SAME_FACTOR: f64 = 0.03;

/// All keypoints of both photos lie in the upper left, far from the right and the lower border.
pub(super) fn resized(case: &Case<'_>) -> Option<Diagnosis> {
    let problem = case.subject.problem;
    let Some(PairMatches::Found(found)) = problem.matches().map(|matches| &**matches) else {
        return None;
    };
    if case.responsible != Method::FB {
        return None;
    }
    let query = corner(&found.query, &problem.query.intrinsics)?;
    let reference = corner(&found.reference, &problem.reference.intrinsics)?;
    Some(RULE.found(&Resized { query, reference }))
}

/// The part of a photo in which all keypoints lie.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Corner {
    keypoints: usize,
    /// The size of the part \[px\].
    part: [u32; 2],
    /// The size of the photo \[px\].
    photo: [u32; 2],
}

impl Corner {
    fn factors(&self) -> [f64; 2] {
        [0, 1].map(|side| f64::from(self.part[side]) / f64::from(self.photo[side]))
    }

    fn words(&self) -> String {
        let Self { keypoints, part: [w, h], photo: [width, height] } = self;
        format!("{keypoints} in the upper left {w} x {h} of {width} x {height} pixels")
    }
}

fn corner(features: &Features, camera: &Intrinsics) -> Option<Corner> {
    let side = |least: f32| least.max(0.0).ceil() as u32 + 1;
    let keypoints = &features.keypoints;
    let part = [
        side(keypoints.iter().map(|keypoint| keypoint.x).fold(0.0, f32::max)),
        side(keypoints.iter().map(|keypoint| keypoint.y).fold(0.0, f32::max)),
    ];
    let found = Corner { keypoints: keypoints.len(), part, photo: [camera.width, camera.height] };
    let is_small = found.factors().iter().all(|&factor| factor < MOST);
    (keypoints.len() >= FEW_KEYPOINTS && is_small).then_some(found)
}

evidence!(Resized { query: Corner, reference: Corner } => {
    let [x, y] = query.factors();
    let factor = if (x - y).abs() < SAME_FACTOR {
        format!("{:.2}", x.max(y))
    } else {
        format!("{x:.2} in width and {y:.2} in height")
    };
    format!(
        "The matches seem to be of photos resized by about {factor}: all keypoints of the query lie far from the right \
         and the lower border, {}, and so do those of the reference, {}.",
        query.words(), reference.words()
    )
});

#[cfg(test)]
mod tests {
    use super::*;

    fn corner_of(size: [u32; 2]) -> Option<Corner> {
        let camera = Intrinsics { fx: 1.0, fy: 1.0, cx: 0.0, cy: 0.0, width: 1296, height: 1936 };
        // A grid that fills a photo of this size.
        let places: Vec<[f32; 2]> = (0..64)
            .map(|at| {
                let [x, y] = [at % 8, at / 8].map(|step| step as f32 / 7.0);
                [x * (size[0] - 2) as f32, y * (size[1] - 2) as f32]
            })
            .collect();
        let none = vec![None; places.len()];
        let found = crate::features::FoundMatches::new(&places, &places, &none);
        corner(&found.query, &camera)
    }

    #[test]
    fn keypoints_of_a_resized_photo_lie_in_its_upper_left() {
        let found = corner_of([640, 480]).expect("a corner");
        assert_eq!(found.part, [639, 479]);
        assert!(corner_of([1296, 1936]).is_none());
        // The upper half of a photo is no photo of its own.
        assert!(corner_of([1296, 900]).is_none());
        let half = corner_of([648, 968]).expect("a corner");
        let said = Resized { query: half, reference: half }.to_string();
        assert!(said.contains("resized by about 0.50: "), "{said}");
        let said = Resized { query: found, reference: found }.to_string();
        assert!(said.contains("0.49 in width and 0.25 in height"), "{said}");
    }
}
