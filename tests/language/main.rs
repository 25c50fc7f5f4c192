//! What is understood, taught, learned and recorded. Uses only the library; see `tests/README.md`.

mod any_stage;
mod baseline;
mod dialogue;
mod forgetting;
mod golden;
mod recorded_sentences;
mod session;
mod teaching;
mod transcripts;
mod trust;
