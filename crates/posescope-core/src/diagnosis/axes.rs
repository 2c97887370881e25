//! The other ways to name the axes of a camera or a world.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

/// The camera axes of OpenGL, and those of a vehicle (forward, left, up), as [`other_axes`] writes them.
pub const OPENGL_AXES: &str = "(x, -y, -z)";
/// See [`OPENGL_AXES`].
pub const VEHICLE_AXES: &str = "(z, -x, -y)";

/// All other right-handed orders and signs of three axes. A name says what the axes of the other system are in those
/// of a camera here, or those of the world here in its own: the camera axes of OpenGL are `(x, -y, -z)`.
pub fn other_axes() -> Vec<(String, UnitQuaternion<f64>)> {
    const ORDERS: [[usize; 3]; 6] =
        [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let mut all = Vec::new();
    for order in ORDERS {
        for signs in 0..8 {
            let sign = |row: usize| if (signs >> row) & 1 == 0 { 1.0 } else { -1.0 };
            let mut matrix = Matrix3::zeros();
            for (row, &column) in order.iter().enumerate() {
                matrix[(row, column)] = sign(row);
            }
            if matrix.determinant() < 0.0 || matrix == Matrix3::identity() {
                continue;
            }
            let name = |row: usize| {
                let minus = if sign(row) < 0.0 { "-" } else { "" };
                format!("{minus}{}", ["x", "y", "z"][order[row]])
            };
            let rotation = Rotation3::from_matrix_unchecked(matrix);
            let axes = format!("({}, {}, {})", name(0), name(1), name(2));
            all.push((axes, UnitQuaternion::from_rotation_matrix(&rotation)));
        }
    }
    all
}
