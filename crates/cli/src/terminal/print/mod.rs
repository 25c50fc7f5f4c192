//! What the conversation shows, as text. Pure: every function here only builds strings.

mod answer;
mod goal;
mod help;
mod known;
mod room;
mod status;
mod teaching;
mod why;
mod words;

#[cfg(test)]
mod samples;

pub use answer::answer;
pub use goal::{goal, progress};
pub use help::{help, teaching_help};
pub use known::known;
pub use room::{holding, look, summary};
pub use status::{status, welcome};
pub use teaching::{after, learned, teaching_question};
pub use why::why;
pub use words::{one_line, sentence};
