//! Building a town: collects solids and keeps them out of each other's way.

use nalgebra::{Point2, Point3, Vector2, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg32;

use super::appearance::Rgb;
use super::frame::Frame;
use super::material::{Material, Solid};
use super::network::Network;
use super::path::right_of;
use super::shade::Blot;
use super::shape::Shape;
use super::weather::Season;

/// A rectangle of land.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plot {
    /// The middle of the plot.
    pub(super) centre: Point2<f64>,
    /// The direction that its front faces.
    pub(super) ahead: Vector2<f64>,
    /// Half its width and depth \[m\].
    pub(super) half: Vector2<f64>,
}

impl Plot {
    fn axes(&self) -> [Vector2<f64>; 2] {
        [right_of(self.ahead), self.ahead]
    }

    fn reach(&self, axis: Vector2<f64>) -> f64 {
        let [right, ahead] = self.axes();
        self.half.x * right.dot(&axis).abs() + self.half.y * ahead.dot(&axis).abs()
    }

    /// Whether two plots have points in common.
    pub(super) fn overlaps(&self, other: &Self) -> bool {
        let offset = other.centre - self.centre;
        self.axes()
            .into_iter()
            .chain(other.axes())
            .all(|axis| offset.dot(&axis).abs() < self.reach(axis) + other.reach(axis))
    }

    /// The point `x` right of and `z` ahead of the middle.
    pub(super) fn at(&self, x: f64, z: f64) -> Point2<f64> {
        self.centre + right_of(self.ahead) * x + self.ahead * z
    }

    /// Points on the outline, at most about 2 m apart.
    pub(super) fn outline(&self) -> impl Iterator<Item = Point2<f64>> {
        let count = |half: f64| half.ceil().max(1.0) as i32;
        let (nx, nz) = (count(self.half.x), count(self.half.y));
        let share = |i: i32, n: i32| f64::from(i) / f64::from(n);
        let plot = *self;
        let long = (-nx..=nx).flat_map(move |i| {
            let x = share(i, nx) * plot.half.x;
            [plot.at(x, -plot.half.y), plot.at(x, plot.half.y)]
        });
        let short = (-nz..=nz).flat_map(move |i| {
            let z = share(i, nz) * plot.half.y;
            [plot.at(-plot.half.x, z), plot.at(plot.half.x, z)]
        });
        long.chain(short)
    }
}

/// A town in the making.
pub(super) struct Builder<'a> {
    /// The streets of the town.
    pub(super) network: &'a Network,
    /// Randomness of what never changes.
    pub(super) rng: Pcg32,
    solids: Vec<Solid>,
    blots: Vec<Blot>,
    taken: Vec<Plot>,
    /// Whether trees bear leaves.
    pub(super) season: Season,
    /// Where street lamps shine from.
    pub(super) lamps: Vec<Point3<f64>>,
}

impl<'a> Builder<'a> {
    /// An empty town.
    pub(super) fn new(network: &'a Network, seed: u64, season: Season) -> Self {
        Self {
            network,
            rng: Pcg32::seed_from_u64(seed ^ 0x5EED_7077),
            solids: Vec::new(),
            blots: Vec::new(),
            taken: Vec::new(),
            season,
            lamps: Vec::new(),
        }
    }

    /// The solids, the shade that they cast on the ground, and the lamps.
    pub(super) fn finish(self) -> (Vec<Solid>, Vec<Blot>, Vec<Point3<f64>>) {
        (self.solids, self.blots, self.lamps)
    }

    /// Adds a solid.
    pub(super) fn add(&mut self, shape: Shape, material: Material, seed: u32) {
        self.solids.push(Solid { shape, material, seed });
    }

    /// Adds an upright cylinder in one colour, with its contact shade.
    pub(super) fn add_post(&mut self, foot: Point2<f64>, radius: f64, height: f64, colour: Rgb) {
        let base = Point3::new(foot.x, 0.0, foot.y);
        let seed = self.solids.len() as u32;
        let shape = Shape::Pole { base, radius, height };
        self.add(shape, Material::Plain(colour), seed);
        self.shade(
            Plot { centre: foot, ahead: Vector2::y(), half: Vector2::repeat(radius * 0.7) },
            0.25 + radius,
            0.45,
        );
    }

    /// Adds a box that stands at `height` on a plot.
    pub(super) fn add_block(
        &mut self,
        plot: &Plot,
        height: [f64; 2],
        material: Material,
        seed: u32,
    ) {
        let shape = Shape::Block {
            frame: Frame::new(plot.centre, height[0], plot.ahead),
            half: Vector3::new(plot.half.x, height[1] - height[0], plot.half.y),
        };
        self.add(shape, material, seed);
    }

    /// Shades the ground below and around a plot.
    pub(super) fn shade(&mut self, plot: Plot, reach: f64, depth: f64) {
        self.blots.push(Blot {
            centre: plot.centre,
            ahead: plot.ahead,
            half: plot.half,
            reach,
            depth,
        });
    }

    /// Whether a plot is nowhere nearer to a kerb than `clearance` and on no plot taken before.
    pub(super) fn is_free(&self, plot: &Plot, clearance: f64) -> bool {
        plot.outline().all(|p| self.network.kerb_distance(p) >= clearance)
            && !self.taken.iter().any(|other| plot.overlaps(other))
    }

    /// Keeps a plot from being built on again.
    pub(super) fn take(&mut self, plot: Plot) {
        self.taken.push(plot);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plots_overlap_when_they_share_land() {
        let plot = |x: f64, ahead: Vector2<f64>| Plot {
            centre: Point2::new(x, 0.0),
            ahead,
            half: Vector2::new(2.0, 1.0),
        };
        let straight = plot(0.0, Vector2::y());
        assert!(straight.overlaps(&plot(3.9, Vector2::y())));
        assert!(!straight.overlaps(&plot(4.1, Vector2::y())));
        assert!(!straight.overlaps(&plot(3.1, Vector2::x())));
        assert!(straight.overlaps(&plot(2.9, Vector2::x())));
    }

    #[test]
    fn the_outline_is_on_the_border() {
        let plot = Plot {
            centre: Point2::new(5.0, 5.0),
            ahead: Vector2::new(0.6, 0.8),
            half: Vector2::new(4.0, 3.0),
        };
        for p in plot.outline() {
            let offset = p - plot.centre;
            let x = offset.dot(&right_of(plot.ahead)).abs() / plot.half.x;
            let z = offset.dot(&plot.ahead).abs() / plot.half.y;
            assert!((x.max(z) - 1.0).abs() < 1e-9);
        }
    }
}
