//! `apprentice`: a language interface that each person teaches by breaking hard utterances into
//! easy ones, and a service that can prove what it learned.
//!
//! **State is a fold over the log. A mind is a pure function of the state.** Everything else is
//! plumbing: [`session`] decides and applies, [`learning`] trains, [`store`] keeps, [`actors`] and
//! [`frontends`] carry. `ARCHITECTURE.md` is the map; its two tables are checked by
//! `tests/tidy/`. Rooms below stand in storeys: imports point upwards on this list only.

pub use apprentice_client as client;
pub use apprentice_core::{fairness, ids, invariants, language, limits, numerics, plain, sabotage};
pub use apprentice_mind::{grounding, learning, parser};

/// Where programs act: the trait of a world, and the worlds that there are.
pub mod world {
    pub use apprentice_core::world::*;
    pub use apprentice_household as household;
}

pub mod events;
pub mod evidence;
pub mod session;
pub mod tenancy;

pub mod parallel;
pub mod replay;
pub mod store;

pub mod actors;
pub mod frontends;
pub mod service;
