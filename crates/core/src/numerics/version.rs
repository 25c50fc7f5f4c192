use serde::{Deserialize, Serialize};

/// Which arithmetic a mind was trained with. Any change of this room that changes a bit of any
/// result gets a new number; recipes name theirs, so an old mind is never held against new sums.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct NumericsVersion(pub u16);

impl NumericsVersion {
    /// What this build computes with.
    pub const CURRENT: NumericsVersion = NumericsVersion(1);
}
