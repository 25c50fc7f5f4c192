//! The tables of a study: pure functions of what the event log recorded and of what each
//! participant noted in their journal. `docs/study.md` says what every column is.

mod csv;
mod rows;
mod summary;

pub use csv::{answered_csv, episodes_csv, summary_csv, utterances_csv};
pub use rows::{Entry, EpisodeRow, Life, LifeError, UtteranceRow, rows_of};
pub use summary::{ALL, AnsweredRow, FEW, MEASURES, SummaryRow, answered, summary};
