//! It never acts on words that it did not understand: each kind of utterance that a person may type,
//! with neighbours of our own for each kind.
//!
//! `talk.rs` is the harness. Every table reports all its failures at once, with how many were tried.

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
