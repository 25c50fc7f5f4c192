//! Where bytes outlive processes: the ports for durable things, and their adapters.

mod log;

pub use log::{AppendError, EventLog, Pending, ReadError};
