//! The shape of a parked car: two convex polyhedra and four wheels.

use nalgebra::{Point3, Vector2, Vector3};

use super::contact::{Contact, Part};
use super::frame::Ray;
use super::intersect::{Plane, clip, first_beyond};
use super::noise::{derive, unit};

const WHEEL_RADIUS: f64 = 0.32;
const WHEEL_WIDTH: f64 = 0.2;
/// Height of the lower edge of the body \[m\].
const SILL: f64 = 0.2;
/// The parts of a car reach less far beyond its length, its width and their heights \[m\].
const SLACK: f64 = 0.1;

/// The shape of a car in its own frame: x right, y up, z to the nose; origin on the road below
/// its middle \[m\].
#[derive(Clone, Debug)]
pub(super) struct CarShape {
    length: f64,
    width: f64,
    height: f64,
    /// Height of the lower edge of the side windows.
    belt: f64,
    /// Position of the axles along z, rear and front.
    axles: [f64; 2],
    body: [Plane; 12],
    cabin: [Plane; 8],
}

impl CarShape {
    /// A hatchback, saloon, estate or van, by the seed.
    pub(super) fn new(seed: u32) -> Self {
        /// Length, height, foot of the windscreen ahead of the middle, foot of the rear window
        /// behind it, slope of windscreen and rear window (run per rise).
        const KINDS: [[f64; 6]; 4] = [
            [4.0, 1.47, 0.95, 1.95, 1.35, 0.55],
            [4.6, 1.43, 0.85, 1.75, 1.50, 1.20],
            [4.6, 1.46, 0.90, 2.25, 1.45, 0.50],
            [4.7, 1.95, 1.55, 2.33, 0.85, 0.08],
        ];
        let [length, height, windscreen, rear, front_run, rear_run] =
            KINDS[(derive(seed, 1) % 4) as usize];
        let stretch = 0.96 + 0.08 * unit(derive(seed, 2));
        let length = length * stretch;
        let width = 1.74 + 0.1 * unit(derive(seed, 3));
        let belt = 0.62 * height.min(1.55);
        let mirrored = |x, y, z, offset| {
            [plane(Vector3::new(x, y, z), offset), plane(Vector3::new(-x, y, z), offset)]
        };
        let (side, nose) = (0.5 * width, 0.5 * length);
        let [side_right, side_left] = mirrored(1.0, 0.06, 0.0, side + 0.06 * 0.5);
        let [shoulder_right, shoulder_left] = mirrored(1.0, 0.0, 0.45, side + 0.45 * (nose - 0.25));
        let [hip_right, hip_left] = mirrored(1.0, 0.0, -0.45, side + 0.45 * (nose - 0.18));
        // The bonnet falls from the foot of the windscreen to the nose.
        let fall = 0.17;
        let body = [
            side_right,
            side_left,
            shoulder_right,
            shoulder_left,
            hip_right,
            hip_left,
            plane(Vector3::new(0.0, 0.12, 1.0), nose + 0.12 * 0.5),
            plane(Vector3::new(0.0, 0.10, -1.0), nose + 0.10 * 0.5),
            plane(Vector3::new(0.0, 1.0, fall), belt + fall * windscreen),
            plane(Vector3::new(0.0, 1.0, 0.6), belt + 0.6 * (nose - 0.32)),
            plane(Vector3::y(), belt + 0.01),
            plane(-Vector3::y(), -SILL),
        ];
        let [pane_right, pane_left] = mirrored(1.0, 0.33, 0.0, side - 0.03 + 0.33 * belt);
        let [edge_right, edge_left] = mirrored(1.0, 1.3, 0.0, side - 0.38 + 1.3 * height);
        let cabin = [
            pane_right,
            pane_left,
            edge_right,
            edge_left,
            plane(Vector3::new(0.0, front_run, 1.0), windscreen + front_run * belt),
            plane(Vector3::new(0.0, rear_run, -1.0), rear * stretch + rear_run * belt),
            plane(Vector3::y(), height),
            plane(-Vector3::y(), -belt),
        ];
        Self { length, width, height, belt, axles: [0.78 - nose, nose - 0.82], body, cabin }
    }

    /// Half width, height, half length.
    pub(super) fn half_extent(&self) -> Vector3<f64> {
        Vector3::new(0.5 * self.width + 0.02, self.height, 0.5 * self.length)
    }

    /// Half width and half length of the space below the car.
    pub(super) fn half_plan(&self) -> Vector2<f64> {
        Vector2::new(0.5 * self.width, 0.5 * self.length)
    }

