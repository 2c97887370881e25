//! A traversal of the street as a scene.

use super::{Condition, Size, Traversal};
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;
use crate::image::Photo;
use crate::scene::{Entry, Scene, SceneError};

pub(in crate::scene) const ENTRY: Entry = Entry {
    name: "street",
    about: "the built-in street: street, or street:overcast",
    recognizes: |argument| argument.split(':').next() == Some(NAME),
    open: |argument| Ok(Box::new(Street::open(argument)?)),
};

const NAME: &str = "street";

/// The town that everybody sees: results on the street can be compared because it is one street.
const WORLD_SEED: u64 = 7;

/// Time between two frames, about 1 m apart at the speed of a town \[s\].
const FRAME_INTERVAL_S: f64 = 0.1;

/// The conditions by their names.
const CONDITIONS: &[(&str, Condition)] = &[
    ("overcast", Condition::Overcast),
    ("sun", Condition::Sun),
    ("night", Condition::Night),
    ("rain", Condition::Rain),
    ("snow", Condition::Snow),
];

/// A traversal of the street; frames are made when they are asked for.
pub struct Street {
    name: String,
    frames: Vec<String>,
    traversal: Traversal,
}

impl Street {
    /// Opens `street` or `street:CONDITION`.
    ///
    /// # Errors
    /// When there is no such condition.
    pub fn open(argument: &str) -> Result<Self, SceneError> {
        let wanted = argument.split_once(':').map(|(_, condition)| condition);
        let &(name, condition) = CONDITIONS
            .iter()
            .find(|(name, _)| wanted.is_none_or(|wanted| wanted == *name))
            .ok_or_else(|| SceneError::UnknownCondition {
                argument: argument.to_owned(),
                known: CONDITIONS
                    .iter()
                    .map(|(name, _)| *name)
                    .collect::<Vec<_>>()
                    .join(", "),
            })?;
        let traversal = Traversal::new(WORLD_SEED, condition, Size::Full);
        Ok(Self {
            name: format!("{NAME}:{name}"),
            frames: (0..traversal.frame_count())
                .map(|frame| format!("{frame:06}"))
                .collect(),
            traversal,
        })
    }
}

impl Scene for Street {
    fn name(&self) -> &str {
        &self.name
    }

    fn frames(&self) -> &[String] {
        &self.frames
    }

    fn intrinsics(&self) -> Intrinsics {
        self.traversal.intrinsics()
    }

    fn pose(&self, frame: usize) -> Option<Pose> {
        Some(self.traversal.world_from_camera(frame))
    }

    fn time_s(&self, frame: usize) -> Option<f64> {
        Some(frame as f64 * FRAME_INTERVAL_S)
    }

    fn has_cloud(&self, _frame: usize) -> bool {
        true
    }

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        Ok(Photo::from_color(self.traversal.image(frame)))
    }

    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        let points = self.traversal.cloud(frame);
        Ok(Cloud {
            points: points.into_iter().map(|point| point.position).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;

    #[test]
    fn the_street_is_overcast_unless_told_otherwise() {
        let plain = scene::open("street", None).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(plain.name(), "street:overcast");
        assert!(plain.frames().len() > 600);
        let error = scene::open("street:fog", None).err().map(|e| e.to_string());
        let error = error.unwrap_or_default();
        assert!(error.contains("overcast"), "{error}");
    }

    #[test]
    fn frames_are_about_a_metre_apart_and_have_everything() {
        let street = Street::open("street").unwrap_or_else(|error| panic!("{error}"));
        let at = |frame| street.pose(frame).map(|pose| pose.translation.vector);
        let step = at(101).zip(at(100)).map(|(a, b)| (a - b).norm());
        assert!(
            step.is_some_and(|step| (0.5..1.5).contains(&step)),
            "{step:?}"
        );
        let scene: &dyn Scene = &street;
        let tuple = scene
            .reference(100)
            .unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(tuple.photo.dimensions(), (1241, 376));
        assert!(tuple.cloud.len() > 50_000);
    }
}
