use serde::{Deserialize, Serialize};

/// Which arithmetic a mind was trained with. A change in `numerics` that changes a bit of any
/// result gets a new number. Recipes name their number, so an old mind is never compared with new
/// sums.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct NumericsVersion(
    /// From 1.
    pub u16,
);

impl NumericsVersion {
    /// What this build computes with.
    pub const CURRENT: NumericsVersion = NumericsVersion(1);
}
