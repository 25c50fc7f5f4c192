//! The edge: speaks ZeroMQ, translates wire messages to requests and answers back. The wire is
//! described for strangers in `schema/wire.md`.

mod client;
mod counters;
mod curve_keys;
mod door;
mod endpoint;
mod erasures;
mod feed;
mod follower;
mod gateway;
mod lock;
mod orders;
mod outbox;
mod passes;
mod probe;
#[allow(unsafe_code, reason = "it calls functions of libzmq")]
mod raw;
mod rights;
mod unsent;
pub mod wire;
mod z85;
mod zap;

pub use client::{Client, ClientError, Identity, fresh_id};
pub use counters::{Counters, Counts};
pub use curve_keys::{CurveKey, CurveKeyError, public_file, read_public};
pub use endpoint::{Endpoint, EndpointError};
pub use feed::{BEAT, FeedDoor, FeedMessage};
pub use follower::{FollowError, Followed, Follower, Position};
pub use gateway::{Doors, Gateway, GatewayError, LockedDoor};
pub use z85::show as show_key;

/// A ZeroMQ context: what a client inside the process shares with the gateway.
pub type Context = zmq::Context;
