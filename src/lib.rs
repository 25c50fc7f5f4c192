//! `apprentice`: a language interface that each person teaches, by doing in small steps what it did
//! not understand; and a service that can prove what it learned.
//!
//! **State is a fold over the log. A mind is a pure function of the state.** [`session`] decides
//! and applies, [`learning`] trains, [`store`] keeps the records, [`actors`] and [`frontends`]
//! carry requests and answers, and [`service`] builds all of it. `ARCHITECTURE.md` says which
//! module may import which; `tests/tidy/` checks it. The modules below stand in the order of these
//! layers: each imports only from those above it.

pub use apprentice_client as client;
pub use apprentice_core::{fairness, ids, invariants, language, limits, numerics, plain, sabotage};
pub use apprentice_mind::{dialogue, grounding, learning, parser};

/// Where programs run: the trait of a world, and the worlds that exist.
pub mod world {
    pub use apprentice_core::world::*;
    pub use apprentice_household as household;
}

pub mod events;
pub mod evidence;
// Of it, sessions name the receipt only (`ARCHITECTURE.md`, ADR 24).
pub mod store;

pub mod session;
pub mod tenancy;

pub mod parallel;
pub mod replay;

pub mod actors;
pub mod frontends;
pub mod service;
