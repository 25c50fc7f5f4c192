//! What nobody may do: come in, forge, read, rewrite or exhaust. Runs the program; see
//! `tests/README.md`.

mod clocks;
mod doors;
mod erasure;
mod evidence;
mod forged_lines;
mod segments;
mod slow_readers;
