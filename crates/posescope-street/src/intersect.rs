//! Where rays meet boxes, roofs, cylinders and spheroids. All functions return the first contact
//! beyond the distance `from`.

use nalgebra::{Point3, Vector2, Vector3};

use super::contact::{Contact, Part};
use super::frame::{Frame, Ray};

/// A half-space `normal · p ≤ offset`.
pub(super) type Plane = (Vector3<f64>, f64);

/// Where a ray is inside a convex polyhedron: distances, each with the index of its plane.
#[inline]
pub(super) fn clip<'a>(
    ray: &Ray,
    planes: impl Iterator<Item = &'a Plane>,
) -> Option<[(f64, usize); 2]> {
    let mut enter = (f64::NEG_INFINITY, 0);
    let mut leave = (f64::INFINITY, 0);
    for (index, (normal, offset)) in planes.enumerate() {
        let slope = normal.dot(&ray.direction);
        let gap = offset - normal.dot(&ray.origin.coords);
        if slope < 0.0 {
            let t = gap / slope;
            if t > enter.0 {
                enter = (t, index);
            }
        } else if slope > 0.0 {
            let t = gap / slope;
            if t < leave.0 {
                leave = (t, index);
            }
        } else if gap < 0.0 {
            return None;
        }
        if enter.0 > leave.0 {
            return None;
        }
    }
    Some([enter, leave])
}

/// Of the two ends of an interval inside a convex solid, the first beyond `from`.
#[inline]
pub(super) fn first_beyond<T: Copy>([enter, leave]: [(f64, T); 2], from: f64) -> Option<(f64, T)> {
    if enter.0 > from { Some(enter) } else { (leave.0 > from).then_some(leave) }
}

/// Where a ray meets a box of half width, height and half depth `half`.
pub(super) fn meet_block(
    frame: &Frame,
    half: Vector3<f64>,
    ray: &Ray,
    from: f64,
) -> Option<Contact> {
    let local = frame.ray_to_local(ray);
    let (low, high) = ([-half.x, 0.0, -half.z], [half.x, half.y, half.z]);
    let mut enter = (f64::NEG_INFINITY, 0);
    let mut leave = (f64::INFINITY, 0);
    for axis in 0..3 {
        let inverse = local.direction[axis].recip();
        let a = (low[axis] - local.origin[axis]) * inverse;
        let b = (high[axis] - local.origin[axis]) * inverse;
        let (near, far) = if a < b { (a, b) } else { (b, a) };
        if near > enter.0 {
            enter = (near, axis);
        }
        if far < leave.0 {
            leave = (far, axis);
        }
    }
    if enter.0 > leave.0 {
        return None;
    }
    let (distance, axis) = first_beyond([enter, leave], from)?;
    let p = local.at(distance);
    let positive = p[axis] > 0.5 * (low[axis] + high[axis]);
    let sign = if positive { 1.0 } else { -1.0 };
    let mut normal = Vector3::zeros();
    normal[axis] = sign;
    let (u, v, part) = match (axis, positive) {
        (0, _) => (half.z + sign * p.z, p.y, Part::Side),
        (1, _) => (half.x + p.x, half.z + p.z, Part::Flat),
        (_, true) => (half.x - p.x, p.y, Part::Front),
        (_, false) => (half.x + p.x, p.y, Part::Back),
    };
    Some(Contact { distance, normal: frame.vector_to_town(&normal), uv: Vector2::new(u, v), part })
}

/// Where a ray meets a roof of half ridge, rise and half depth `half`.
pub(super) fn meet_gable(
    frame: &Frame,
    half: Vector3<f64>,
    ray: &Ray,
    from: f64,
) -> Option<Contact> {
    let local = frame.ray_to_local(ray);
    let slope = Vector2::new(half.z, half.y).normalize();
    let planes = [
        (Vector3::new(0.0, slope.x, slope.y), slope.x * half.y),
        (Vector3::new(0.0, slope.x, -slope.y), slope.x * half.y),
        (Vector3::x(), half.x),
        (-Vector3::x(), half.x),
        (-Vector3::y(), 0.0),
    ];
    let (distance, plane) = first_beyond(clip(&local, planes.iter())?, from)?;
    let p = local.at(distance);
    let (uv, part) = match plane {
        0 | 1 => (Vector2::new(half.x + p.x, p.y / slope.y), Part::Slope),
        2 | 3 => (Vector2::new(half.z + p.z, p.y), Part::Side),
        _ => (Vector2::new(half.x + p.x, half.z + p.z), Part::Flat),
    };
    Some(Contact { distance, normal: frame.vector_to_town(&planes[plane].0), uv, part })
}

