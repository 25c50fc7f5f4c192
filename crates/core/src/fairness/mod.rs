//! Sharing between tenants: whose turn it is, how much room each may take, and how fast a bucket of
//! tokens fills. Pure: times are given, and the same calls give the same answers.

mod bucket;
mod fair_queue;
mod room;
mod trainings;

pub use bucket::{Bucket, TOKEN};
pub use fair_queue::FairQueue;
pub use room::Room;
pub use trainings::Trainings;
