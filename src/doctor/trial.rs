//! Which mistake explains why a scene does not fit its own photos.

use std::collections::BTreeMap;

use super::calibration::Outlines;
use super::correction::Correction;
use super::matches::DepthCells;
use super::reading::{Change, FOOT_M, Mistake, READ_WITH_5000, Reading, readings};
use super::sample::{AS_STATED, Agreement, Sample, mean};

/// The least mean gain of another reading over the frames.
const TELLING_GAIN: f64 = 0.04;
/// The same of a reading whose numbers were chosen, and what counts of it: numbers fit where a usual mistake is the
/// cause, too.
const TELLING_GAIN_OF_NUMBERS: f64 = 0.08;
const CHOSEN: f64 = 0.8;
/// The fewest frames that a reading with a free number is fitted to, and the fewest that it is tested on.
const MIN_FRAMES: usize = 3;
/// The least mean gain in standard errors of the mean.
const CERTAIN: f64 = 2.5;
/// A reading that gains this share of what the best one gains is named beside it: one without numbers of its own, and one
/// with numbers, which fit less closely.
const AS_GOOD: f64 = 0.9;
const AS_GOOD_WITH_NUMBERS: f64 = 0.7;

/// What sound scenes reach at least where photos share a view: the share of the shared features that the poses explain,
/// the correlation of grey values, as Fisher's z, and the log ratio of edges.
pub(super) const FITTING_MOTIONS: f64 = 0.4;
const FITTING_MOTIONS_IN_ROOMS: f64 = 0.25;
const FITTING_CARRIED: f64 = 0.35;
const FITTING_EDGES: f64 = 0.1;

/// The least share of neighbouring points with like depths: 0.9 in scans, 0.2 where depths are noise.
pub(super) const SURFACES: f64 = 0.4;

/// Factors between usual units of length, and between 1000 and 5000 for one metre in depth images.
pub(super) const UNITS: [f64; 8] = [1e3, 1e2, 1e-3, 1e-2, FOOT_M, 1.0 / FOOT_M, 5.0, 0.2];

/// A reading that fits better than the scene as stated.
#[derive(Clone, Debug)]
pub struct Finding {
    /// The mistake.
    pub mistake: Mistake,
    /// How to correct it.
    pub remedy: String,
    /// The same as a line to write, where there is one.
    pub correction: Option<Correction>,
    /// The agreement of the scene as stated.
    pub stated: Agreement,
    /// The agreement in the other reading.
    pub otherwise: Agreement,
    /// Other mistakes that explain it nearly as well, each with how to correct it.
    pub or: Vec<(Mistake, String)>,
    /// A second mistake, which shows when the first is corrected.
    pub then: Option<Box<Finding>>,
}

/// Whether clouds, photos, cameras and poses fit together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fit {
    /// They fit, as stated or as the finding says.
    Fits,
    /// They do not, and no usual mistake explains it.
    Unexplained,
    /// No two photos share a view, so that only the edges within single photos were compared.
    NoSharedView,
}

/// A reading with its gain and its agreement.
struct Judged {
    gain: f64,
    reading: Reading,
    otherwise: Agreement,
}

