//! How the values of two images fall together: counts, entropies, and what they share.

use super::IntensityPair;

/// How often each pair of grey values occurs, and the entropies that follow \[nat\].
#[derive(Clone, Debug, PartialEq)]
pub struct JointHistogram {
    /// Bins per axis.
    pub bins: usize,
    /// Counts, `bins` × `bins`; rows are the query's bins, columns the synthetic view's.
    pub counts: Vec<u32>,
    /// H(I_Q).
    pub query_entropy: f64,
    /// H(I_S).
    pub synthetic_entropy: f64,
    /// H(I_S, I_Q).
    pub joint_entropy: f64,
}

impl JointHistogram {
    /// Counts the pairs; values fall into `bins` equal intervals of 0 … 255, 255 into the last one.
    pub fn of(pairs: &[IntensityPair], bins: usize) -> Self {
        let mut counts = vec![0_u32; bins * bins];
        for pair in pairs {
            counts[cell(pair, bins)] += 1;
        }
        let rows = counts.chunks(bins).map(|row| row.iter().sum());
        let columns = (0..bins).map(|column| counts.iter().skip(column).step_by(bins).sum());
        Self {
            bins,
            query_entropy: entropy(rows, pairs.len()),
            synthetic_entropy: entropy(columns, pairs.len()),
            joint_entropy: entropy(counts.iter().copied(), pairs.len()),
            counts,
        }
    }

    /// The position in [`Self::counts`] of the cell that a pair falls into.
    pub fn cell(&self, pair: &IntensityPair) -> usize {
        cell(pair, self.bins)
    }

    /// ln p(q, s) / (p(q) p(s)) of each cell \[nat\]: what a pair in it says about whether the images
    /// belong together. Its mean over all pairs is their mutual information. 0 where no pair is.
    pub fn pointwise(&self) -> Vec<f64> {
        let Self { bins, counts, .. } = self;
        let sum = |cells: &mut dyn Iterator<Item = &u32>| cells.map(|&c| f64::from(c)).sum::<f64>();
        let rows: Vec<f64> = counts
            .chunks(*bins)
            .map(|row| sum(&mut row.iter()))
            .collect();
        let columns: Vec<f64> = (0..*bins)
            .map(|column| sum(&mut counts.iter().skip(column).step_by(*bins)))
            .collect();
        let all: f64 = rows.iter().sum();
        counts
            .iter()
            .enumerate()
            .map(|(cell, &count)| match count {
                0 => 0.0,
                _ => (f64::from(count) * all / (rows[cell / bins] * columns[cell % bins])).ln(),
            })
            .collect()
    }

    /// NMI in 0 … 1, normalised by the larger entropy; `None` where both images are constant.
    pub fn normalized_mutual_information(&self) -> Option<f64> {
        let larger = self.query_entropy.max(self.synthetic_entropy);
        (larger > 0.0).then(|| (self.mutual_information() / larger).clamp(0.0, 1.0))
    }

    /// I(Q, S) = H(Q) + H(S) − H(S, Q) \[nat\].
    pub fn mutual_information(&self) -> f64 {
        self.query_entropy + self.synthetic_entropy - self.joint_entropy
    }
}

fn cell(pair: &IntensityPair, bins: usize) -> usize {
    let scale = bins as f32 / 256.0;
    let bin = |value: f32| ((value * scale) as usize).min(bins - 1);
    bin(pair.query) * bins + bin(pair.synthetic)
}

/// H = log n − (Σ c log c) / n, with n = Σ c \[nat\].
fn entropy(counts: impl Iterator<Item = u32>, total: usize) -> f64 {
    if total == 0 {
        return 0.0;
    }
    let sum: f64 = counts
        .filter(|&count| count > 1)
        .map(|count| f64::from(count) * f64::from(count).ln())
        .sum();
    let total = total as f64;
    (total.ln() - sum / total).max(0.0)
}
