use super::{GrammarParser, Parse, SemanticParser, Seq2SeqParser};
use crate::language::Clause;

/// The paper's baseline: the grammar answers first, and where it has nothing the
/// sequence-to-sequence model answers. Each candidate says which of the two gave it.
#[derive(Debug, Clone)]
pub struct BackedParser {
    /// Asked first.
    pub grammar: GrammarParser,
    /// Asked where the grammar has no answer.
    pub model: Seq2SeqParser,
}

impl SemanticParser for BackedParser {
    fn parse(&self, clause: &Clause) -> Parse {
        let parse = self.grammar.parse(clause);
        if parse.candidates.is_empty() {
            return self.model.parse(clause);
        }
        // One threshold for both, since the clauses of one utterance are chained.
        Parse { threshold: Seq2SeqParser::THRESHOLD, ..parse }
    }

    /// Both give one reading at most.
    fn sure_of_order(&self) -> bool {
        true
    }
}
