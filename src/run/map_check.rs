//! Whether a map can be believed: what `posescope doctor` says of it decides whether its poses have a confidence, and
//! which.
//!
//! Where clouds, photos, cameras and poses do not fit together, matches and costs agree on poses that are wrong, and
//! nothing that a method leaves behind tells. How closely they fit, pairs of the map's own frames tell. The answer is kept
//! in the user's cache and stays until the map changes.

use std::hash::Hasher as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use posescope_core::files::{self, write_whole};
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::Xxh3;

use crate::diagnosis::confidence::NEAR;
use crate::doctor::{self, FramePair};
use crate::geometry::Pose;
use crate::grid::Reach;
use crate::scale::Scale;
use crate::scene::{Scene, SceneSize, cache_file, format_of, street};
use posescope_core::survey::FramePairs;

/// The version of the file.
const SCHEMA: &str = "posescope.map-check/3";

/// Fewer pairs of frames say nothing.
const LEAST_PAIRS: usize = 6;

/// How far off near pairs of frames are in generated towns, over what the noise of their features explains: the medians of
/// position and rotation (`studies calibration --frame-pairs`).
const IN_TOWNS: [f64; 2] = [1.2, 0.75];

/// Clouds whose points tell one state of a map from another.
const CLOUDS: usize = 3;

/// What is known of a map.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapFit {
    /// What is wrong with it, in a phrase; `None` where `posescope doctor` finds nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mistake: Option<String>,
    /// How closely pairs of its frames fit each other, and what searches reach; `None` where too few share features.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame_pairs: Option<FramePairs>,
}

impl MapFit {
    /// What `posescope doctor` finds.
    pub fn of(scene: &dyn Scene) -> Self {
        let (mistake, pairs) = doctor::fit(scene);
        let size = SceneSize::of(scene);
        Self {
            mistake: mistake.map(|found| found.mistake.about().to_owned()),
            frame_pairs: compared(&pairs, size.scale)
                .map(|pairs| FramePairs { reach: reach(scene, &size), ..pairs }),
        }
    }
}

/// How closely pairs of frames fit each other at a scale; `None` where they are too few.
fn compared(pairs: &[FramePair], scale: Scale) -> Option<FramePairs> {
    let near: Vec<&FramePair> =
        pairs.iter().filter(|pair| NEAR.at(scale).contains(&pair.error)).collect();
    let factor = |over: fn(&FramePair) -> f64, in_towns: f64| {
        let all = near.iter().map(|pair| over(pair));
        // Nothing off, of features without noise, is no ratio.
        let mut all: Vec<f64> = all.filter(|ratio| !ratio.is_nan()).collect();
        all.sort_by(f64::total_cmp);
        let median = all.get(all.len() / 2).copied().unwrap_or(in_towns);
        // As people read it.
        (100.0 * (median / in_towns).clamp(1.0, 100.0)).round() / 100.0
    };
    (pairs.len() >= LEAST_PAIRS).then(|| FramePairs {
        pairs: pairs.len(),
        near: near.len(),
        position: factor(|pair| pair.error.translation_m / pair.within.translation_m, IN_TOWNS[0]),
        rotation: factor(|pair| pair.error.rotation_deg / pair.within.rotation_deg, IN_TOWNS[1]),
        reach: Reach::ALL,
    })
}

/// What a search with three freedoms reaches of the ways between a map's cameras, at its scale and usual radius.
fn reach(scene: &dyn Scene, size: &SceneSize) -> Reach {
    let scale = size.scale;
    let cameras: Vec<Pose> =
        (0..scene.frames().len()).filter_map(|frame| scene.pose(frame)).collect();
    let depth_m = size.depth_m.unwrap_or(scale.least_depth());
    Reach::among(&cameras, scale.radius(), NEAR.at(scale), depth_m)
}

/// What was found in a map.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MapCheck {
    schema: String,
    /// The version of posescope.
    version: String,
    /// What the map holds.
    content: String,
    fit: MapFit,
}

impl MapCheck {
    fn new(content: String, fit: MapFit) -> Self {
        let version = env!("CARGO_PKG_VERSION").to_owned();
        Self { schema: SCHEMA.to_owned(), version, content, fit }
    }

    /// What was found before, if the map and posescope are the same.
    fn read(path: &Path, content: &str) -> Option<Self> {
        let text = files::read_text(path, files::DESCRIPTION).ok()?;
        let known: Self = toml::from_str(&text).ok()?;
        let expected = Self::new(content.to_owned(), known.fit.clone());
        let is_sound = known.fit.frame_pairs.is_none_or(|pairs| pairs.is_sound());
        (known == expected && is_sound).then_some(known)
    }

