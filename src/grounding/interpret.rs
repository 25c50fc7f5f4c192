use super::abstractor::{Abstractor, without_locations};
use super::combine::{Candidate, Context, Offer, Verdict, combine};
use super::moment::Moment;
use super::reranker::Reranker;
use super::resolver::resolve;
use super::settings::{Abstraction, Execution};
use crate::language::{
    Answer, Clause, Discarded, Evidence, Grammar, LiftedUtterance, Near, Outcome, Symbol, Utterance,
};
use crate::limits::{CANDIDATES_MAX, EVIDENCE_DISCARDED_MAX, EVIDENCE_NEAREST_MAX};
use crate::parser::{Parse, SemanticParser};
use crate::world::Domain;

/// All that an interpretation needs beside the moment and the words: the parts of a mind.
pub struct Interpreter<'a, P> {
    pub abstraction: &'a Abstraction,
    pub execution: &'a Execution,
    pub parser: &'a P,
    /// Whether a word is in ordinary use, and so no misspelt name.
    pub known: &'a dyn Fn(&str) -> bool,
    /// None before the first lesson.
    pub reranker: Option<&'a Reranker>,
    /// How many of the parser's exemplars, from the first, are seeds.
    pub seeds: u32,
}

impl<P: SemanticParser> Interpreter<'_, P> {
    /// What an utterance asks for at this moment, and why.
    ///
    /// Abstract, parse (whole, then split), resolve, combine, keep the feasible, rerank (paper,
    /// section 3.1). An exact lifted match decides, subject only to what the world allows; without
    /// a reranker the nearest feasible candidate wins. Nothing is carried out here.
    pub fn interpret<D: Domain>(&self, moment: &Moment<'_, D>, utterance: &Utterance) -> Answer {
        let heard = self.hear(moment, utterance, Ways::Deciding);
        let mut candidates = Vec::new();
        for ways in heard.deciding() {
            let found = self.ground(moment, &ways, heard.threshold());
            let runs = !feasible(&found).is_empty();
            if runs || candidates.is_empty() {
                candidates = found;
            }
            if runs {
                break;
            }
        }
        let feasible = feasible(&candidates);
        let exact = heard.exact();
        // A seed keeps its own program even when a lesson with the same words has another one.
        let seeded = feasible.iter().find(|candidate| exact && candidate.seed);
        let (chosen, reranked) = match (self.reranker, seeded) {
            (_, Some(seeded)) => (Some(*seeded), 0),
            (Some(reranker), None) if self.rivals(&feasible) > 1 => {
                let words = utterance.tokens();
                let rivals = &feasible[..self.rivals(&feasible)];
                let best = reranker.best(moment, &words, rivals.iter().map(|c| &c.program));
                (Some(rivals[best]), rivals.len() as u32)
            }
            _ => (feasible.first().copied(), 0),
        };
        // Candidates are sorted: the first forbidden one is the best guess at what was meant.
        let is_forbidden = |c: &&Candidate| matches!(c.verdict, Verdict::Forbidden { .. });
        let told = chosen.or_else(|| candidates.iter().find(is_forbidden));
        let outcome = told.map_or(Outcome::NotSure, outcome_of);
        let mentioned = match told {
            Some(candidate) => candidate.mentioned.clone(),
            None => heard.named_last(moment),
        };
        let mut evidence = heard.evidence(told);
        evidence.reranked = reranked;
        evidence.answered_by = match (&outcome, told) {
            (Outcome::Understood { .. } | Outcome::Impossible { .. }, Some(told)) => {
                told.answered_by.clone()
            }
            _ => Vec::new(),
        };
        evidence.discarded = discarded(&candidates, told);
        Answer { outcome, evidence, mentioned }
    }

    /// Every candidate that runs, nearest first, exact or not: what the reranker learns to choose
    /// from.
    pub fn candidates<D: Domain>(
        &self,
        moment: &Moment<'_, D>,
        utterance: &Utterance,
    ) -> Vec<Candidate> {
        let heard = self.hear(moment, utterance, Ways::All);
        let all = self.ground(moment, &heard.all(), heard.threshold());
        feasible(&all).into_iter().cloned().collect()
    }

    /// How many of the feasible candidates, from the first, the reranker chooses from.
    fn rivals(&self, feasible: &[&Candidate]) -> usize {
        match feasible.first() {
            Some(first) if self.parser.sure_of_order() => {
                feasible.iter().take_while(|c| c.distance <= first.distance && c.exact).count()
            }
            _ => feasible.len(),
        }
    }

    fn hear<D: Domain>(&self, moment: &Moment<'_, D>, said: &Utterance, ways: Ways) -> Heard {
        let lexicon = moment.domain.lexicon();
        let abstracted = Abstractor::new(lexicon, self.abstraction, self.known).read(said);
        let grammar = self.abstraction.lists.as_ref();
        let grammar = grammar.map(|lists| Grammar { lists, adjectives: &lexicon.adjectives });
        let whole = self.listen(abstracted.whole());
        let parts = match abstracted.clauses(self.abstraction.split, grammar) {
            // An exact match of the whole needs no second opinion from its parts.
            Some(parts) if !whole.literal() || ways == Ways::All => parts,
            _ => Vec::new(),
        };
        let parts = parts.into_iter().map(|part| self.listen(part)).collect();
        Heard { whole, parts, seeds: self.seeds }
    }

    /// Parses a clause in each of its readings.
    fn listen(&self, clause: Clause) -> ParsedClause {
        let without = self.abstraction.locations.then(|| without_locations(&clause)).flatten();
        let readings = [Some(clause), without].into_iter().flatten();
        let parse = |clause: Clause| {
            let parse = self.parser.parse(&clause);
            (clause, parse)
        };
        ParsedClause { readings: readings.map(parse).collect() }
    }

    /// Grounds each way of reading the utterance; equal programs are kept once, nearest first.
    fn ground<D: Domain>(
        &self,
        moment: &Moment<'_, D>,
        ways: &[Vec<Vec<Offer<'_>>>],
        threshold: f32,
    ) -> Vec<Candidate> {
        let lists = self.abstraction.lists.as_ref();
        let chain = |so_far, next| self.parser.chain(so_far, next);
        let context = Context { execution: self.execution, lists, chain: &chain };
        let mut all: Vec<Candidate> =
            ways.iter().flat_map(|clauses| combine(moment, &context, clauses)).collect();
        // Stable: at equal distance the whole utterance comes before its parts, and within each
        // the older exemplar first.
        all.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        // A chain of clauses that are near enough one by one may not be.
        all.retain(|candidate| candidate.distance <= threshold);
        let mut kept: Vec<Candidate> = Vec::new();
        for candidate in all {
            if kept.len() < CANDIDATES_MAX && kept.iter().all(|k| k.program != candidate.program) {
                kept.push(candidate);
            }
        }
        kept
    }
}

