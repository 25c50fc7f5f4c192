//! Sharing between tenants: whose turn it is, and how fast a bucket of tokens fills. Pure: times
//! are given, and the same calls give the same answers.

mod bucket;
mod trainings;
mod turns;

pub use bucket::Bucket;
pub use trainings::Trainings;
pub use turns::Turns;