/// Where a ray meets an upright cylinder.
pub(super) fn meet_pole(
    base: Point3<f64>,
    radius: f64,
    height: f64,
    ray: &Ray,
    from: f64,
) -> Option<Contact> {
    let origin = ray.origin - base;
    let direction = ray.direction;
    let a = direction.x * direction.x + direction.z * direction.z;
    let b = origin.x * direction.x + origin.z * direction.z;
    let c = origin.x * origin.x + origin.z * origin.z - radius * radius;
    let discriminant = b * b - a * c;
    if discriminant < 0.0 || a == 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    let level = |y: f64| (y - origin.y) / direction.y;
    let (bottom, top) = (level(0.0), level(height));
    let enter_caps = (bottom.min(top), true);
    let leave_caps = (bottom.max(top), true);
    let enter_skin = ((-b - root) / a, false);
    let leave_skin = ((-b + root) / a, false);
    let later = |a: (f64, bool), b: (f64, bool)| if a.0 > b.0 { a } else { b };
    let sooner = |a: (f64, bool), b: (f64, bool)| if a.0 < b.0 { a } else { b };
    let interval = [later(enter_skin, enter_caps), sooner(leave_skin, leave_caps)];
    if interval[0].0 > interval[1].0 {
        return None;
    }
    let (distance, cap) = first_beyond(interval, from)?;
    let p = origin + direction * distance;
    if cap {
        return Some(Contact {
            distance,
            normal: Vector3::y() * if p.y > 0.5 * height { 1.0 } else { -1.0 },
            uv: Vector2::new(p.x, p.z),
            part: Part::Flat,
        });
    }
    let normal = Vector3::new(p.x / radius, 0.0, p.z / radius);
    Some(Contact {
        distance,
        normal,
        // Arc length is not needed: textures of round things only must not stretch visibly.
        uv: Vector2::new(diamond_angle(normal.x, normal.z) * radius, p.y),
        part: Part::Round,
    })
}

/// A monotonic substitute for the angle of a unit vector: 0 … 2π in four smooth arcs.
fn diamond_angle(x: f64, z: f64) -> f64 {
    let quarter = std::f64::consts::FRAC_PI_2;
    let fraction = z.abs() / (x.abs() + z.abs());
    match (x >= 0.0, z >= 0.0) {
        (true, true) => quarter * fraction,
        (false, true) => quarter * (2.0 - fraction),
        (false, false) => quarter * (2.0 + fraction),
        (true, false) => quarter * (4.0 - fraction),
    }
}

/// Where a ray meets a spheroid.
pub(super) fn meet_clump(
    centre: Point3<f64>,
    radius: f64,
    half_height: f64,
    ray: &Ray,
    from: f64,
) -> Option<Contact> {
    let scale = Vector3::new(radius.recip(), half_height.recip(), radius.recip());
    let origin = (ray.origin - centre).component_mul(&scale);
    let direction = ray.direction.component_mul(&scale);
    let a = direction.norm_squared();
    let b = origin.dot(&direction);
    let discriminant = b * b - a * (origin.norm_squared() - 1.0);
    if discriminant < 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    let (distance, ()) = first_beyond([((-b - root) / a, ()), ((-b + root) / a, ())], from)?;
    let sphere = origin + direction * distance;
    Some(Contact {
        distance,
        normal: sphere.component_mul(&scale).normalize(),
        uv: Vector2::new(sphere.x, sphere.y),
        part: Part::Round,
    })
}
