//! One user, as a state machine: the decider says which events a command deserves, `apply` says
//! what an event does to the state. Pure: no clock, no entropy, no file, no socket.

mod command;
mod rejection;
mod reply;

pub use command::{Command, OnClash, Query};
pub use rejection::{Rejection, RejectionCode};
pub use reply::{ActionView, KnownExemplar, Phase, Reply, Status, Teachable, Told};