impl Sample<'_> {
    /// The agreement of the scene as stated, whether it fits, and the mistake that explains it if it does not.
    pub(super) fn diagnose(self) -> (Agreement, Fit, Option<Finding>) {
        let stated = self.agreement();
        // Of depths that are noise, something fits by chance.
        if self.smooth_share() < SURFACES {
            let is_seen = self.fit() != Fit::NoSharedView;
            return (stated, if is_seen { Fit::Unexplained } else { Fit::NoSharedView }, None);
        }
        let two = self.two();
        let (fit, found) = match two {
            Some((fit, finding)) => (fit, Some(finding)),
            None => self.chained(),
        };
        (stated, fit, found)
    }

    /// A first mistake that is found by the motions of features, whatever the poses are, with what explains the rest. It
    /// may be chance, so the scene must fit in the end.
    fn two(&self) -> Option<(Fit, Finding)> {
        let usual: Vec<Reading> = self.usual().collect();
        let first = self.first_of_two(&usual).map(|one| self.finding_of(one));
        let first =
            first.or_else(|| if self.fit() == Fit::Fits { None } else { self.cloud_by_motions() });
        let (finding, change) = first?;
        let (fit, rest) = self.clone().read_as(&change).chained();
        // A second reading of the same kind takes the first one back.
        let mut of_rest = std::iter::successors(rest.as_ref(), |found| found.then.as_deref());
        let is_kept = of_rest.all(|found| found.mistake != finding.mistake);
        (fit == Fit::Fits && is_kept)
            .then(|| (fit, Finding { then: rest.map(Box::new), ..finding }))
    }

    /// A reading as a finding, with nothing beside it.
    fn finding_of(&self, reading: Reading) -> (Finding, Change) {
        let finding = Finding {
            mistake: reading.mistake,
            remedy: reading.remedy,
            correction: reading.correction,
            stated: self.agreement(),
            otherwise: Agreement::mean(&self.scores(&self.anchors, &reading.change)),
            or: Vec::new(),
            then: None,
        };
        (finding, reading.change)
    }

    /// The best reading, and what explains the rest; with whether the scene fits in the end.
    fn chained(self) -> (Fit, Option<Finding>) {
        /// How many mistakes are found one after the other.
        const MISTAKES: usize = 2;
        let (mut sample, mut found, mut fit) = (self, Vec::new(), None);
        while found.len() < MISTAKES {
            let Some((finding, change)) = sample.or_by_outlines(sample.best()) else { break };
            found.push(finding);
            // No scene can be read with another lens, so nothing further is found.
            if matches!(change, Change::Lens(_)) {
                fit = Some(Fit::Fits);
                break;
            }
            sample = sample.read_as(&change);
        }
        let chain = |then, finding| Finding { then: Some(Box::new(then)), ..finding };
        (fit.unwrap_or_else(|| sample.fit()), found.into_iter().rev().reduce(chain))
    }

    fn agreement(&self) -> Agreement {
        Agreement::mean(&self.scores(&self.anchors, &AS_STATED))
    }

    /// The share of neighbouring points that have like depths.
    pub(super) fn smooth_share(&self) -> f64 {
        let of = |anchor: &usize| {
            let (sight, seen) = (self.sights.get(anchor)?, self.seen(*anchor)?.1);
            DepthCells::new(&sight.camera, &seen).smooth_share()
        };
        mean(self.anchors.iter().filter_map(of)).unwrap_or(1.0)
    }

    /// How well the scene fits as stated.
    fn fit(&self) -> Fit {
        let stated = self.agreement();
        let [pairs, shared, motions] = self.pairs();
        // Photos that are taken close together have like grey values at any depth.
        let least = |number: Option<f64>, least: f64| number.is_some_and(|number| number >= least);
        let has_more = match stated.edges {
            Some(edges) => edges >= FITTING_EDGES,
            None => least(stated.motions, FITTING_MOTIONS_IN_ROOMS),
        };
        let fits = least(stated.motions, FITTING_MOTIONS)
            || has_more && least(stated.carried, FITTING_CARRIED);
        log::debug!("{pairs} pairs of photos, {shared} share a view, {motions} agree on a motion");
        // Streets look alike, so that some photos of different places seem to share a view.
        if fits {
            Fit::Fits
        } else if pairs > 0 && (2 * shared >= pairs || 4 * motions >= pairs) {
            Fit::Unexplained
        } else {
            Fit::NoSharedView
        }
    }

    /// The readings without numbers that are chosen.
    fn usual(&self) -> impl Iterator<Item = Reading> {
        let usual = readings().into_iter().map(|one| match one.change {
            Change::Resized(_) => self.with_camera(one),
            _ => one,
        });
        usual.chain(self.camera_of_other_size())
    }

    /// A reading of clouds or cameras under which features agree on motions, where they agree on none as stated. It does
    /// not count on the poses, which may be wrong too.
    fn cloud_by_motions(&self) -> Option<(Finding, Change)> {
        /// How many times as many motions the reading must give.
        const TIMES: usize = 3;
        let [_, shared, as_stated] = self.pairs();
        if 3 * as_stated >= shared {
            return None;
        }
        let counted = self.usual().filter(|one| one.change.is_of_views()).map(|one| {
            let found = self.motions_in(&one.change);
            (found.values().flatten().flatten().count(), one)
        });
        // Of equal ones the first.
        let best = counted.reduce(|best, next| if next.0 > best.0 { next } else { best });
        let (_, reading) =
            best.filter(|(count, _)| 2 * count >= shared && *count >= TIMES * as_stated.max(1))?;
        Some(self.finding_of(reading))
    }

    /// The reading that fits better than the scene as stated, if any.
    fn best(&self) -> Option<(Finding, Change)> {
        let stated = self.scores(&self.anchors, &AS_STATED);
        let usual = self.usual().filter(|reading| self.may_be(&reading.change));
        let mut tried: Vec<Judged> = usual
            .chain(self.other_scale())
            .filter_map(|reading| {
                let scores = self.scores(&self.anchors, &reading.change);
                judged(reading, &stated, &scores)
            })
            .collect();
        // What chose a number cannot show that it is right.
        let half = |of: usize| self.anchors.iter().copied().skip(of).step_by(2).collect::<Vec<_>>();
        let [choosing, testing] = [half(0), half(1)];
        if choosing.len().min(testing.len()) >= MIN_FRAMES {
            let stated = self.scores(&testing, &AS_STATED);
            tried.extend(self.searched(&choosing).into_iter().filter_map(|reading| {
                let scores = self.scores(&testing, &reading.change);
                let judged = judged(reading, &stated, &scores)?;
                let gain = CHOSEN * judged.gain;
                let is_telling = gain >= TELLING_GAIN_OF_NUMBERS
                    && self.explains_more(&testing, &judged, &Agreement::mean(&stated));
                is_telling.then_some(Judged { gain, ..judged })
            }));
        }
        // The best reading of each mistake; of equal ones the first.
        let mut best: BTreeMap<Mistake, Judged> = BTreeMap::new();
        for one in tried {
            let is_better =
                best.get(&one.reading.mistake).is_none_or(|known| one.gain > known.gain);
            if is_better {
                best.insert(one.reading.mistake, one);
            }
        }
        let mut kinds: Vec<Judged> = best.into_values().collect();
        kinds.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let mut kinds = kinds.into_iter();
        let Judged { gain, reading, otherwise } = kinds.next()?;
        let as_good = kinds.filter(|one| {
            let numbers = one.reading.change.has_numbers() || reading.change.has_numbers();
            one.gain >= gain * if numbers { AS_GOOD_WITH_NUMBERS } else { AS_GOOD }
        });
        let finding = Finding {
            mistake: reading.mistake,
            remedy: reading.remedy,
            correction: reading.correction,
            stated: Agreement::mean(&stated),
            otherwise,
            or: as_good.map(|one| (one.reading.mistake, one.reading.remedy)).collect(),
            then: None,
        };
        Some((finding, reading.change))
    }

    /// What the outlines of things say, where no mistake is found although they may show one, and where numbers of the
    /// camera or of the clouds were chosen: outlines locate these more closely.
    fn or_by_outlines(&self, best: Option<(Finding, Change)>) -> Option<(Finding, Change)> {
        /// What shared features and grey values vary by.
        const LOST: f64 = 0.03;
        /// How exactly a centre says of which size the photos are, as a share.
        const OF_SIZE: f64 = 0.1;
        let is_asked = match &best {
            None => self.fit() == Fit::Fits,
            Some((_, change)) => {
                matches!(
                    change,
                    Change::Aside(_) | Change::Camera { .. } | Change::Move(_) | Change::Resized(_)
                )
            }
        };
        // The outlines are those of the clouds as stated.
        if !is_asked || !self.has_stated_clouds {
            return best;
        }
        let stated = self.agreement();
        let shared =
            |one: &Agreement| one.carried.map_or(0.0, f64::tanh) + one.motions.unwrap_or(0.0);
        let of = |change: &Change| Agreement::mean(&self.scores(&self.anchors, change));
        let is_possible = |change: &Change| shared(&of(change)) >= shared(&stated) - LOST;
        let Some(outlines) = Outlines::of(self.scene) else { return best };
        // Numbers that were chosen by other measures must put depth edges on edges.
        let best = best.filter(|(_, change)| outlines.confirm(change) != Some(false));
        let found = outlines.gross(self.scene, &is_possible);
        // The centre of a camera says of which size its photos are, if not exactly.
        let of_size = match best {
            Some((_, Change::Resized(times))) => Some(times),
            _ => None,
        };
        let found = found.filter(|one| match (of_size, one.change) {
            (None, _) => true,
            (Some(size), Change::Camera { times, .. }) => (times / size).ln().abs() < OF_SIZE,
            _ => false,
        });
        let Some(reading) = found else { return best };
        let reading = match reading.change {
            Change::Camera { .. } => self.with_camera(reading),
            _ => reading,
        };
        Some(self.finding_of(reading))
    }

    /// Whether something that does not rest on the poses speaks for a reading: depth edges fall on edges of the photos, or
    /// the features agree better on motions of their own. Poses that are a little off make another camera or cloud fit
    /// them, but neither of these.
    fn explains_more(&self, anchors: &[usize], judged: &Judged, stated: &Agreement) -> bool {
        /// How much better, as a share.
        const MORE: f64 = 1.01;
        let change = &judged.reading.change;
        // Motions are found with a camera that bends nothing.
        if matches!(change, Change::Lens(_)) || gains_edges(stated, &judged.otherwise) {
            return true;
        }
        let explained = |change: &Change| -> f64 {
            let motions = self.motions_in(change);
            let of = anchors.iter().filter_map(|anchor| motions.get(anchor));
            of.flatten().flatten().map(|motion| motion.explained).sum()
        };
        explained(change) >= MORE * explained(&AS_STATED)
    }

    /// Lengths of poses that are too long or too short by one factor, by the motions.
    fn other_scale(&self) -> Option<Reading> {
        /// A difference that the depths of clouds and the poses of a sound scene may have.
        const SAME: f64 = 0.08;
        /// The factor of a unit is met as closely.
        const OF_UNIT: f64 = 0.03;
        let (measured, error) = self.scale_of(&AS_STATED)?;
        if measured.ln().abs() <= SAME.max(3.0 * error) {
            return None;
        }
        let off = OF_UNIT.max(2.0 * error);
        let unit = UNITS.into_iter().find(|unit| (measured / unit).ln().abs() < off);
        Some(self.of_scale(unit.unwrap_or(measured), unit))
    }

    /// Poses whose lengths are to be multiplied by a factor, which may be that of a unit.
    pub(super) fn of_scale(&self, times: f64, unit: Option<f64>) -> Reading {
        let remedy = match unit {
            Some(1e3 | 1e2) if self.has_far_clouds() => {
                format!("divide the coordinates of clouds by {times:.0}")
            }
            Some(1e-3 | 1e-2) => format!("divide the positions of poses by {:.0}", 1.0 / times),
            Some(FOOT_M) => "multiply the positions of poses by 0.3048".to_owned(),
            Some(5.0) => "divide the coordinates of clouds by 5; if these are depth images that are read with 1000 \
                          for one metre, 5000 is one metre"
                .to_owned(),
            Some(0.2) => READ_WITH_5000.to_owned(),
            _ => format!("divide the coordinates of clouds, or multiply the positions of poses, by {times:.3}"),
        };
        let reading = Reading::new(Mistake::Units, &remedy, Change::Size(1.0 / times));
        match unit {
            Some(1e3) if self.has_far_clouds() => reading.with_unit("clouds", "\"mm\""),
            Some(1e2) if self.has_far_clouds() => reading.with_unit("clouds", "\"cm\""),
            Some(0.2) => reading.with_depth_per_metre("1000"),
            Some(5.0) => reading.with_depth_per_metre("5000"),
            _ => reading.with_unit("poses", &format!("{times:.4}")),
        }
    }
}

