use crate::language::{Clause, LiftedProgram, Near};

/// Pure. Parsers differ only behind this line.
pub trait SemanticParser {
    /// Candidate programs for one clause, all within the parser's own threshold.
    fn parse(&self, clause: &Clause) -> Parse;
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
    /// How many of the candidates come from exemplars with exactly this lifted form. They come
    /// first and beat the reranker.
    pub exact: usize,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Scored {
    pub program: LiftedProgram,
    pub distance: f32,
    /// The exemplar that gave it.
    pub number: u32,
}
