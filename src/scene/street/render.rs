//! Images: one ray per pixel, three more where surfaces meet.

use image::RgbImage;
use nalgebra::{Point2, Point3, Vector3};
use rayon::prelude::*;

use super::camera_path::CAMERA_HEIGHT;
use super::frame::Ray;
use super::look::Look;
use super::noise::{derive, hash3, normal};
use super::town::{Face, Sight, Town};
use crate::camera::Intrinsics;
use crate::geometry::Pose;

/// Pixels whose levels differ by more than this from a neighbour's are refined.
const CONTRAST: f32 = 26.0;

/// A camera in the town.
pub(super) struct View<'a> {
    /// What it looks at.
    pub(super) town: &'a Town,
    /// The light.
    pub(super) look: &'a Look,
    /// Its optics.
    pub(super) intrinsics: &'a Intrinsics,
    /// Where it is.
    pub(super) world_from_camera: &'a Pose,
    /// Seed of what differs between frames.
    pub(super) frame_seed: u32,
    /// Seed of what is the same in all frames.
    pub(super) sky_seed: u32,
}

/// A world point in town coordinates.
pub(super) fn town_from_world(p: &Point3<f64>) -> Point3<f64> {
    Point3::new(p.x, CAMERA_HEIGHT - p.y, p.z)
}

/// A ray of the camera frame in town coordinates.
pub(super) fn town_ray(pose: &Pose, origin: &Point3<f64>, direction: &Vector3<f64>) -> Ray {
    let turned = pose.rotation * direction;
    Ray {
        origin: town_from_world(&(pose * origin)),
        direction: Vector3::new(turned.x, -turned.y, turned.z),
    }
}

/// Levels of a pixel, and what it shows.
#[derive(Clone, Copy)]
struct Sample {
    levels: [f32; 3],
    /// `None` is the sky.
    face: Option<Face>,
}

impl Sample {
    fn differs(&self, other: &Self) -> bool {
        self.face != other.face
            || (0..3).any(|c| (self.levels[c] - other.levels[c]).abs() > CONTRAST)
    }
}

impl View<'_> {
    /// The image; the same bytes whatever the number of threads.
    pub(super) fn image(&self) -> RgbImage {
        let (width, height) = (self.intrinsics.width, self.intrinsics.height);
        let columns = width as usize;
        let row = |y: u32| (0..width).map(move |x| self.sample(f64::from(x), f64::from(y)));
        let samples: Vec<Sample> = (0..height).into_par_iter().flat_map_iter(row).collect();
        let mut bytes = vec![0; samples.len() * 3];
        bytes
            .par_chunks_mut(3 * columns)
            .enumerate()
            .for_each(|(y, line)| {
                for (x, pixel) in line.chunks_exact_mut(3).enumerate() {
                    let levels = self.refined(&samples, columns, x, y);
                    pixel.copy_from_slice(&self.sensed(&levels, x as u32, y as u32));
                }
            });
        RgbImage::from_raw(width, height, bytes).expect("three bytes for every pixel")
    }

    /// z-depth of what is seen through a pixel \[m\].
    pub(super) fn depth(&self, pixel: &Point2<f64>) -> Option<f64> {
        let bearing = self.intrinsics.bearing(pixel);
        let sight = self.town.look(&self.ray(&bearing), 0.0)?;
        Some(sight.distance * bearing.z)
    }

    fn ray(&self, bearing: &Vector3<f64>) -> Ray {
        town_ray(self.world_from_camera, &Point3::origin(), bearing)
    }

    fn sample(&self, x: f64, y: f64) -> Sample {
        let bearing = self.intrinsics.bearing(&Point2::new(x, y));
        let ray = self.ray(&bearing);
        let sight = self.town.look(&ray, 0.0);
        Sample {
            levels: self.levels(&ray, sight.as_ref(), bearing.z).cast().into(),
            face: sight.map(|s| s.face()),
        }
    }

    /// Grey levels of what a ray sees; `cosine` is that of its angle to the optical axis.
    fn levels(&self, ray: &Ray, sight: Option<&Sight>, cosine: f64) -> Vector3<f64> {
        let radiance = match sight {
            None => self.look.sky(&ray.direction, self.sky_seed),
            Some(sight) => {
                let pixel = cosine / self.intrinsics.fx;
                let appearance = self.town.appearance(sight, ray, pixel);
                self.look.radiance(
                    &appearance,
                    &sight.normal,
                    &ray.direction,
                    self.town.openness(sight),
                    self.sky_seed,
                )
            }
        };
        self.look.levels(&radiance)
    }

    /// The mean of four samples where a pixel differs from a neighbour, else its one sample.
    fn refined(&self, samples: &[Sample], columns: usize, x: usize, y: usize) -> Vector3<f64> {
        /// With the one in the middle, a lattice of which no two samples share a row or a column.
        const OTHERS: [(f64, f64); 3] = [(-0.35, -0.17), (0.17, -0.35), (0.18, 0.35)];
        let index = y * columns + x;
        let here = &samples[index];
        let left = (x > 0).then(|| &samples[index - 1]);
        let right = (x + 1 < columns).then(|| &samples[index + 1]);
        let above = index.checked_sub(columns).map(|i| &samples[i]);
        let below = samples.get(index + columns);
        let neighbours = || [left, right, above, below].into_iter().flatten();
        let middle = Vector3::from(here.levels).cast::<f64>();
        if !neighbours().any(|other| here.differs(other)) {
            return middle;
        }
        let surrounded = neighbours().all(|other| here.face == other.face);
        let sum = OTHERS.iter().fold(middle, |sum, (dx, dy)| {
            let pixel = Point2::new(x as f64 + dx, y as f64 + dy);
            let bearing = self.intrinsics.bearing(&pixel);
            let ray = self.ray(&bearing);
            let sight = match here.face {
                Some(face) if surrounded => self.town.look_again(&ray, face),
                _ => self.town.look(&ray, 0.0),
            };
            sum + self.levels(&ray, sight.as_ref(), bearing.z)
        });
        sum / 4.0
    }

    /// What the sensor makes of the levels: vignetting, noise, eight bits.
    fn sensed(&self, levels: &Vector3<f64>, x: u32, y: u32) -> [u8; 3] {
        let from_centre = |at: u32, size: u32| 2.0 * f64::from(at) / f64::from(size) - 1.0;
        let (u, v) = (
            from_centre(x, self.intrinsics.width),
            from_centre(y, self.intrinsics.height),
        );
        let gain = 1.0 - 0.5 * self.look.vignetting * (u * u + 0.3 * v * v);
        std::array::from_fn(|channel| {
            let seed = derive(self.frame_seed, channel as u32);
            let noise = normal(hash3(x.cast_signed(), y.cast_signed(), 1, seed));
            let level = levels[channel] * gain + self.look.noise * noise;
            (level + 0.5).clamp(0.0, 255.0) as u8
        })
    }
}
