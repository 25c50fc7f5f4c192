//! What is understood, taught, learned and recorded. Uses only the library; see `tests/README.md`.

#[path = "../support"]
mod support {
    pub mod chance;
    pub mod diary;
    pub mod recorded;
    pub mod samples;
    pub mod toy;
}

mod any_stage;
mod baseline;
mod forgetting;
mod golden;
mod recorded_sentences;
mod session;
mod teaching;
mod transcripts;
mod trust;
