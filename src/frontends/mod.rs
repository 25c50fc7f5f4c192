//! The edge: speaks ZeroMQ, translates wire messages to requests and answers back. The wire is
//! described for strangers in `schema/wire.md`.

mod client;
mod endpoint;
mod gateway;
mod outbox;
pub mod wire;

pub use client::{Client, ClientError, fresh_id};
pub use endpoint::{Endpoint, EndpointError};
pub use gateway::{Counters, Counts, Gateway, GatewayError};

/// A ZeroMQ context: what a client inside the process shares with the gateway.
pub type Context = zmq::Context;
