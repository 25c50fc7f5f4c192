//! Whole studies: participants who talk to the real service through real sockets, one service for
//! each condition, with everything kept so that a study that was killed goes on.

mod design;
mod driver;
mod journal;
mod people;
mod scene_text;
mod tables;

pub use design::{Condition, Design, Who};
pub use driver::{Finished, Run, RunError, State};
pub use people::{Participant, PeopleError, Recorded, recorded_people, simulated_people};
pub use tables::{MeasureError, make_tables};
