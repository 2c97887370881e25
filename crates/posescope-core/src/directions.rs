//! Shifts and turns of a camera in words, in its own frame (x right, y down, z forward).

/// Parts of less than this share of the whole are not named.
const TELLING: f64 = 0.15;

/// The parts of a shift that matter \[m\], as "1.00 m right, 0.30 m down".
pub(crate) fn of_shift(shift_m: [f64; 3]) -> String {
    parts(shift_m, " m", [["left", "right"], ["up", "down"], ["back", "forward"]])
}

/// The parts of a turn that matter, about x, y and z \[°\], as where the camera looks to: "4.00° up, 2.00° right".
pub(crate) fn of_turn(turn_deg: [f64; 3]) -> String {
    parts(turn_deg, "°", [["down", "up"], ["left", "right"], ["anticlockwise", "clockwise"]])
}

fn parts(of: [f64; 3], unit: &str, names: [[&str; 2]; 3]) -> String {
    let whole = of.iter().map(|part| part * part).sum::<f64>().sqrt();
    let telling = of.iter().zip(names).filter(|(part, _)| part.abs() >= TELLING * whole);
    let words = telling.map(|(part, [less, more])| {
        format!("{:.2}{unit} {}", part.abs(), if *part < 0.0 { less } else { more })
    });
    words.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::geometry::Pose;

    #[test]
    fn small_parts_are_not_named() {
        assert_eq!(of_shift([-1.0, 0.5, 0.1]), "1.00 m left, 0.50 m down");
        assert_eq!(of_shift([0.0, 0.0, -2.0]), "2.00 m back");
    }

    #[test]
    fn a_turn_is_named_by_where_the_camera_looks_to() {
        let looks_to = |turn_deg: [f64; 3]| {
            Pose::rotation(Vector3::from(turn_deg).map(f64::to_radians)) * Vector3::z()
        };
        assert!(looks_to([9.0, 0.0, 0.0]).y < 0.0);
        assert_eq!(of_turn([9.0, 0.0, 0.0]), "9.00° up");
        assert!(looks_to([0.0, 9.0, 0.0]).x > 0.0);
        assert_eq!(of_turn([0.0, 9.0, 0.0]), "9.00° right");
        // What was to the right of the camera is below it then.
        let turned = Pose::rotation(Vector3::z() * 9_f64.to_radians()) * Vector3::x();
        assert!(turned.y > 0.0);
        assert_eq!(of_turn([0.0, 0.0, 9.0]), "9.00° clockwise");
    }
}
