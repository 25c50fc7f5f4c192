//! The edge: speaks ZeroMQ, translates wire messages to requests and answers back. The wire is
//! described for strangers in `schema/wire.md`.

mod counters;
mod door;
mod erasures;
mod feed;
mod gateway;
mod lock;
mod outbox;
mod passes;
#[allow(unsafe_code, reason = "it calls functions of libzmq")]
mod raw;
mod rights;
mod unsent;
mod zap;

pub use counters::{Counters, Counts};
pub use feed::FeedDoor;
pub use gateway::{Doors, Gateway, GatewayError, LockedDoor};
