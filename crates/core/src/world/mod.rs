//! Where programs act. A world is written as four traits: [`World`] (its physics), [`Words`] (what
//! people's words mean in it), [`Features`] (what a reranker looks at) and [`Show`] (what people
//! read). [`Domain`] is all four together. Each world is a crate; nothing here knows about mugs.

mod domain;
mod edition;
mod features;
mod lexicon;
mod physics;
mod pointing;
mod show;
mod stage;
mod words;

pub use domain::Domain;
pub use edition::Edition;
pub use features::Features;
pub use lexicon::{Lexicon, Meaning, NameSummary, SeedSet};
pub use physics::{Infeasible, World, refuse_other_instances};
pub use pointing::Pointing;
pub use show::{Show, Thing, View};
pub use stage::{Stage, StageError};
pub use words::Words;
