//! The program as people start it. See `tests/README.md`.

mod drills;
mod past;
mod terminal;
