//! The town: all its solids, the ground, and what a ray sees of them.

use std::cell::Cell;

use nalgebra::{Point2, Point3, Vector2, Vector3};

use super::appearance::Appearance;
use super::beam::Beam;
use super::box_tree::{BoxTree, Sector};
use super::contact::{Contact, Part};
use super::cover::Cover;
use super::frame::Ray;
use super::furniture;
use super::ground::{self, GroundContact};
use super::houses;
use super::lamps::Lamps;
use super::material::Solid;
use super::network::Network;
use super::noise::Footprint;
use super::plot::Builder;
use super::shade::ContactShade;
use super::weather::Season;

/// Beyond this, there is only sky \[m\].
const FAR: f64 = 500.0;
/// The search of a ray ends this much below the carriageway \[m\].
const CARRIAGEWAY_SLACK: f64 = 1e-3;
/// A ray that goes through a hole goes on this much farther \[m\].
const PAST_HOLE: f64 = 1e-4;

/// The street network with everything on it.
#[derive(Debug)]
pub(super) struct Town {
    /// The streets.
    pub(super) network: Network,
    solids: Vec<Solid>,
    tree: BoxTree,
    shade: ContactShade,
    /// The street lamps.
    pub(super) lamps: Lamps,
    seed: u32,
}

/// What a ray met.
#[derive(Clone, Copy, Debug)]
pub(super) enum Target {
    /// The ground.
    Ground(GroundContact),
    /// A solid.
    Solid(u32, Contact),
}

/// The first surface on a ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    /// Distance along the ray \[m\].
    pub(super) distance: f64,
    /// The point where the ray meets it.
    pub(super) point: Point3<f64>,
    /// Its outward normal.
    pub(super) normal: Vector3<f64>,
    target: Target,
}

/// A piece of surface without edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Face {
    /// The carriageway.
    Road,
    /// The side of a kerb.
    Kerb,
    /// Pavements and the land beyond.
    Land,
    /// A part of a solid.
    Solid(u32, Part),
}

impl Sight {
    /// The piece of surface that is seen.
    pub(super) fn face(&self) -> Face {
        match &self.target {
            Target::Ground(contact) => match &contact.place {
                _ if contact.normal.y < 0.5 => Face::Kerb,
                Some(place) if place.from_kerb < 0.0 => Face::Road,
                _ => Face::Land,
            },
            Target::Solid(index, contact) => Face::Solid(*index, contact.part),
        }
    }
}

impl Town {
    /// The town of a seed, with the cars and leaves of a traversal.
    pub(super) fn new(seed: u64, traversal: u32, season: Season) -> Self {
        let network = Network::new(seed);
        let mut builder = Builder::new(&network, seed, season);
        houses::build(&mut builder);
        furniture::place(&mut builder, traversal);
        furniture::park_cars(&mut builder, traversal);
        let (solids, blots, lamps) = builder.finish();
        let boxes: Vec<_> = solids.iter().map(|solid| solid.shape.bounds()).collect();
        Self {
            tree: BoxTree::new(&boxes),
            shade: ContactShade::new(blots),
            lamps: Lamps::new(&lamps),
            solids,
            network,
            seed: super::noise::mix(seed as u32 ^ (seed >> 32) as u32),
        }
    }

    /// The first surface on a ray farther than `from`.
    pub(super) fn look(&self, ray: &Ray, from: f64) -> Option<Sight> {
        let mut limit = far(ray);
        let mut best: Option<(u32, Contact)> = None;
        self.tree.traverse(ray, limit, |index| {
            if let Some(contact) = self.meet(&self.solids[index as usize], ray, from, limit) {
                limit = contact.distance;
                best = Some((index, contact));
            }
            limit
        });
        self.on_ground(ray, limit)
            .or_else(|| best.map(|(index, contact)| on_solid(ray, index, contact)))
    }

