//! The place of a camera as text, for views, logs and recordings: sides are named instead of signs.

use crate::geometry::Pose;

/// The place of a camera in the reference camera's frame.
pub(crate) fn place(reference_from_camera: &Pose) -> String {
    let along = |value: f64, positive: &str, negative: &str| {
        let word = if value <= -0.005 { negative } else { positive };
        format!("{:.2} m {word}", value.abs())
    };
    let shift = &reference_from_camera.translation.vector;
    let ahead = reference_from_camera.rotation * nalgebra::Vector3::z();
    let yaw = (-ahead.x).atan2(ahead.z).to_degrees();
    let mut words = vec![along(shift.x, "right", "left"), along(shift.z, "ahead", "behind")];
    // The search keeps the height fixed; a hand-held camera may have another.
    if shift.y.abs() >= 0.005 {
        words.push(along(-shift.y, "up", "down"));
    }
    let turn = if yaw <= -0.005 { "right" } else { "left" };
    words.push(format!("turned {:.2}° {turn}", yaw.abs()));
    words.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::yaw;
    use nalgebra::Translation3;

    #[test]
    fn a_place_is_told_in_words_with_the_height_only_where_it_differs() {
        let turned = Pose::from_parts(Translation3::new(-0.4, 0.0, 1.2), yaw(0.01));
        assert_eq!(place(&turned), "0.40 m left, 1.20 m ahead, turned 0.57° left");
        let raised = Pose::translation(0.0, -0.2, -3.0);
        let words = "0.00 m right, 3.00 m behind, 0.20 m up, turned 0.00° left";
        assert_eq!(place(&raised), words);
    }
}
