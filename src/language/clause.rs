use super::{LiftedUtterance, Mention};

/// One clause as the parser gets it: its lifted form, and what lifting took away.
///
/// Parsers that compare lifted forms alone read only [`Clause::lifted`]; the rest is for those
/// that judge by more (the swallowed words of "the *red* mug", the objects' own names).
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Clause {
    pub lifted: LiftedUtterance,
    /// Per slot, the words before its name that lifting swallowed, in order; often empty.
    pub attributes: Vec<Vec<String>>,
    /// The words as said, lower-cased, without clause marks.
    pub words: Vec<String>,
    /// What the slots stand for, in order.
    pub mentions: Vec<Mention>,
}

impl Clause {
    /// A clause of which only the lifted form is known: a seed.
    pub fn of(lifted: &LiftedUtterance) -> Clause {
        let attributes = vec![Vec::new(); lifted.slots()];
        Clause { lifted: lifted.clone(), attributes, words: Vec::new(), mentions: Vec::new() }
    }
}
