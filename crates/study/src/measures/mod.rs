//! The tables of a study: pure functions of what the event log recorded and of what each
//! participant noted in their journal. `docs/study.md` says what every column is.

mod rows;
mod summary;
mod tables;

pub use rows::{Entry, EpisodeRow, Heard, Life, LifeError, UtteranceRow, rows_of};
pub use summary::{ALL, AnsweredRow, FEW, MEASURES, SummaryRow, answered, summary};
pub use tables::{Tables, TablesError};
