use crate::language::Symbol;
use crate::world::World;

/// The moment an utterance is spoken in: all that its meaning may depend on beside its words.
#[derive(Debug)]
pub struct Moment<'a, D: World> {
    pub domain: &'a D,
    pub scene: &'a D::Scene,
    pub task: &'a D::Task,
    /// The type named last: what "it" means while the hand is empty.
    pub mentioned: Option<&'a Symbol>,
    /// The things that were acted on before in the episode, by name, newest first: what "the other
    /// one" leaves out and "the same one" means. A name may come again.
    pub handled: &'a [String],
}
