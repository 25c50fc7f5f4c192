//! The robot never acts on words that it did not understand. There is one module for each kind of
//! utterance, with examples of our own.
//!
//! `talk.rs` is the harness. Every table reports all its failures together, and how many sentences
//! it tried.

mod carrying;
mod effects;
mod frames;
mod input;
mod instances;
mod lessons;
mod moods;
mod precedence;
mod requests;
mod talk;
mod transcripts;
mod unknown;
