use crate::language::{Mention, Symbol};
use crate::world::{Edition, Words};

/// What the mentions of a clause may mean.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Referents {
    /// Per mention the types it may mean, best first; empty for a pronoun without anything to mean.
    pub types: Vec<Vec<Symbol>>,
    /// What was named last, in these mentions or before.
    pub last: Option<Symbol>,
}

/// Finds what mentions mean in a scene (paper, section 3.1.1): a name means the type with the
/// closest instance; a pronoun means what the robot holds, else what was named last.
///
/// - `edition`: of the words that the mentions were found with.
/// - `before`: what was named last before this clause.
pub fn resolve<D: Words>(
    domain: &D,
    edition: Edition,
    scene: &D::Scene,
    mentions: &[Mention],
    before: Option<&Symbol>,
) -> Referents {
    let held = domain.held(scene);
    let mut referents = Referents { types: Vec::new(), last: before.cloned() };
    for mention in mentions {
        let types = if mention.pronoun {
            held.clone().or_else(|| referents.last.clone()).into_iter().collect()
        } else {
            domain.resolve(edition, scene, mention)
        };
        if let Some(best) = types.first() {
            referents.last = Some(best.clone());
        }
        referents.types.push(types);
    }
    referents
}