    /// As [`Self::look`], for a ray of the beam of a sector; the search is quicker if it is a piece
    /// of `likely` that is seen.
    pub(super) fn look_within(
        &self,
        sector: &Sector,
        ray: &Ray,
        likely: Option<Face>,
    ) -> Option<Sight> {
        let mut limit = far(ray);
        let mut best: Option<(u32, Contact)> = None;
        let first = match likely {
            Some(Face::Solid(index, _)) => Some(index),
            _ => None,
        };
        if let Some(index) = first
            && let Some(contact) = self.meet(&self.solids[index as usize], ray, 0.0, limit)
        {
            limit = contact.distance;
            best = Some((index, contact));
        }
        sector.thicket(ray).traverse(ray, limit, |index| {
            if first != Some(index)
                && let Some(contact) = self.meet(&self.solids[index as usize], ray, 0.0, limit)
            {
                limit = contact.distance;
                best = Some((index, contact));
            }
            limit
        });
        self.on_ground(ray, limit)
            .or_else(|| best.map(|(index, contact)| on_solid(ray, index, contact)))
    }

    /// The solids in a beam.
    pub(super) fn solids_in(&self, beam: &Beam) -> BoxTree {
        self.tree.part(beam)
    }

    /// What a ray sees that passes very near to one that saw `face`: that face, most probably,
    /// which is much quicker to find than the first of all surfaces.
    pub(super) fn look_again(&self, sector: &Sector, ray: &Ray, face: Face) -> Option<Sight> {
        let seen = match face {
            Face::Solid(index, _) => self
                .meet(&self.solids[index as usize], ray, 0.0, FAR)
                .map(|contact| on_solid(ray, index, contact)),
            Face::Road | Face::Kerb | Face::Land => self.on_ground(ray, FAR),
        };
        seen.or_else(|| self.look_within(sector, ray, None))
    }

    fn on_ground(&self, ray: &Ray, limit: f64) -> Option<Sight> {
        ground::meet(&self.network, ray, limit).map(|contact| Sight {
            distance: contact.distance,
            point: ray.at(contact.distance),
            normal: contact.normal,
            target: Target::Ground(contact),
        })
    }

    /// The first contact with a solid that is not with a hole of it.
    fn meet(&self, solid: &Solid, ray: &Ray, mut from: f64, to: f64) -> Option<Contact> {
        loop {
            let contact = solid.shape.meet(ray, from, to)?;
            if !solid.has_hole(&contact, ray) {
                return Some(contact);
            }
            from = contact.distance + PAST_HOLE;
        }
    }

    /// How a surface in some weather looks to a pixel that is `pixel` radians wide.
    pub(super) fn appearance(
        &self,
        sight: &Sight,
        ray: &Ray,
        pixel: f64,
        cover: &Cover,
    ) -> Appearance {
        let footprint = footprint(sight, ray, pixel);
        match &sight.target {
            Target::Ground(contact) => {
                let hidden = cover.hides_ground(contact, &sight.point, &footprint, self.seed);
                let bare = if hidden.share < 1.0 {
                    ground::appearance(&self.network, contact, &sight.point, &footprint, self.seed)
                } else {
                    Appearance::default()
                };
                hidden.over(cover.wetted_ground(bare, contact, &sight.point, &footprint, self.seed))
            }
            Target::Solid(index, contact) => {
                let solid = &self.solids[*index as usize];
                let bare = solid.appearance(contact, &sight.point, &footprint);
                cover.on_solid(bare, solid, contact, &sight.point, &footprint)
            }
        }
    }

    /// Whether something is between a surface and a light far away in a direction; `occluder` says
    /// where something was before.
    pub(super) fn is_shaded(
        &self,
        sight: &Sight,
        light: &Vector3<f64>,
        occluder: &Cell<Option<u32>>,
    ) -> bool {
        /// A surface does not shade itself.
        const CLEAR: f64 = 0.02;
        /// Nothing is high enough to cast longer shadows \[m\].
        const LONGEST: f64 = 60.0;
        let ray = Ray { origin: sight.point + sight.normal * CLEAR, direction: *light };
        self.tree.any(&ray, LONGEST as f32, occluder, |index| {
            self.meet(&self.solids[index as usize], &ray, CLEAR, LONGEST).is_some()
        })
    }

