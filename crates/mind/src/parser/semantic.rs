use crate::language::{Answerer, Clause, LiftedProgram, Near};

/// Pure. Parsers differ only behind this line.
pub trait SemanticParser {
    /// Candidate programs for one clause, all within the parser's own threshold.
    fn parse(&self, clause: &Clause) -> Parse;

    /// How far a chain of clauses is, from how far its first clauses and the next one are. As sure
    /// as its weakest link, unless a parser knows better.
    fn chain(&self, so_far: f32, next: f32) -> f32 {
        so_far.max(next)
    }

    /// Whether the nearest candidate that runs is the one to take, and a reranker is only asked
    /// where several are equally near.
    fn sure_of_order(&self) -> bool {
        false
    }
}

/// What a parser found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Parse {
    /// Distinct programs within the threshold, nearest first (ties: the older exemplar). Empty
    /// means *not sure*.
    pub candidates: Vec<Scored>,
    /// The nearest exemplars, near enough or not, for the evidence.
    pub nearest: Vec<Near>,
    /// What the distances were held against.
    pub threshold: f32,
    /// How many of the candidates come from exemplars with exactly this lifted form, or are so
    /// near that no other reading counts. They come first and beat the reranker.
    pub exact: usize,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Scored {
    pub program: LiftedProgram,
    pub distance: f32,
    /// The exemplar that gave it; [`Scored::OF_NONE`] when the parser made it up.
    pub number: u32,
    /// Whether the slots are only kinds of arguments: which mention fills which is then for the
    /// world to say. Otherwise slot n is the n-th mention.
    pub open: bool,
    /// Which part of the parser gave it, where it has parts.
    pub by: Option<Answerer>,
}

impl Scored {
    /// The number of a program that no exemplar gave.
    pub const OF_NONE: u32 = u32::MAX;
}