    /// Height of the lower edge of the side windows \[m\].
    pub(super) fn belt(&self) -> f64 {
        self.belt
    }

    /// Height of the roof \[m\].
    pub(super) fn height(&self) -> f64 {
        self.height
    }

    /// Overall length \[m\].
    pub(super) fn length(&self) -> f64 {
        self.length
    }

    /// Overall width \[m\].
    pub(super) fn width(&self) -> f64 {
        self.width
    }

    /// Distance of a point on the flank from the nearer hub \[m\], in units of the wheel's radius.
    pub(super) fn hub_distance(&self, z: f64, y: f64) -> f64 {
        let to = |axle: f64| Vector2::new(z - axle, y - WHEEL_RADIUS).norm();
        to(self.axles[0]).min(to(self.axles[1])) / WHEEL_RADIUS
    }

    /// First contact beyond `from` of a ray of the car's frame. The contact's uv are z (flanks) or x
    /// (front and rear) of the frame, and the height above the road.
    pub(super) fn meet(&self, ray: &Ray, from: f64) -> Option<Contact> {
        let [low, high] = self.heights(ray, from)?;
        let between = |bottom: f64, top: f64| high >= bottom - SLACK && low <= top + SLACK;
        let polyhedron = |planes: &[Plane], part_of: fn(&Vector3<f64>) -> Part| {
            let (distance, index) = first_beyond(clip(ray, planes.iter())?, from)?;
            let p = ray.at(distance);
            let normal = planes[index].0;
            let across = normal.x.abs() > 0.5;
            Some(Contact {
                distance,
                normal: rounded(normal, &p, self),
                uv: Vector2::new(if across { p.z } else { p.x }, p.y),
                part: part_of(&normal),
            })
        };
        let body = between(SILL, self.belt + 0.01).then(|| polyhedron(&self.body, part_of_body));
        let cabin = between(self.belt, self.height).then(|| polyhedron(&self.cabin, part_of_cabin));
        let wheels = between(0.0, 2.0 * WHEEL_RADIUS).then(|| self.meet_wheels(ray, from));
        [body, cabin, wheels]
            .into_iter()
            .flatten()
            .flatten()
            .min_by(|a, b| a.distance.total_cmp(&b.distance))
    }

    /// The least and the greatest height of a ray above the plan of the car; `None` if it is nowhere
    /// there beyond `from`.
    fn heights(&self, ray: &Ray, from: f64) -> Option<[f64; 2]> {
        let half = self.half_plan();
        let (mut enter, mut leave) = (from, f64::INFINITY);
        for (origin, direction, half) in [
            (ray.origin.x, ray.direction.x, half.x + SLACK),
            (ray.origin.z, ray.direction.z, half.y + SLACK),
        ] {
            let inverse = direction.recip();
            let (a, b) = ((-half - origin) * inverse, (half - origin) * inverse);
            let (near, far) = if a < b { (a, b) } else { (b, a) };
            if near > enter {
                enter = near;
            }
            if far < leave {
                leave = far;
            }
        }
        let height = |distance: f64| ray.origin.y + ray.direction.y * distance;
        let (a, b) = (height(enter), height(leave));
        (enter <= leave).then_some([a.min(b), a.max(b)])
    }

    fn meet_wheels(&self, ray: &Ray, from: f64) -> Option<Contact> {
        let mut best: Option<Contact> = None;
        let outside = 0.5 * self.width + 0.015;
        for axle in self.axles {
            for low in [-outside, outside - WHEEL_WIDTH] {
                let Some(contact) = meet_wheel(ray, axle, [low, low + WHEEL_WIDTH], from) else {
                    continue;
                };
                if best.is_none_or(|b| contact.distance < b.distance) {
                    best = Some(contact);
                }
            }
        }
        best
    }
}

fn plane(normal: Vector3<f64>, offset: f64) -> Plane {
    let norm = normal.norm();
    (normal / norm, offset / norm)
}

fn part_of_body(normal: &Vector3<f64>) -> Part {
    if normal.y.abs() > 0.75 {
        Part::Panel
    } else if normal.x.abs() > 0.7 {
        Part::Flank
    } else if normal.z > 0.0 {
        Part::Nose
    } else {
        Part::Tail
    }
}

fn part_of_cabin(normal: &Vector3<f64>) -> Part {
    if normal.z.abs() > 0.5 {
        Part::Screen
    } else if normal.x.abs() > 0.8 {
        Part::Pane
    } else {
        Part::Panel
    }
}