    /// Keeps it. A cache that cannot be written only costs time.
    fn write(&self, path: &Path) {
        let text = toml::to_string(self).unwrap_or_default();
        let folder = path.parent().map_or(Ok(()), std::fs::create_dir_all);
        if let Err(error) = folder.and_then(|()| write_whole(path, text.as_bytes())) {
            log::debug!("{}: {error}", path.display());
        }
    }
}

/// What `posescope doctor` finds of the map of a scene; nothing of scenes without clouds, and of generated ones. `examines`
/// is asked where that is not known yet; if it declines, it stays unknown.
pub fn fit_of_map(scene: &dyn Scene, argument: &str, examines: impl FnOnce() -> bool) -> MapFit {
    let format = format_of(argument, None);
    let is_generated = format.is_some_and(|format| format.name == street::ENTRY.name);
    if is_generated || !(0..scene.frames().len()).any(|frame| scene.has_cloud(frame)) {
        return MapFit::default();
    }
    let content = content(scene);
    let path = cache_file("map-check", "toml", scene, argument);
    let known = path.as_deref().and_then(|path| MapCheck::read(path, &content));
    if known.is_none() && !examines() {
        return MapFit::default();
    }
    let check = known.unwrap_or_else(|| {
        // Nobody asked for it, so a map that cannot be examined is none with a mistake.
        let fit = catch_unwind(AssertUnwindSafe(|| MapFit::of(scene))).unwrap_or_default();
        let check = MapCheck::new(content, fit);
        path.iter().for_each(|path| check.write(path));
        check
    });
    check.fit
}

/// What is said where a map has a mistake.
pub fn mistake_line(scene: &dyn Scene, mistake: &str) -> String {
    format!(
        "{}: {mistake}; poses have no confidence until that is mended (`posescope doctor` says more)",
        scene.name()
    )
}

/// The line that tells users that confidence follows how closely a map's frames fit each other.
pub fn frame_pairs_line(argument: &str, pairs: &FramePairs) -> String {
    let FramePairs { pairs, near, position, .. } = pairs;
    format!(
        "Confidence follows how closely the map's frames fit each other (the poses of {near} of {pairs} pairs are near what \
         their features say, {position} times as far off as those of a generated town); `posescope survey {argument}` says \
         more"
    )
}

/// What a map holds, as far as three of its clouds, all poses and cameras tell.
fn content(scene: &dyn Scene) -> String {
    let mut sum = Xxh3::new();
    sum.update(&scene.fingerprint().to_le_bytes());
    let frames = scene.frames().len();
    let with_cloud: Vec<usize> = (0..frames).filter(|&frame| scene.has_cloud(frame)).collect();
    let step = with_cloud.len().div_ceil(CLOUDS).max(1);
    for &frame in with_cloud.iter().step_by(step) {
        if let Ok(photo) = scene.photo(frame) {
            sum.update(photo.gray.as_raw());
        }
        for point in scene.cloud(frame).iter().flat_map(|cloud| &cloud.points) {
            for part in point.iter() {
                sum.update(&part.to_le_bytes());
            }
        }
    }
    format!("{:016x}", sum.finish())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::Tolerance;
    use crate::geometry::PoseError;

    /// A pair that is off by so much, where the noise of its features explains 0.01 m and 0.1°.
    fn pair(translation_m: f64, rotation_deg: f64) -> FramePair {
        FramePair {
            error: PoseError { translation_m, rotation_deg, max_euler_deg: rotation_deg },
            within: Tolerance { translation_m: 0.01, rotation_deg: 0.1 },
        }
    }

    #[test]
    fn pairs_say_how_many_are_near_and_how_much_farther_off_than_noise() {
        let mut pairs = vec![pair(0.06, 0.075); 8];
        pairs.extend([pair(0.3, 0.1), pair(0.02, 9.0)]);
        let room = compared(&pairs, Scale::of_depth(1.8, true)).expect("enough");
        // Near is within 0.1 m and 5° there. In towns, positions are off 1.2 times as far as noise.
        assert_eq!((room.pairs, room.near), (10, 8));
        assert_eq!((room.position, room.rotation), (5.0, 1.0));
        assert_eq!(compared(&pairs, Scale::PAPER).map(|pairs| pairs.near), Some(9));
        // No map is better than generated ones, and few pairs say nothing.
        let close = compared(&[pair(0.001, 0.001); 6], Scale::PAPER).expect("enough");
        assert_eq!((close.position, close.rotation), (1.0, 1.0));
        assert_eq!(compared(&pairs[..5], Scale::PAPER), None);
        // Frames that agree to the last bit, of features without noise, leave nothing to divide.
        let exact = FramePair {
            within: Tolerance { translation_m: 0.0, rotation_deg: 0.0 },
            ..pair(0.0, 0.0)
        };
        let exact = compared(&[exact; 6], Scale::PAPER).expect("enough");
        assert!(exact.is_sound() && (exact.position, exact.rotation) == (1.0, 1.0), "{exact:?}");
    }
}