    /// The share of the light of the surroundings that reaches a surface.
    pub(super) fn openness(&self, sight: &Sight) -> f64 {
        let low = sight.point.y < 0.6;
        match &sight.target {
            Target::Ground(_) => self.shade.openness(Point2::new(sight.point.x, sight.point.z)),
            Target::Solid(..) if low => 0.55 + 0.75 * sight.point.y.max(0.0),
            Target::Solid(..) => 1.0,
        }
    }
}

/// Where the search along a ray ends.
fn far(ray: &Ray) -> f64 {
    if ray.direction.y < 0.0 && ray.origin.y > 0.0 {
        // Nothing is below the carriageway.
        FAR.min(-ray.origin.y / ray.direction.y + CARRIAGEWAY_SLACK)
    } else {
        FAR
    }
}

fn on_solid(ray: &Ray, index: u32, contact: Contact) -> Sight {
    Sight {
        distance: contact.distance,
        point: ray.at(contact.distance),
        normal: contact.normal,
        target: Target::Solid(index, contact),
    }
}

/// The part of the surface that a pixel covers: a disc across the ray, projected along the ray.
fn footprint(sight: &Sight, ray: &Ray, pixel: f64) -> Footprint {
    /// Cosine below which the footprint grows no more.
    const GRAZING: f64 = 0.02;
    let normal = sight.normal;
    let cosine = ray.direction.dot(&normal).abs().max(GRAZING);
    let across =
        Vector3::new(normal.z, 0.0, -normal.x).try_normalize(1e-6).unwrap_or_else(Vector3::x);
    let up = normal.cross(&across);
    let width = sight.distance * pixel;
    let extent = |axis: &Vector3<f64>| {
        let slant = ray.direction.dot(axis) / cosine;
        width * (1.0 + slant * slant).sqrt()
    };
    Footprint {
        along: Vector2::new(extent(&across), extent(&up)),
        slant: Vector2::new(-ray.direction.dot(&across), ray.direction.dot(&up)) / cosine,
        minor: width,
        major: width / cosine,
    }
}

#[cfg(test)]
mod tests {
    use super::super::material::Material;
    use super::super::shape::Shape;
    use super::*;

    #[test]
    fn about_half_of_the_cars_stand_where_they_stood() {
        let cars = |traversal| -> Vec<[f64; 4]> {
            Town::new(7, traversal, Season::Summer)
                .solids
                .iter()
                .filter_map(|solid| match (&solid.shape, &solid.material) {
                    (Shape::Car { frame, .. }, Material::Car(colour)) => {
                        Some([frame.origin.x, frame.origin.z, frame.ahead.x, colour.x])
                    }
                    _ => None,
                })
                .collect()
        };
        let (here, there) = (cars(1), cars(2));
        let stayed = here.iter().filter(|car| there.contains(car)).count();
        assert!((120..400).contains(&here.len()), "{}", here.len());
        assert!((0.4..0.6).contains(&(stayed as f64 / here.len() as f64)), "{stayed}");
    }

    #[test]
    fn what_lies_behind_a_wall_is_seen_farther_along_the_line_of_sight() {
        // A wall at z = 4 that faces the origin, seen obliquely to the right and upwards.
        let direction = Vector3::new(0.6, 0.3, 0.8).normalize();
        let ray = Ray { origin: Point3::origin(), direction };
        let sight = Sight {
            distance: 5.0,
            point: ray.at(5.0),
            normal: -Vector3::z(),
            target: Target::Solid(
                0,
                Contact {
                    distance: 5.0,
                    normal: -Vector3::z(),
                    uv: Vector2::zeros(),
                    part: Part::Front,
                },
            ),
        };
        let slant = footprint(&sight, &ray, 1e-3).slant;
        assert!((slant - Vector2::new(0.75, 0.375)).norm() < 1e-12, "{slant}");
    }
}
