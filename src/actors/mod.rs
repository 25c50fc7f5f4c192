//! Who is awake: one mailbox for each person, one pool of trainers, one directory for all.

mod awake;
mod directory;
mod failure;
mod house;
mod life;
mod response;
mod submit;
mod trainer;
mod user;

pub use failure::{Alarm, Failure};
pub use house::{ActorsError, Front, House, HouseSettings, NotTaken, Wakings};
pub use response::{Ask, Busy, ErrorCode, Failed, Hello, Rejected, Response, Waited};
pub use submit::{AnswerTo, Submit};
