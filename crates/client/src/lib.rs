//! The wire of `apprentice` and its client: what can be asked of a service, what it answers, and how
//! both travel over ZeroMQ. Nothing here knows how a service works inside; `schema/wire.md`
//! describes the same for programs in other languages.

mod client;
mod curve_keys;
mod endpoint;
mod feed;
mod follower;
mod probe;
pub mod protocol;
pub mod wire;
mod z85;

pub use client::{Client, ClientError, Identity, fresh_id};
pub use curve_keys::{CurveKey, CurveKeyError, REBUILD_WITH_CURVE, public_file, read_public};
pub use endpoint::{Endpoint, EndpointError};
pub use feed::{BEAT, FeedMessage};
pub use follower::{FollowError, Followed, Follower, Position};
pub use protocol::*;
pub use z85::show as show_key;

/// A ZeroMQ context: what a client inside the process shares with the gateway.
pub type Context = zmq::Context;
