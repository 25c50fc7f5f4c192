//! The wire of `apprentice` and its client: what you can ask of a service, what it answers, and how
//! both travel over ZeroMQ. `schema/wire.md` describes the same for programs in other languages.
//!
//! [`Client`] sends one person's requests; `examples/talk.rs` shows it at work. [`Follower`] keeps
//! a copy of a tenant's records. [`protocol`] has the requests and the answers, and [`wire`] their
//! encoding.

#![warn(missing_docs)]

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

/// A ZeroMQ context. A client in the same process shares it with the service.
pub type Context = zmq::Context;