/// Which ways of reading an utterance are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ways {
    /// Those that may decide what it means.
    Deciding,
    All,
}

/// One clause with its readings, each parsed.
struct ParsedClause {
    /// The clause as said comes first.
    readings: Vec<(Clause, Parse)>,
}

impl ParsedClause {
    fn exact(&self) -> bool {
        self.readings.iter().any(|(_, parse)| parse.exact > 0)
    }

    /// Whether the words are exactly those of an exemplar, not only near enough to decide.
    fn literal(&self) -> bool {
        let literal = |parse: &Parse| parse.candidates[..parse.exact].iter().any(|c| !c.open);
        self.readings.iter().any(|(_, parse)| literal(parse))
    }

    /// What the parser offers, nearest first.
    fn offers(&self, seeds: u32) -> Vec<Offer<'_>> {
        let mut offers = Vec::new();
        for (clause, parse) in &self.readings {
            offers.extend(parse.candidates.iter().enumerate().map(|(place, scored)| Offer {
                clause,
                program: scored.program.clone(),
                distance: scored.distance,
                exact: place < parse.exact,
                open: scored.open,
                by: scored.by,
                seed: scored.number < seeds,
            }));
        }
        offers.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        offers
    }

    /// The exact offers of the first reading that has any, else all offers of all readings.
    fn deciding(&self, seeds: u32) -> Vec<Offer<'_>> {
        let mut offers = self.offers(seeds);
        if let Some((clause, _)) = self.readings.iter().find(|(_, parse)| parse.exact > 0) {
            offers.retain(|offer| offer.exact && std::ptr::eq(offer.clause, clause));
        }
        offers
    }

    fn nearest(&self) -> impl Iterator<Item = &Near> {
        self.readings.iter().flat_map(|(_, parse)| &parse.nearest)
    }

    fn lifted(&self) -> &LiftedUtterance {
        &self.readings[0].0.lifted
    }
}

/// The utterance, whole and cut, parsed.
struct Heard {
    whole: ParsedClause,
    /// Empty when there is nothing to cut.
    parts: Vec<ParsedClause>,
    seeds: u32,
}

impl Heard {
    /// Whether the words are exactly those of exemplars: as a whole, or part by part.
    fn exact(&self) -> bool {
        self.whole.exact() || self.parts_exact()
    }

