//! Images: one ray per pixel, two more where surfaces meet.

use std::cell::Cell;
use std::ops::Range;
use std::sync::Arc;

use image::RgbImage;
use nalgebra::{Point2, Point3, Vector3};
use rayon::prelude::*;

use super::beam::Beam;
use super::box_tree::Sector;
use super::frame::Ray;
use super::headlamp::Headlamp;
use super::lens::{Levels, Plane};
use super::look::Look;
use super::noise::{derive, hash3, normal};
use super::shading::Shading;
use super::town::{Face, Sight, Town};
use super::world::town_ray;
use posescope_core::camera::Intrinsics;
use posescope_core::geometry::Pose;

/// Pixels whose levels differ by more than this from a neighbour's are refined.
const CONTRAST: f32 = 36.0;

/// Columns and rows of the tiles whose rays are searched for together.
const TILE: [u32; 2] = [32, 8];

/// Level at which the noise is as strong as the weather says.
const MID_LEVEL: f64 = 110.0;

/// A camera in the town.
pub(super) struct View<'a> {
    /// What it looks at.
    pub(super) town: &'a Town,
    /// The weather and the light.
    pub(super) look: &'a Look,
    /// Focal lengths, principal point and image size.
    pub(super) intrinsics: &'a Intrinsics,
    /// Pose of the camera.
    pub(super) world_from_camera: &'a Pose,
    /// Seed of what differs between frames.
    pub(super) frame_seed: u32,
    /// Seed of what is the same in all frames.
    pub(super) sky_seed: u32,
    /// Seed of what is on the lens.
    pub(super) lens_seed: u32,
}

/// Levels of a pixel, and what it shows.
#[derive(Clone, Copy, Default)]
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

/// A row of tiles: the samples of its pixels, row after row, and what is seen through its tiles.
struct Band {
    samples: Vec<Sample>,
    sectors: Vec<Sector>,
}

