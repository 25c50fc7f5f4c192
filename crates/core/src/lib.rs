//! The types that all of apprentice uses: ids and limits, utterances, programs and answers,
//! arithmetic with one order of summation, and the traits of a world. Pure: no clock, no entropy,
//! no file, no thread.

pub mod fairness;
pub mod header;
pub mod ids;
pub mod invariants;
pub mod language;
pub mod limits;
pub mod numerics;
pub mod outcomes;
pub mod plain;
pub mod sabotage;
pub mod tenants;
pub mod world;
