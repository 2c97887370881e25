//! PM, the direct photometric method (paper, section 2.3 and appendix B).

use super::direct::Direct;
use crate::cost::Photometric;
use crate::method::Method;
use crate::params::Params;

/// The estimator that minimises the robust photometric error.
pub fn photometric(params: &Params) -> Direct {
    Direct {
        method: Method::Photometric,
        cost: Box::new(Photometric::new(&params.pm)),
        render: params.render.clone(),
        grid: params.grid.clone(),
        cost_key: format!("{:?}", params.pm),
    }
}
