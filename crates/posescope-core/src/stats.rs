//! Statistics of a few numbers.

/// The median, of two the lower; `None` of nothing.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len().checked_sub(1)? / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The median, of two the upper; NaN of nothing.
pub(crate) fn upper_median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The median, and the standard deviation that a normal distribution of the same median absolute deviation
/// has, which is never 0.
pub(crate) fn median_and_deviation(values: &mut [f64]) -> Option<(f64, f64)> {
    let centre = median(values)?;
    let mut deviations: Vec<f64> = values.iter().map(|value| (value - centre).abs()).collect();
    let deviation = 1.4826 * median(&mut deviations)?;
    Some((centre, deviation.max(1e-9)))
}

/// The mean, and the sum of the squared deviations from it; `None` of nothing.
pub(crate) fn mean_and_squares(values: &[f64]) -> Option<(f64, f64)> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let squares = values.iter().map(|value| (value - mean).powi(2)).sum();
    (!values.is_empty()).then_some((mean, squares))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_by_hand() {
        assert_eq!(median(&mut [4.0, 1.0, 3.0, 2.0]), Some(2.0));
        assert_eq!(upper_median(&mut [4.0, 1.0, 3.0, 2.0]), 3.0);
        assert!(upper_median(&mut []).is_nan());
        assert_eq!(median_and_deviation(&mut [1.0, 2.0, 3.0]), Some((2.0, 1.4826)));
        assert_eq!(median_and_deviation(&mut [5.0; 3]), Some((5.0, 1e-9)));
        assert_eq!(mean_and_squares(&[1.0, 3.0]), Some((2.0, 2.0)));
        assert_eq!((median(&mut []), mean_and_squares(&[])), (None, None));
    }
}
