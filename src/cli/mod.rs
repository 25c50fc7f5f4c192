//! The command line: one file per command, and the conversation in a terminal.

mod args;
mod audit;
mod bar;
mod check_copy;
mod checkpoint;
mod converse;
mod data_dir;
mod embedded;
mod erase;
mod eval;
mod export;
mod failure;
mod import;
mod keys;
mod log;
mod logging;
mod office;
mod overlap;
mod passport;
mod past;
mod proof;
mod recipe;
mod replay;
mod salvage;
mod self_test;
mod serve;
mod study;
mod talk;
mod tenant;
mod terminal;
mod transcript;
mod verify;

pub use args::main;
pub use failure::Failure;
pub use transcript::{PlayedFile, TranscriptFile};
