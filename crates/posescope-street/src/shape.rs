//! The geometry of the solids of the town.

use nalgebra::{Point3, Vector3};

use super::car::CarShape;
use super::contact::Contact;
use super::frame::{Frame, Ray};
use super::intersect::{meet_block, meet_clump, meet_gable, meet_pole};
use super::path::right_of;

/// The geometry of a solid.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// A box: `half` is its half width, its height and its half depth.
    Block {
        /// Its frame, origin at the middle of the base.
        frame: Frame,
        /// Half width, height, half depth \[m\].
        half: Vector3<f64>,
    },
    /// A roof with the ridge along x: half length, rise, half depth.
    Gable {
        /// Its frame, origin at the middle of the base.
        frame: Frame,
        /// Half length of the ridge, rise, half depth \[m\].
        half: Vector3<f64>,
    },
    /// An upright cylinder.
    Pole {
        /// Middle of the base.
        base: Point3<f64>,
        /// Radius of the cylinder \[m\].
        radius: f64,
        /// Height of the cylinder \[m\].
        height: f64,
    },
    /// A spheroid with a vertical axis.
    Clump {
        /// Its centre.
        centre: Point3<f64>,
        /// Horizontal radius \[m\].
        radius: f64,
        /// Vertical radius \[m\].
        half_height: f64,
    },
    /// A car.
    Car {
        /// Its frame, z to its nose, origin on the road.
        frame: Frame,
        /// Its body; boxed, as it is far larger than the other shapes.
        shape: Box<CarShape>,
    },
}

impl Shape {
    /// The smallest box around the solid that is parallel to the axes: least and greatest corner.
    pub(super) fn bounds(&self) -> [Point3<f64>; 2] {
        let around = |frame: &Frame, half: Vector3<f64>| {
            let right = right_of(frame.ahead);
            let reach = |r: f64, a: f64| half.x * r.abs() + half.z * a.abs();
            let (x, z) = (reach(right.x, frame.ahead.x), reach(right.y, frame.ahead.y));
            [frame.origin - Vector3::new(x, 0.0, z), frame.origin + Vector3::new(x, half.y, z)]
        };
        match self {
            Self::Block { frame, half } | Self::Gable { frame, half } => around(frame, *half),
            Self::Pole { base, radius, height } => [
                base - Vector3::new(*radius, 0.0, *radius),
                base + Vector3::new(*radius, *height, *radius),
            ],
            Self::Clump { centre, radius, half_height } => {
                let reach = Vector3::new(*radius, *half_height, *radius);
                [centre - reach, centre + reach]
            }
            Self::Car { frame, shape } => around(frame, shape.half_extent()),
        }
    }

    /// The first contact with a distance in `from` … `to`.
    #[inline]
    pub(super) fn meet(&self, ray: &Ray, from: f64, to: f64) -> Option<Contact> {
        let contact = match self {
            Self::Block { frame, half } => meet_block(frame, *half, ray, from),
            Self::Gable { frame, half } => meet_gable(frame, *half, ray, from),
            Self::Pole { base, radius, height } => meet_pole(*base, *radius, *height, ray, from),
            Self::Clump { centre, radius, half_height } => {
                meet_clump(*centre, *radius, *half_height, ray, from)
            }
            Self::Car { frame, shape } => {
                let mut contact = shape.meet(&frame.ray_to_local(ray), from)?;
                contact.normal = frame.vector_to_town(&contact.normal);
                Some(contact)
            }
        };
        contact.filter(|c| c.distance < to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Part;
    use nalgebra::{Point2, Vector2};
    use proptest::prelude::*;

    fn frame() -> Frame {
        Frame::new(Point2::new(1.0, 10.0), 0.5, Vector2::new(0.6, 0.8))
    }

    fn shapes() -> Vec<Shape> {
        let half = Vector3::new(2.0, 3.0, 1.5);
        vec![
            Shape::Block { frame: frame(), half },
            Shape::Gable { frame: frame(), half },
            Shape::Pole { base: frame().origin, radius: 1.2, height: 3.0 },
            Shape::Clump { centre: Point3::new(1.0, 2.0, 10.0), radius: 2.0, half_height: 1.3 },
            Shape::Car { frame: frame(), shape: Box::new(CarShape::new(5)) },
        ]
    }

    #[test]
    fn the_front_of_a_block_is_met_at_its_distance() {
        let half = Vector3::new(2.0, 3.0, 1.0);
        let frame = Frame::new(Point2::new(0.0, 10.0), 0.0, -Vector2::y());
        let ray = Ray { origin: Point3::new(0.5, 1.0, 0.0), direction: Vector3::z() };
        let contact = Shape::Block { frame, half }.meet(&ray, 0.0, 100.0).expect("in the way");
        assert!((contact.distance - 9.0).abs() < 1e-12);
        assert_eq!(contact.part, Part::Front);
        assert!((contact.normal + Vector3::z()).norm() < 1e-12);
        // Seen from the front, u grows to the viewer's right.
        assert!((contact.uv - Vector2::new(2.5, 1.0)).norm() < 1e-12);
    }

    proptest! {
        #[test]
        fn contacts_lie_in_the_bounds_and_face_the_ray(
            x in -20.0..20.0, y in 0.0..8.0, z in -10.0..5.0,
            tx in -2.0..4.0, ty in 0.0..4.0, tz in 8.0..12.0,
        ) {
            let origin = Point3::new(x, y, z);
            let direction = (Point3::new(tx, ty, tz) - origin).normalize();
            let ray = Ray { origin, direction };
            for shape in shapes() {
                if let Some(contact) = shape.meet(&ray, 0.0, f64::INFINITY) {
                    let p = ray.at(contact.distance);
                    let [low, high] = shape.bounds();
                    for axis in 0..3 {
                        prop_assert!(low[axis] - 1e-6 <= p[axis] && p[axis] <= high[axis] + 1e-6);
                    }
                    // The panels of a car bulge, so that their normals lean.
                    let lean = if matches!(shape, Shape::Car { .. }) { 0.4 } else { 1e-9 };
                    prop_assert!(contact.normal.dot(&direction) <= lean, "{shape:?}");
                    prop_assert!((contact.normal.norm() - 1.0).abs() < 1e-6);
                }
            }
        }
    }
}