    fn parts_exact(&self) -> bool {
        !self.parts.is_empty() && self.parts.iter().all(ParsedClause::exact)
    }

    /// The ways of reading the utterance that may decide what it means, in turns: a later turn
    /// counts only when nothing of the earlier ones runs.
    fn deciding(&self) -> Vec<Vec<Vec<Vec<Offer<'_>>>>> {
        let whole = vec![self.whole.deciding(self.seeds)];
        if self.whole.literal() {
            return vec![vec![whole]];
        }
        let parts: Vec<_> = self.parts.iter().map(|part| part.deciding(self.seeds)).collect();
        let literal = !self.parts.is_empty() && self.parts.iter().all(ParsedClause::literal);
        match (self.whole.exact(), literal) {
            // "Pick up the mug and wash it" is what it says, however near it is to "wash it".
            (true, true) => vec![vec![parts], vec![whole]],
            (true, false) => vec![vec![whole], vec![parts]],
            (false, _) if self.parts_exact() => vec![vec![parts]],
            (false, _) => vec![vec![whole, parts]],
        }
    }

    fn threshold(&self) -> f32 {
        self.whole.readings[0].1.threshold
    }

    /// Every way of reading the utterance.
    fn all(&self) -> Vec<Vec<Vec<Offer<'_>>>> {
        let parts = self.parts.iter().map(|part| part.offers(self.seeds)).collect();
        vec![vec![self.whole.offers(self.seeds)], parts]
    }

    fn named_last<D: Domain>(&self, moment: &Moment<'_, D>) -> Option<Symbol> {
        let mentions = &self.whole.readings[0].0.mentions;
        resolve(moment.domain, moment.scene, mentions, moment.mentioned).last
    }

    /// The part of the evidence that comes from parsing. An utterance that was understood in parts
    /// is explained by its parts; one that was not, by the parts that nothing was offered for.
    fn evidence(&self, told: Option<&Candidate>) -> Evidence {
        let in_parts = match told {
            Some(candidate) => candidate.lifted.len() > 1,
            None => !self.parts.is_empty(),
        };
        let silent =
            |part: &&ParsedClause| part.readings.iter().all(|(_, p)| p.candidates.is_empty());
        let explained: Vec<&ParsedClause> = match (in_parts, told) {
            (false, _) => vec![&self.whole],
            (true, Some(_)) => self.parts.iter().collect(),
            (true, None) => self.parts.iter().filter(silent).collect(),
        };
        let explained = match (explained.is_empty(), self.parts.is_empty()) {
            (false, _) => explained,
            (true, false) if self.whole.nearest().next().is_none() => self.parts.iter().collect(),
            (true, _) => vec![&self.whole],
        };
        let lifted = match told {
            Some(candidate) => candidate.lifted.clone(),
            None if in_parts => self.parts.iter().map(|part| part.lifted().clone()).collect(),
            None => vec![self.whole.lifted().clone()],
        };
        let mut nearest: Vec<Near> = Vec::new();
        let mut near: Vec<&Near> = explained.iter().flat_map(|part| part.nearest()).collect();
        near.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        for near in near {
            if nearest.len() < EVIDENCE_NEAREST_MAX
                && nearest.iter().all(|kept| kept.number != near.number)
            {
                nearest.push(near.clone());
            }
        }
        let threshold = self.threshold();
        Evidence { lifted, nearest, threshold, ..Evidence::default() }
    }
}

fn feasible(candidates: &[Candidate]) -> Vec<&Candidate> {
    candidates.iter().filter(|c| matches!(c.verdict, Verdict::Runs { .. })).collect()
}

fn outcome_of(candidate: &Candidate) -> Outcome {
    let program = candidate.program.clone();
    match &candidate.verdict {
        Verdict::Runs { bindings } => Outcome::Understood { program, bindings: bindings.clone() },
        Verdict::Forbidden { step, reason, .. } => {
            Outcome::Impossible { program, step: *step, reason: reason.clone() }
        }
        Verdict::Unfilled { .. } => Outcome::NotSure,
    }
}

fn discarded(candidates: &[Candidate], told: Option<&Candidate>) -> Vec<Discarded> {
    let dropped = candidates.iter().filter_map(|candidate| match &candidate.verdict {
        _ if told.is_some_and(|told| told.program == candidate.program) => None,
        Verdict::Runs { .. } => None,
        Verdict::Forbidden { reason, .. } | Verdict::Unfilled { reason } => {
            Some(Discarded { program: candidate.program.clone(), reason: reason.clone() })
        }
    });
    dropped.take(EVIDENCE_DISCARDED_MAX).collect()
}