/// Tilts a flat panel's normal outwards with the distance from the car's middle, as if it bulged.
fn rounded(normal: Vector3<f64>, p: &Point3<f64>, car: &CarShape) -> Vector3<f64> {
    let bulge = Vector3::new(
        0.35 * p.x / car.width,
        0.5 * (p.y / car.height - 0.45),
        0.35 * p.z / car.length,
    );
    let tangential = bulge - normal * normal.dot(&bulge);
    (normal + tangential).normalize()
}

/// A wheel about an axis along x through `y = WHEEL_RADIUS`, `z = axle`, between the `flanks`.
fn meet_wheel(ray: &Ray, axle: f64, flanks: [f64; 2], from: f64) -> Option<Contact> {
    let hub = Point3::new(0.0, WHEEL_RADIUS, axle);
    let origin = ray.origin - hub;
    let direction = ray.direction;
    let a = direction.y * direction.y + direction.z * direction.z;
    let b = origin.y * direction.y + origin.z * direction.z;
    let c = origin.y * origin.y + origin.z * origin.z - WHEEL_RADIUS * WHEEL_RADIUS;
    let discriminant = b * b - a * c;
    if discriminant < 0.0 || a == 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    let cut = |x: f64| (x - ray.origin.x) / direction.x;
    let (first, second) = (cut(flanks[0]), cut(flanks[1]));
    let (enter_flank, leave_flank) = (first.min(second), first.max(second));
    let (enter_tread, leave_tread) = ((-b - root) / a, (-b + root) / a);
    let enter = (enter_flank.max(enter_tread), enter_flank > enter_tread);
    let leave = (leave_flank.min(leave_tread), leave_flank < leave_tread);
    if enter.0 > leave.0 {
        return None;
    }
    let (distance, on_flank) = first_beyond([enter, leave], from)?;
    let offset = origin + direction * distance;
    let normal = if on_flank {
        let middle = 0.5 * (flanks[0] + flanks[1]);
        Vector3::x() * if offset.x > middle { 1.0 } else { -1.0 }
    } else {
        Vector3::new(0.0, offset.y, offset.z).normalize()
    };
    Some(Contact {
        distance,
        normal,
        uv: Vector2::new(offset.z, offset.y) / WHEEL_RADIUS,
        part: if on_flank { Part::Wheel } else { Part::Tread },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_car_is_as_long_wide_and_high_as_it_says() {
        for seed in 0..20 {
            let car = CarShape::new(seed);
            let from = |origin: Point3<f64>, direction: Vector3<f64>| {
                let ray = Ray { origin, direction };
                ray.at(car.meet(&ray, 0.0).expect("aimed at it").distance)
            };
            let top = from(Point3::new(0.0, 10.0, 0.0), -Vector3::y());
            assert!((top.y - car.height()).abs() < 1e-9);
            let flank = from(Point3::new(10.0, 0.32, car.axles[0]), -Vector3::x());
            assert!((flank.x - 0.5 * car.width()).abs() < 0.02);
            let nose = from(Point3::new(0.0, 0.5, 10.0), -Vector3::z());
            assert!((nose.z - 0.5 * car.length()).abs() < 1e-9);
        }
    }

    #[test]
    fn a_ray_to_the_inside_of_any_part_meets_the_car_before() {
        for seed in 0..20 {
            let car = CarShape::new(seed);
            let [rear, front] = car.axles;
            let wheel = 0.5 * car.width() - 0.05;
            let inner = [
                Point3::new(0.0, 0.25, 0.0),
                Point3::new(0.0, car.belt() - 0.1, 0.0),
                Point3::new(0.1, car.belt() + 0.05, 0.0),
                Point3::new(0.0, car.height() - 0.05, -0.3),
                Point3::new(wheel, 0.05, rear),
                Point3::new(-wheel, 0.1, front),
            ];
            for (k, target) in (0_u32..).zip(inner.iter().cycle()).take(600) {
                let random = |stream, scale| scale * (unit(derive(k, stream)) - 0.5);
                let origin = Point3::new(random(1, 20.0), 5.0 * unit(derive(k, 2)), 8.0);
                let direction = (target - origin).normalize();
                let contact = car.meet(&Ray { origin, direction }, 0.0);
                let distance = contact.expect("in the way").distance;
                assert!(distance < (target - origin).norm(), "{seed} {target}");
            }
        }
    }
}
