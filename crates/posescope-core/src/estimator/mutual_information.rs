//! MI, the direct mutual-information method (paper, section 2.4).

use super::direct::Direct;
use crate::cost::MutualInformation;
use crate::method::Method;
use crate::params::Params;

/// The estimator that maximises the normalised mutual information.
pub fn mutual_information(params: &Params) -> Direct {
    Direct {
        method: Method::MutualInformation,
        cost: Box::new(MutualInformation::new(&params.mi)),
        render: params.render.clone(),
        grid: params.grid.clone(),
        cost_key: format!("{:?}", params.mi),
    }
}
