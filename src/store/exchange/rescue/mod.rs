//! Reading records straight from the bytes of the database's file, without the database: it refuses
//! to open, or ends in a panic, over damage that leaves most records whole. Records never change, and
//! each carries its own checksum, digest and place, so whatever is found can be proved or dropped.
//!
//! Nothing here writes, and nothing here believes what it reads.

mod directory;
mod index;
mod pages;
mod trees;

pub use self::directory::{Loss, Rescue, RescueError, StreamFound};
