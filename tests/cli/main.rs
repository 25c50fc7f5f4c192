//! The program as a user starts it. See `tests/README.md`.

#[path = "../support"]
mod support {
    pub mod diary;
    pub mod ran;
    pub mod released;
}

mod drills;
mod past;
mod terminal;
