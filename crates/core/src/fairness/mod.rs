//! Sharing between tenants: whose turn it is, how much room each may take, and how fast a bucket of
//! tokens fills. Pure: times are given, and the same calls give the same answers.

mod bucket;
mod room;
mod trainings;
mod turns;

pub use bucket::{Bucket, TOKEN};
pub use room::Room;
pub use trainings::Trainings;
pub use turns::Turns;
