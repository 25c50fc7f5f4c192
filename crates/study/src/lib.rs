//! Measuring the system on recorded human sentences: how much of what people really type it
//! understands, before and after a lesson. `docs/evaluation.md` defines every figure.
//!
//! A parser is given what a person's sentence and the scene would give it; everything else a
//! corpus knows is for judging the answer.

pub mod ablation;
mod carried;
mod cells;
pub mod conversation;
pub mod corpus;
mod draw;
mod episode;
pub mod failures;
pub mod figures;
pub mod goals;
pub mod known_minds;
pub mod lessons;
pub mod measures;
pub mod one_shot;
pub mod participant;
pub mod people;
pub mod pictures;
pub mod primitives;
pub mod promise;
mod renaming;
pub mod report;
pub mod rerun;
pub mod run;
pub mod scenes;
pub mod score;
mod seeds;
mod table;
pub mod transcript;
