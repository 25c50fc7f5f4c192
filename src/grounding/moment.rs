use crate::language::Symbol;
use crate::world::Domain;

/// The moment an utterance is spoken in: all that its meaning may depend on beside its words.
#[derive(Debug)]
pub struct Moment<'a, D: Domain> {
    pub domain: &'a D,
    pub scene: &'a D::Scene,
    pub task: &'a D::Task,
    /// The type named last: what "it" means while the hand is empty.
    pub mentioned: Option<&'a Symbol>,
}
