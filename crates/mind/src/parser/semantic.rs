use crate::language::{Answerer, Clause, LiftedProgram, Near};

/// Finds programs for lifted clauses. A pure function of its weights and the clause.
pub trait SemanticParser {
    /// Candidate programs for one clause, all within the parser's own threshold.
    fn parse(&self, clause: &Clause) -> Parse;

    /// The distance of a chain of clauses, from that of its first clauses and that of the next one.
    /// The larger of the two, unless the parser has a better rule.
    fn chain(&self, so_far: f32, next: f32) -> f32 {
        so_far.max(next)
    }

    /// Whether the nearest candidate that runs is the answer. A reranker then only chooses between
    /// candidates at the same distance.
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
    /// The nearest exemplars for the evidence, within the threshold or not.
    pub nearest: Vec<Near>,
    /// The largest distance that counts as understood.
    pub threshold: f32,
    /// How many of the candidates have an exemplar of exactly this lifted form, or are so near that
    /// no other reading counts. They come first, and the reranker does not choose between them.
    pub exact: usize,
}

/// A candidate program for a clause.
#[derive(Debug, Clone, PartialEq)]
pub struct Scored {
    /// What the clause would mean.
    pub program: LiftedProgram,
    /// No unit; smaller is nearer.
    pub distance: f32,
    /// The number of the exemplar that it comes from; [`Scored::OF_NONE`] if it comes from none.
    pub number: u32,
    /// Whether the world chooses which mention fills which slot. If not, slot n is the n-th
    /// mention.
    pub open: bool,
    /// Which part of the parser gave it, where it has parts.
    pub by: Option<Answerer>,
}

impl Scored {
    /// The number of a program that no exemplar gave.
    pub const OF_NONE: u32 = u32::MAX;
}
