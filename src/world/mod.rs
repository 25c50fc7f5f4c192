//! Where programs act: the [`Domain`] trait, and one folder per domain. Nothing outside this room
//! knows about mugs.

mod domain;
pub mod household;
mod lexicon;

pub use domain::{Domain, Infeasible, Stage, StageError, Thing, View};
pub use lexicon::{Lexicon, Meaning, SeedSet};
