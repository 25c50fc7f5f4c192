//! `apprentice`: a language interface that each person teaches by breaking hard utterances into
//! easy ones, and a service that can prove what it learned.
//!
//! **State is a fold over the log. A mind is a pure function of the state.** Everything else is
//! plumbing: [`session`] decides and applies, [`learning`] trains, [`store`] keeps, [`actors`] and
//! [`frontends`] carry. `ARCHITECTURE.md` is the map; its two tables are checked by
//! `tests/tidy.rs`. Rooms below stand in storeys: imports point upwards on this list only.

pub mod fairness;
pub mod ids;
pub mod invariants;
pub mod limits;
pub mod plain;

pub mod language;
pub mod numerics;

pub mod events;
pub mod evidence;
pub mod grounding;
pub mod learning;
pub mod parser;
pub mod session;
pub mod tenancy;
pub mod world;

pub mod replay;
mod sabotage;
pub mod store;

pub mod actors;
pub mod cli;
pub mod frontends;
pub mod service;
pub mod study;