/// A reading with its gain and its agreement, if it explains the misfit.
fn judged(reading: Reading, stated: &[Agreement], scores: &[Agreement]) -> Option<Judged> {
    let gain = gain(stated, scores);
    let (before, after) = (Agreement::mean(stated), Agreement::mean(scores));
    log::debug!("{:?} {}: {gain:?} {before:?} {after:?}", reading.mistake, reading.remedy);
    let judged = Judged { gain: gain?, reading, otherwise: after };
    explains(&before, &after, judged.reading.change.has_numbers()).then_some(judged)
}

/// Whether a reading reaches what scenes without a mistake reach, in what was bad before.
///
/// Numbers that are chosen find some edges by chance.
fn explains(before: &Agreement, after: &Agreement, has_numbers: bool) -> bool {
    const EDGES_LOST: f64 = 0.12;
    /// A reading whose poses explain this many times as many features is no chance fit.
    const MANY_TIMES: f64 = 4.0;
    let of = |number: Option<f64>| number.unwrap_or(0.0);
    let gains_edges = gains_edges(before, after);
    // The poses of rooms explain less of what a rolling shutter shows.
    let is_many = of(after.motions) >= MANY_TIMES * of(before.motions);
    let is_clear = gains_edges || is_many && !has_numbers;
    let least = if is_clear { FITTING_MOTIONS_IN_ROOMS } else { FITTING_MOTIONS };
    let is_shared = of(after.motions) >= least && of(after.carried) >= FITTING_CARRIED;
    // What fitted may not get worse.
    let is_kept = of(after.motions) > of(before.motions) - 0.05;
    // Depths that are taken for others may draw photos together, but not onto their edges.
    let keeps_edges = before.edges.is_none_or(|edges| of(after.edges) >= edges - EDGES_LOST);
    is_kept && keeps_edges && (is_shared || gains_edges && !has_numbers)
}

/// Whether depth edges reach what those of sound scenes reach, and did not before.
fn gains_edges(before: &Agreement, after: &Agreement) -> bool {
    const EDGES: f64 = 0.2;
    const GAINED: f64 = 0.2;
    let of = |number: Option<f64>| number.unwrap_or(0.0);
    of(after.edges) >= EDGES && of(after.edges) - of(before.edges) >= GAINED
}

/// The mean gain of a reading, if it is significant.
fn gain(stated: &[Agreement], other: &[Agreement]) -> Option<f64> {
    let gains: Vec<f64> = stated
        .iter()
        .zip(other)
        .filter(|(_, other)| other.edges.is_some() || other.carried.is_some())
        .map(|(stated, other)| other.worth() - stated.worth())
        .collect();
    let count = gains.len() as f64;
    // With few frames, a chance fit of two must not count as a mistake.
    if gains.len() < MIN_FRAMES.min(stated.len()).max(2) || gains.len() * 2 < stated.len() {
        return None;
    }
    let mean = gains.iter().sum::<f64>() / count;
    let variance = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / count;
    let error = (variance / (count - 1.0).max(1.0)).sqrt();
    (mean > TELLING_GAIN && mean > CERTAIN * error).then_some(mean)
}
