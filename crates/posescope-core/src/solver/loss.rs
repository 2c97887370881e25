//! Robust losses: the influence of large residuals.

use crate::describe::choice;

/// A loss `ρ(r²)` on the squared length of a residual, about `r²` for small residuals.
///
/// Minimising `Σ ρ(rᵢ²)` is, step by step, weighted least squares with the weights
/// `w(r²) = dρ/d(r²)` (Huber, *Robust Statistics*, 1981; Zhang, *Parameter Estimation
/// Techniques*, Image and Vision Computing 1997, table 1). The scales are in the unit of `r`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loss {
    /// `r²`: least squares, every residual counts in full.
    Squared,
    /// `r²` up to the scale, then `2 s r − s²`: the pull of a residual stops growing.
    Huber(f64),
    /// `s² ln(1 + r²/s²)`: the pull of a residual fades beyond the scale.
    Cauchy(f64),
}

/// The shape of a [`Loss`], without its scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LossShape {
    /// [`Loss::Squared`].
    Squared,
    /// [`Loss::Huber`].
    Huber,
    /// [`Loss::Cauchy`].
    Cauchy,
}

choice!(LossShape: Squared = "squared", Huber = "huber", Cauchy = "cauchy");

impl LossShape {
    /// The loss of this shape with a scale; least squares have none.
    pub fn at(self, scale: f64) -> Loss {
        match self {
            Self::Squared => Loss::Squared,
            Self::Huber => Loss::Huber(scale),
            Self::Cauchy => Loss::Cauchy(scale),
        }
    }
}

impl Loss {
    /// `ρ(r²)`, in the square of the unit of `r`.
    #[inline]
    pub fn rho(self, squared_residual: f64) -> f64 {
        match self {
            Self::Squared => squared_residual,
            Self::Huber(scale) if squared_residual <= scale * scale => squared_residual,
            Self::Huber(scale) => scale * (2.0 * squared_residual.sqrt() - scale),
            Self::Cauchy(scale) => scale * scale * (squared_residual / (scale * scale)).ln_1p(),
        }
    }

    /// `dρ/d(r²)`, between 0 and 1.
    #[inline]
    pub fn weight(self, squared_residual: f64) -> f64 {
        match self {
            Self::Squared => 1.0,
            Self::Huber(scale) if squared_residual <= scale * scale => 1.0,
            Self::Huber(scale) => scale / squared_residual.sqrt(),
            Self::Cauchy(scale) => (1.0 + squared_residual / (scale * scale)).recip(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Loss; 3] = [Loss::Squared, Loss::Huber(1.5), Loss::Cauchy(1.5)];

    #[test]
    fn the_weight_is_the_derivative_of_the_loss() {
        // 2.25 is the kink of the Huber loss; its first derivative is continuous there.
        for loss in ALL {
            for s in [0.01, 1.0, 2.2, 2.3, 9.0, 400.0] {
                let h = 1e-6 * s;
                let numeric = (loss.rho(s + h) - loss.rho(s - h)) / (2.0 * h);
                assert!((numeric - loss.weight(s)).abs() < 1e-8, "{loss:?} at {s}");
            }
        }
    }

    #[test]
    fn small_residuals_count_in_full_and_large_ones_in_order_squared_huber_cauchy() {
        for loss in ALL {
            assert!((loss.rho(1e-6) - 1e-6).abs() < 1e-11);
            assert_eq!(loss.rho(0.0), 0.0);
        }
        let far = ALL.map(|loss| loss.rho(100.0));
        assert!(far[0] > far[1] && far[1] > far[2]);
        assert_eq!(far[1], 1.5 * (2.0 * 10.0 - 1.5));
    }
}