impl View<'_> {
    /// The image; the same bytes whatever the number of threads.
    pub(super) fn image(&self) -> RgbImage {
        let (width, height) = (self.intrinsics.width, self.intrinsics.height);
        let columns = width as usize;
        let bands: Vec<Band> =
            (0..height.div_ceil(TILE[1])).into_par_iter().map(|band| self.band(band)).collect();
        let mut levels: Vec<Levels> = vec![[0.0; 3]; columns * height as usize];
        levels
            .par_chunks_mut(columns * TILE[1] as usize)
            .enumerate()
            .for_each(|(band, levels)| self.refine(&bands, band, levels));
        let plane = Plane::new(levels, columns);
        let plane = self.look.lens.project(plane, self.frame_seed, self.lens_seed);
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

    /// The light; for one thread, as it remembers what shaded last.
    fn shading(&self) -> Shading<'_> {
        Shading {
            town: self.town,
            look: self.look,
            headlamp: (self.look.headlamps > 0.0).then(|| Headlamp::new(self.world_from_camera)),
            sky_seed: self.sky_seed,
            occluder: Cell::new(None),
        }
    }

    /// The rays through a part of the image.
    fn beam(&self, columns: &Range<u32>, rows: &Range<u32>) -> Beam {
        let border = |at: u32| f64::from(at) - 0.5;
        let corners = [rows.start, rows.end].map(|y| {
            [columns.start, columns.end].map(|x| {
                let corner = Point2::new(border(x), border(y));
                self.ray(&self.intrinsics.bearing(&corner)).direction
            })
        });
        let origin = self.ray(&Vector3::z()).origin;
        Beam::around(origin, corners.as_flattened())
    }

    /// One sample for every pixel of a row of tiles.
    fn band(&self, band: u32) -> Band {
        let shading = &self.shading();
        let (width, height) = (self.intrinsics.width, self.intrinsics.height);
        let rows = band * TILE[1]..((band + 1) * TILE[1]).min(height);
        let mut samples = vec![Sample::default(); (width * rows.len() as u32) as usize];
        let solids = Arc::new(self.town.solids_in(&self.beam(&(0..width), &rows)));
        let mut left = [None; TILE[1] as usize];
        let sectors = (0..width)
            .step_by(TILE[0] as usize)
            .map(|begin| {
                let columns = begin..(begin + TILE[0]).min(width);
                let sector = Sector::new(&solids, self.beam(&columns, &rows));
                for ((y, left), line) in
                    rows.clone().zip(&mut left).zip(samples.chunks_exact_mut(width as usize))
                {
                    for x in columns.clone() {
                        let sample =
                            self.sample(shading, &sector, f64::from(x), f64::from(y), *left);
                        *left = sample.face;
                        line[x as usize] = sample;
                    }
                }
                sector
            })
            .collect();
        Band { samples, sectors }
    }

    fn sample(
        &self,
        shading: &Shading<'_>,
        sector: &Sector,
        x: f64,
        y: f64,
        likely: Option<Face>,
    ) -> Sample {
        let bearing = self.intrinsics.bearing(&Point2::new(x, y));
        let ray = self.ray(&bearing);
        let sight = self.town.look_within(sector, &ray, likely);
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

    /// The levels of a band, refined where surfaces meet.
    fn refine(&self, bands: &[Band], band: usize, levels: &mut [Levels]) {
        let shading = &self.shading();
        let columns = self.intrinsics.width as usize;
        let here = &bands[band];
        let rows: Vec<&[Sample]> = here.samples.chunks_exact(columns).collect();
        let before =
            band.checked_sub(1).and_then(|band| bands[band].samples.rchunks_exact(columns).next());
        let after = bands.get(band + 1).map(|band| &band.samples[..columns]);
        for (i, line) in levels.chunks_exact_mut(columns).enumerate() {
            let above = i.checked_sub(1).map(|above| rows[above]).or(before);
            let below = rows.get(i + 1).copied().or(after);
            let y = (band * TILE[1] as usize + i) as f64;
            for (x, levels) in line.iter_mut().enumerate() {
                let sample = &rows[i][x];
                let neighbours = [
                    x.checked_sub(1).map(|left| &rows[i][left]),
                    rows[i].get(x + 1),
                    above.map(|row| &row[x]),
                    below.map(|row| &row[x]),
                ];
                let neighbours = || neighbours.iter().flatten();
                *levels = if neighbours().any(|other| sample.differs(other)) {
                    let surrounded = neighbours().all(|other| sample.face == other.face);
                    let sector = &here.sectors[x / TILE[0] as usize];
                    self.refined(shading, sector, sample, surrounded, x as f64, y)
                } else {
                    sample.levels
                };
            }
        }
    }

    /// The mean of several samples of a pixel; it is `surrounded` by pixels of the same face, or not.
    fn refined(
        &self,
        shading: &Shading<'_>,
        sector: &Sector,
        here: &Sample,
        surrounded: bool,
        x: f64,
        y: f64,
    ) -> Levels {
        /// With the one in the middle, a lattice of which no two samples share a row or a column.
        const OTHERS: [(f64, f64); 2] = [(-0.33, -0.28), (0.33, 0.28)];
        // Textures are smoothed over the pixel by themselves: there, one more sample will do.
        let others = &OTHERS[..if surrounded { 1 } else { 2 }];
        let sum = others.iter().fold(here.levels, |sum, (dx, dy)| {
            let bearing = self.intrinsics.bearing(&Point2::new(x + dx, y + dy));
            let ray = self.ray(&bearing);
            let sight = match here.face {
                Some(face) if surrounded => self.town.look_again(sector, &ray, face),
                likely => self.town.look_within(sector, &ray, likely),
            };
            let levels = self.levels(shading, &ray, sight.as_ref(), bearing.z);
            std::array::from_fn(|c| sum[c] + levels[c])
        });
        sum.map(|level| level / (1 + others.len()) as f32)
    }

    /// What the sensor makes of the levels: vignetting, noise, eight bits.
    fn sensed(&self, levels: &Levels, x: u32, y: u32) -> [u8; 3] {
        let from_centre = |at: u32, size: u32| 2.0 * f64::from(at) / f64::from(size) - 1.0;
        let (u, v) =
            (from_centre(x, self.intrinsics.width), from_centre(y, self.intrinsics.height));
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
