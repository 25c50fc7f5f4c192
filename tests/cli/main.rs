//! The program as a user starts it. See `tests/README.md`.

mod drills;
mod past;
mod terminal;
