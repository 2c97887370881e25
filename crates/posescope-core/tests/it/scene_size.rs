//! The size of a scene follows from its clouds and poses.

use posescope_core::scene::{Lengths, Scene, SceneSize};

use crate::walls_scene::Walls;

/// The walls, with lengths of another kind.
struct Measured(Walls, Lengths);

impl Scene for Measured {
    posescope_core::inner_scene!(0: name, frames, intrinsics, pose, time_s, has_cloud, photo, cloud);

    fn lengths(&self) -> Lengths {
        self.1
    }
}

#[test]
fn a_scene_is_measured_unless_it_is_a_street() {
    assert_eq!(SceneSize::of(&Walls::new()), SceneSize::PAPER);
    let size = SceneSize::of(&Measured(Walls::new(), Lengths::Metres));
    let depth_m = size.depth_m.expect("there are clouds");
    assert!((16.0..17.0).contains(&depth_m), "{depth_m}");
    assert!(size.scale.is_paper());
    // Consecutive frames are 1, 0.5, 0.3 and 0.6 m apart, all with one heading.
    let spacing_m = size.spacing_m.expect("there are poses");
    assert!((0.5..=0.6).contains(&spacing_m), "{spacing_m}");
    assert_eq!((size.turn_deg, size.extent_m), (Some(0.0), Some(1.0)));
    assert_eq!(size.radius_m(), 15.0);
    let model = SceneSize::of(&Measured(Walls::new(), Lengths::Model));
    assert!(!model.scale.is_metric());
}
