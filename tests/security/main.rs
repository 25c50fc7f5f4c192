//! What an attacker must not be able to do: connect, forge, read, rewrite or use up memory. Runs
//! the program; see `tests/README.md`.

mod clocks;
mod doors;
mod erasure;
mod evidence;
mod forged_lines;
mod segments;
mod slow_readers;
