//! Images: one ray per pixel, two more where surfaces meet.

use image::RgbImage;
use nalgebra::{Point2, Point3, Vector3};
use rayon::prelude::*;

use super::camera_path::CAMERA_HEIGHT;
use super::frame::Ray;
use super::headlamp::Headlamp;
use super::lens::{Levels, Plane};
use super::look::Look;
use super::noise::{derive, hash3, normal};
use super::shading::Shading;
use super::town::{Face, Sight, Town};
use crate::camera::Intrinsics;
use crate::geometry::Pose;

/// Pixels whose levels differ by more than this from a neighbour's are refined.
const CONTRAST: f32 = 36.0;

/// Level at which the noise is as strong as the weather says.
const MID_LEVEL: f64 = 110.0;

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
    /// Seed of what is on the lens.
    pub(super) lens_seed: u32,
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
    levels: Levels,
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
        let shading = Shading {
            town: self.town,
            look: self.look,
            headlamp: (self.look.headlamps > 0.0).then(|| Headlamp::new(self.world_from_camera)),
            sky_seed: self.sky_seed,
        };
        let samples: Vec<Sample> = (0..height)
            .into_par_iter()
            .flat_map_iter(|y| {
                let shading = &shading;
                (0..width).scan(None, move |left, x| {
                    let sample = self.sample(shading, f64::from(x), f64::from(y), *left);
                    *left = sample.face;
                    Some(sample)
                })
            })
            .collect();
        let levels: Vec<Levels> = (0..height as usize)
            .into_par_iter()
            .flat_map_iter(|y| {
                let (samples, shading) = (&samples, &shading);
                (0..columns).map(move |x| self.refined(shading, samples, columns, x, y))
            })
            .collect();
        let plane = Plane::new(levels, columns);
        let plane = self
            .look
            .lens
            .project(plane, self.frame_seed, self.lens_seed);
        let mut bytes = vec![0; plane.levels.len() * 3];
        bytes
            .par_chunks_mut(3 * columns)
            .zip(plane.levels.par_chunks(columns))
            .enumerate()
            .for_each(|(y, (line, levels))| {
                for (x, (pixel, levels)) in line.chunks_exact_mut(3).zip(levels).enumerate() {
                    pixel.copy_from_slice(&self.sensed(levels, x as u32, y as u32));
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

    fn sample(&self, shading: &Shading<'_>, x: f64, y: f64, likely: Option<Face>) -> Sample {
        let bearing = self.intrinsics.bearing(&Point2::new(x, y));
        let ray = self.ray(&bearing);
        let sight = self.town.look_near(&ray, 0.0, likely);
        Sample {
            levels: self.levels(shading, &ray, sight.as_ref(), bearing.z),
            face: sight.map(|s| s.face()),
        }
    }

    /// Grey levels of what a ray sees; `cosine` is that of its angle to the optical axis.
    fn levels(
        &self,
        shading: &Shading<'_>,
        ray: &Ray,
        sight: Option<&Sight>,
        cosine: f64,
    ) -> Levels {
        let radiance = shading.radiance(ray, sight, cosine / self.intrinsics.fx);
        self.look.levels(&radiance).cast().into()
    }

    /// The mean of several samples where a pixel differs from a neighbour, else its one sample.
    fn refined(
        &self,
        shading: &Shading<'_>,
        samples: &[Sample],
        columns: usize,
        x: usize,
        y: usize,
    ) -> Levels {
        /// With the one in the middle, a lattice of which no two samples share a row or a column.
        const OTHERS: [(f64, f64); 2] = [(-0.33, -0.28), (0.33, 0.28)];
        let index = y * columns + x;
        let here = &samples[index];
        let left = (x > 0).then(|| &samples[index - 1]);
        let right = (x + 1 < columns).then(|| &samples[index + 1]);
        let above = index.checked_sub(columns).map(|i| &samples[i]);
        let below = samples.get(index + columns);
        let neighbours = || [left, right, above, below].into_iter().flatten();
        if !neighbours().any(|other| here.differs(other)) {
            return here.levels;
        }
        let surrounded = neighbours().all(|other| here.face == other.face);
        // Textures are smoothed over the pixel by themselves: there, one more sample will do.
        let others = &OTHERS[..if surrounded { 1 } else { 2 }];
        let sum = others.iter().fold(here.levels, |sum, (dx, dy)| {
            let pixel = Point2::new(x as f64 + dx, y as f64 + dy);
            let bearing = self.intrinsics.bearing(&pixel);
            let ray = self.ray(&bearing);
            let sight = match here.face {
                Some(face) if surrounded => self.town.look_again(&ray, face),
                likely => self.town.look_near(&ray, 0.0, likely),
            };
            let levels = self.levels(shading, &ray, sight.as_ref(), bearing.z);
            std::array::from_fn(|c| sum[c] + levels[c])
        });
        sum.map(|level| level / (1 + others.len()) as f32)
    }

    /// What the sensor makes of the levels: vignetting, noise, eight bits.
    fn sensed(&self, levels: &Levels, x: u32, y: u32) -> [u8; 3] {
        let from_centre = |at: u32, size: u32| 2.0 * f64::from(at) / f64::from(size) - 1.0;
        let (u, v) = (
            from_centre(x, self.intrinsics.width),
            from_centre(y, self.intrinsics.height),
        );
        let gain = 1.0 - 0.5 * self.look.vignetting * (u * u + 0.3 * v * v);
        std::array::from_fn(|channel| {
            let seed = derive(self.frame_seed, channel as u32);
            let noise = normal(hash3(x.cast_signed(), y.cast_signed(), 1, seed));
            let level = f64::from(levels[channel]) * gain;
            // Half the noise is the amplifier's, the rest is that of the light itself.
            let spread = self.look.noise * (0.25 + 0.75 * (level / MID_LEVEL).min(2.0)).sqrt();
            (level + spread * noise + 0.5).clamp(0.0, 255.0) as u8
        })
    }
}
