//! Who takes part in a study: a simulated teacher, and people who speak with recorded sentences.
//! Both know what a person at the wire knows — the goal, the room, what the robot did and said — and
//! what they themselves mean. Neither sees a parser or a mind.

mod meaning;
mod parts;
mod recorded;
mod simulated;
mod talk;
mod teacher;
#[cfg(test)]
mod tests;
mod wording;

pub use meaning::{Aim, aim, carried_out_as_meant, run_for};
pub use recorded::{Episode as RecordedEpisode, Said, speak};
pub use simulated::{Episode as SimulatedEpisode, Person, teach};
pub use talk::{Talk, TalkError, Turn, Wire};
pub use teacher::{Teacher, TeacherError};
