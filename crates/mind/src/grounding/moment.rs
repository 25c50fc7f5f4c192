use crate::language::Symbol;
use crate::world::World;

/// The moment of an utterance: everything its meaning may depend on, except its words.
#[derive(Debug)]
pub struct Moment<'a, D: World> {
    /// The world.
    pub domain: &'a D,
    /// The scene at that moment.
    pub scene: &'a D::Scene,
    /// The task of the episode.
    pub task: &'a D::Task,
    /// The type named last: what "it" means while the hand is empty.
    pub mentioned: Option<&'a Symbol>,
    /// The names of the things acted on before in the episode, newest first; a name may be there
    /// twice. "The other one" excludes them, and "the same one" means the newest.
    pub handled: &'a [String],
}
