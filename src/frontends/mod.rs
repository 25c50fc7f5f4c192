//! The service's end of the wire: receives requests over ZeroMQ, decides who may ask what, and
//! sends the answers. Publishes the feed. `schema/wire.md` describes the wire for other programs.

mod counters;
mod erasures;
mod feed;
mod gateway;
mod listener;
mod lock;
mod outbox;
mod passes;
#[allow(unsafe_code, reason = "it calls functions of libzmq")]
mod raw;
mod rights;
mod unsent;
mod zap;

pub use counters::{Counters, Counts};
pub use feed::FeedSettings;
pub use gateway::{Endpoints, Gateway, GatewayError, KeyedEndpoints};
