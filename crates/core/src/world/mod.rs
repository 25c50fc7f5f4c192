//! Where programs act: the [`Domain`] trait, and one crate per world. Nothing outside this room
//! knows about mugs.

mod domain;
mod edition;
mod lexicon;
mod pointing;

pub use domain::{Domain, Infeasible, Stage, StageError, Thing, View};
pub use edition::Edition;
pub use lexicon::{Lexicon, Meaning, NameSummary, SeedSet};
pub use pointing::Pointing;
