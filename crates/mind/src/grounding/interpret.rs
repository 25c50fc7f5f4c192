use super::abstractor::{Abstracted, Abstractor, without_locations};
use super::asking::{Taken, which};
use super::combine::{Candidate, Context, Offer, Verdict, combine};
use super::moment::Moment;
use super::reranker::Reranker;
use super::resolver::resolve;
use super::settings::{Abstraction, Execution};
use crate::language::{
    Accounted, Answer, Clause, Discarded, Evidence, Grammar, LiftedArg, LiftedProgram, LiftedStep,
    LiftedUtterance, Mention, Mood, Near, Outcome, Question, Roles, Symbol, Use, Utterance, Word,
    WordLists,
};
use crate::limits::{CANDIDATES_MAX, EVIDENCE_DISCARDED_MAX, EVIDENCE_NEAREST_MAX};
use crate::parser::{Parse, Scored, SemanticParser};
use crate::world::{Edition, Features, Words};

/// The parts of a mind that interpret an utterance.
pub struct Interpreter<'a, P> {
    /// How the utterance is lifted.
    pub abstraction: &'a Abstraction,
    /// How a program is run.
    pub execution: &'a Execution,
    /// Finds programs for lifted clauses.
    pub parser: &'a P,
    /// Whether a word is in ordinary use, and so not a misspelt name.
    pub known: &'a dyn Fn(&str) -> bool,
    /// None before the first lesson.
    pub reranker: Option<&'a Reranker>,
    /// How many of the parser's exemplars, from the first, are seeds.
    pub seeds: u32,
    /// Of the world's words.
    pub edition: Edition,
    /// Ask which thing is meant, unless recorded people meant the nearest one in at least so many of
    /// 100 uses of its name; 0 never asks.
    pub ask_below: u32,
}

impl<P: SemanticParser> Interpreter<'_, P> {
    /// What an utterance asks for at this moment, and why.
    ///
    /// Abstract, parse (whole, then split), resolve, combine, keep the feasible, rerank (paper,
    /// section 3.1). An exact lifted match is taken if the world allows it. Without a reranker, the
    /// nearest feasible candidate is taken. The scene itself does not change.
    pub fn interpret<D: Words + Features>(
        &self,
        moment: &Moment<'_, D>,
        utterance: &Utterance,
    ) -> Answer {
        let heard = self.hear(moment, utterance, Ways::Deciding);
        let lessons_alone = match &heard.abstracted.mood {
            None => false,
            Some(mood) if heard.may_be_told(mood) => true,
            Some(_) => return heard.not_asked(moment),
        };
        let mut candidates = Vec::new();
        for mut ways in heard.deciding() {
            if lessons_alone {
                ways.retain(|way| way.len() == 1);
                ways.iter_mut().flatten().for_each(|offers| offers.retain(|offer| !offer.seed));
            }
            let found = self.ground(moment, &heard, &ways);
            let runs = !feasible(&found).is_empty();
            let decided = self.accounts() && found.iter().any(is_final);
            if runs || candidates.is_empty() {
                candidates = found;
            }
            if runs || decided {
                break;
            }
        }
        if self.accounts() {
            keep_before_the_final(&mut candidates);
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
        if lessons_alone && chosen.is_none() {
            return heard.not_asked(moment);
        }
        // Candidates are sorted: the first forbidden one is the best guess at what was meant.
        let is_forbidden = |c: &&Candidate| matches!(c.verdict, Verdict::Forbidden { .. });
        // A reading with unused words says that they were not understood. It does not say what the
        // world does not allow.
        let left = candidates.first().is_some_and(|first| !first.left_over.is_empty());
        let told = chosen.or_else(|| candidates.iter().find(is_forbidden).filter(|_| !left));
        let question = chosen.and_then(|chosen| self.question(moment, &heard, chosen));
        if let Some(question) = question {
            return heard.asked(question);
        }
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
        let chosen = told.map(Candidate::chosen).unwrap_or_default();
        if self.accounts() {
            evidence.accounting = heard.account(told.or(candidates.first()));
        }
        Answer { outcome, evidence, mentioned, chosen }
    }

    /// What to ask before `chosen` is carried out; none when it is clear enough.
    fn question<D: Words + Features>(
        &self,
        moment: &Moment<'_, D>,
        heard: &Heard<'_>,
        chosen: &Candidate,
    ) -> Option<Question> {
        let (edition, mentions) = (self.edition, heard.mentions());
        let taken = Taken { moment, edition, candidate: chosen, mentions };
        (self.ask_below > 0).then(|| which(&taken, self.ask_below)).flatten()
    }

    /// Every candidate that runs, nearest first, exact or not. The reranker learns to choose from
    /// them.
    pub fn candidates<D: Words + Features>(
        &self,
        moment: &Moment<'_, D>,
        utterance: &Utterance,
    ) -> Vec<Candidate> {
        let heard = self.hear(moment, utterance, Ways::All);
        let all = self.ground(moment, &heard, &heard.all());
        feasible(&all).into_iter().cloned().collect()
    }

    fn accounts(&self) -> bool {
        self.execution.accounting.is_some()
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

    fn hear<D: Words + Features>(
        &self,
        moment: &Moment<'_, D>,
        said: &Utterance,
        ways: Ways,
    ) -> Heard<'_> {
        let lexicon = moment.domain.lexicon(self.edition);
        let abstracted = Abstractor::new(lexicon, self.abstraction, self.known).read(said);
        let grammar = self.abstraction.lists.as_ref();
        let grammar = grammar.map(|lists| Grammar { lists, adjectives: &lexicon.adjectives });
        let listen = |clause| self.listen(clause, grammar.as_ref(), &lexicon.roles);
        let whole = listen(abstracted.whole());
        let parts = match abstracted.clauses(self.abstraction.split, grammar) {
            // After an exact match of the whole, its parts are not looked at.
            Some(parts) if !whole.literal() || ways == Ways::All => parts,
            _ => Vec::new(),
        };
        let parts = parts.into_iter().map(listen).collect();
        let lists = self.abstraction.lists.as_ref();
        Heard { abstracted, lists, whole, parts, seeds: self.seeds, edition: self.edition }
    }

    /// Parses a clause in each of its readings.
    fn listen(&self, clause: Clause, grammar: Option<&Grammar<'_>>, roles: &Roles) -> ParsedClause {
        let without = self.abstraction.locations.then(|| without_locations(&clause)).flatten();
        let readings = [Some(clause), without].into_iter().flatten();
        let parse = |clause: Clause| {
            let mut parse = self.parser.parse(&clause);
            if let Some(walk) = grammar.and_then(|grammar| self.carries(&clause, grammar, roles))
                && parse.candidates.iter().all(|scored| scored.number >= self.seeds)
            {
                parse.candidates.push(walk);
            }
            (clause, parse)
        };
        ParsedClause { readings: readings.map(parse).collect() }
    }

    /// A verb of carrying is a way to a place, even if people rarely use it for GOTO. The things it
    /// names decide what else it means.
    fn carries(&self, clause: &Clause, grammar: &Grammar<'_>, roles: &Roles) -> Option<Scored> {
        let carrying = self.execution.carrying.as_ref()?;
        let verb = grammar.main_verb(&clause.lifted.words)?.word;
        let known = carrying.leaving.contains(&verb) || carrying.keeping.contains(&verb);
        let (going, sort) = (roles.going.as_ref()?, clause.mentions.first()?.sort.clone());
        let step =
            LiftedStep { operator: going.clone(), args: vec![LiftedArg::Slot { sort, number: 1 }] };
        let program = LiftedProgram { steps: vec![step] };
        let scored = Scored { program, distance: CARRIED_AT, number: 0, open: true, by: None };
        let alone = known && clause.mentions.len() > 1 && grammar.cut(clause).len() == 1;
        alone.then_some(scored)
    }

    /// Fills and runs each way of reading the utterance. Equal programs are kept once, nearest
    /// first.
    fn ground<D: Words + Features>(
        &self,
        moment: &Moment<'_, D>,
        heard: &Heard<'_>,
        ways: &[Vec<Vec<Offer<'_>>>],
    ) -> Vec<Candidate> {
        let lists = self.abstraction.lists.as_ref();
        let chain = |so_far, next| self.parser.chain(so_far, next);
        let grammar = lists.map(|lists| Grammar {
            lists,
            adjectives: &moment.domain.lexicon(self.edition).adjectives,
        });
        let mut marked = Vec::new();
        let ways = match grammar.filter(|_| self.accounts()) {
            Some(grammar) => {
                marked.extend_from_slice(ways);
                heard.mark_dropped(&mut marked, &grammar);
                &marked
            }
            None => ways,
        };
        let amounts = heard.abstracted.amounts.as_slice();
        let (execution, edition) = (self.execution, self.edition);
        let context = Context { execution, lists, amounts, chain: &chain, edition };
        let threshold = heard.threshold();
        let mut all: Vec<Candidate> =
            ways.iter().flat_map(|clauses| combine(moment, &context, clauses)).collect();
        // Stable: at equal distance the whole utterance comes before its parts, and within each
        // the older exemplar first.
        all.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        // Clauses may be near enough one by one, and their chain too far.
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
    /// The ways that may decide what it means.
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
                taught: taught(parse, scored.number),
                dropped: Vec::new(),
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
struct Heard<'a> {
    abstracted: Abstracted,
    lists: Option<&'a WordLists>,
    whole: ParsedClause,
    /// Empty when there is nothing to cut.
    parts: Vec<ParsedClause>,
    seeds: u32,
    edition: Edition,
}

impl Heard<'_> {
    /// Whether the words are exactly those of exemplars: as a whole, or part by part.
    fn exact(&self) -> bool {
        self.whole.exact() || self.parts_exact()
    }

    fn parts_exact(&self) -> bool {
        !self.parts.is_empty() && self.parts.iter().all(ParsedClause::exact)
    }

    /// The ways of reading the utterance that may decide what it means, in rounds. A later round
    /// counts only if nothing of the earlier ones runs.
    fn deciding(&self) -> Vec<Vec<Vec<Vec<Offer<'_>>>>> {
        let whole = vec![self.whole.deciding(self.seeds)];
        if self.whole.literal() {
            return vec![vec![whole]];
        }
        let parts: Vec<_> = self.parts.iter().map(|part| part.deciding(self.seeds)).collect();
        let literal = !self.parts.is_empty() && self.parts.iter().all(ParsedClause::literal);
        match (self.whole.exact(), literal) {
            // "Pick up the mug and wash it" has two parts, even if it is near to "wash it".
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

    /// In every reading of several clauses as one lesson, notes the verbs that the lesson has no
    /// use for.
    ///
    /// A lesson of as many clauses has a use for each. Else each verb must be the lesson's or
    /// another word for it, or what its clause means by itself must be among the lesson's steps.
    fn mark_dropped(&self, ways: &mut [Vec<Vec<Offer<'_>>>], grammar: &Grammar<'_>) {
        let whole = ways.iter_mut().filter(|way| way.len() == 1 && self.parts.len() > 1);
        for offer in whole.flatten().flatten().filter(|offer| !offer.seed && !offer.is_literal()) {
            let Some(taught) = offer.taught else { continue };
            let lesson = Clause::of(taught);
            // A lesson has no marks any more, so its verbs tell its clauses.
            let is_verb =
                |word: &&Word| matches!(word, Word::Text(t) if grammar.lists.verbs.contains(t));
            let verbs = taught.words.iter().filter(is_verb).count();
            let clauses = grammar.cut(&lesson).len().max(verbs);
            if clauses >= self.parts.len() {
                continue;
            }
            let in_lesson =
                |verb: &str| taught.words.iter().any(|w| matches!(w, Word::Text(t) if t == verb));
            // As many clauses as the lesson has may be other words for it.
            let mut other_words = clauses;
            let mut unexplained = Vec::new();
            for part in &self.parts {
                let Some(verb) = grammar.main_verb(&part.lifted().words) else { continue };
                // "Wait" and "let it cool" ask for no step.
                let lists = grammar.lists;
                if lists.lasting.contains(&verb.word) || lists.purposes.contains(&verb.word) {
                    continue;
                }
                let own = part.offers(self.seeds);
                let own = own.iter().filter(|own| own.seed);
                let mut own = own.filter_map(|own| own.program.steps.first());
                let among = own.any(|step| {
                    offer.program.steps.iter().any(|other| other.operator == step.operator)
                });
                match (in_lesson(&verb.word), among) {
                    (true, _) => other_words = other_words.saturating_sub(1),
                    (false, true) => {}
                    (false, false) => unexplained.push(verb.word),
                }
            }
            if unexplained.len() > other_words {
                offer.dropped.extend(unexplained);
            }
        }
    }

    /// Whether a lesson may answer an utterance of this mood. It may if the words are exactly its
    /// own, or if only a later part of a long instruction has a condition ("…, and take it out when
    /// it is done"). "If it is dirty, take it, wash it and put it back" has one from the beginning.
    fn may_be_told(&self, mood: &Mood) -> bool {
        let (Mood::Conditional { word } | Mood::Reordered { word }) = mood else { return false };
        let first = self.parts.first().map(|part| part.readings[0].0.words.as_slice());
        let waits_later = first.is_some_and(|words| {
            word.split(' ').all(|waits| !words.iter().any(|said| said == waits))
        });
        self.whole.literal() || (waits_later && self.parts.len() >= LONG_CLAUSES_MIN)
    }

    /// Everything that was named, in order.
    fn mentions(&self) -> &[Mention] {
        &self.whole.readings[0].0.mentions
    }

    /// The answer when the person is asked what was meant.
    fn asked(&self, question: Question) -> Answer {
        let evidence = Evidence {
            lifted: vec![self.whole.lifted().clone()],
            threshold: self.threshold(),
            ..Evidence::default()
        };
        Answer {
            outcome: Outcome::Asked { question },
            evidence,
            mentioned: None,
            chosen: Vec::new(),
        }
    }

    /// The answer to an utterance that is not a request. It names the words that show it.
    fn not_asked<D: Words + Features>(&self, moment: &Moment<'_, D>) -> Answer {
        let mood = self.abstracted.mood.clone();
        let evidence = Evidence {
            lifted: vec![self.whole.lifted().clone()],
            threshold: self.threshold(),
            mood,
            ..Evidence::default()
        };
        let mentioned = self.named_last(moment);
        Answer { outcome: Outcome::NotSure, evidence, mentioned, chosen: Vec::new() }
    }

    /// What a reading uses each word for; of a reading that is not taken, also which words it has
    /// no use for.
    fn account(&self, reading: Option<&Candidate>) -> Vec<Accounted> {
        let frames = self.abstracted.frames.iter();
        let mut all: Vec<Accounted> =
            frames.map(|phrase| Accounted { word: phrase.clone(), used: Use::Frame }).collect();
        let Some(reading) = reading else { return all };
        let clause = &self.whole.readings[0].0;
        let left = |word: &str| {
            let held = |phrase: &String| phrase == word || phrase.split(' ').any(|w| w == word);
            reading.left_over.iter().any(held)
        };
        let acts = |mention: &Mention| {
            let kinds = &mention.types;
            reading.program.steps.iter().any(|s| s.args.iter().any(|arg| kinds.contains(arg)))
        };
        let mut mentions = clause.mentions.iter().zip(&clause.attributes);
        for word in &clause.lifted.words {
            match word {
                Word::Text(text) => {
                    let used = if left(text) { Use::Nothing } else { self.plain_use(text) };
                    all.push(Accounted { word: text.clone(), used });
                }
                Word::Slot { .. } => {
                    let Some((mention, attributes)) = mentions.next() else { continue };
                    let attribute =
                        |word: &String| Accounted { word: word.clone(), used: Use::Attribute };
                    all.extend(attributes.iter().map(attribute));
                    let used = match () {
                        () if left(&mention.surface) => Use::Nothing,
                        () if mention.pronoun || acts(mention) => Use::Thing,
                        () => Use::Landmark,
                    };
                    all.push(Accounted { word: mention.surface.clone(), used });
                }
            }
        }
        all
    }

    /// The use of a word that names nothing: whether it says what to do.
    fn plain_use(&self, text: &str) -> Use {
        match self.lists.as_ref() {
            Some(lists) if lists.verbs.contains(text) || lists.noun_verbs.contains(text) => {
                Use::Verb
            }
            Some(lists) if lists.verb_particles.contains(text) => Use::Verb,
            Some(lists) if lists.stop.contains(text) || lists.determiners.contains(text) => {
                Use::Harmless
            }
            _ => Use::Verb,
        }
    }

    fn named_last<D: Words + Features>(&self, moment: &Moment<'_, D>) -> Option<Symbol> {
        let mentions = &self.whole.readings[0].0.mentions;
        resolve(moment.domain, self.edition, moment.scene, mentions, moment.mentioned).last
    }

    /// The part of the evidence that comes from parsing. An utterance that was understood in parts
    /// is explained by its parts. One that was not understood is explained by the parts without an
    /// offer.
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

fn taught(parse: &Parse, number: u32) -> Option<&LiftedUtterance> {
    parse.nearest.iter().find(|near| near.number == number).map(|near| &near.exemplar)
}

/// The distance of a way that a verb of carrying gives: sure, but not exact.
const CARRIED_AT: f32 = 0.1;
/// How many clauses a long instruction has.
const LONG_CLAUSES_MIN: usize = 3;
/// Up to this distance, a reading counts as exact.
const SAID_WITHIN: f32 = 0.02;

/// Whether a reading has the words of an exemplar, or nearly so, and the world does not allow it.
/// No other reading is then taken in its place.
fn is_final(candidate: &Candidate) -> bool {
    let said = candidate.literal || (candidate.seed && candidate.distance <= SAID_WITHIN);
    said && matches!(candidate.verdict, Verdict::Forbidden { .. })
}

/// Drops the readings after one that decides, and after one with unused words: readings that are
/// farther away do not have the words that were said.
fn keep_before_the_final(candidates: &mut Vec<Candidate>) {
    let decides = |c: &Candidate| is_final(c) || (c.seed && !c.left_over.is_empty());
    if let Some(at) = candidates.iter().position(decides) {
        let literal =
            candidates.iter().any(|c| c.literal && matches!(c.verdict, Verdict::Runs { .. }));
        if !literal {
            candidates.truncate(at + 1);
        }
    }
}

fn feasible(candidates: &[Candidate]) -> Vec<&Candidate> {
    candidates.iter().filter(|c| matches!(c.verdict, Verdict::Runs { .. })).collect()
}

fn outcome_of(candidate: &Candidate) -> Outcome {
    let program = candidate.program.clone();
    match &candidate.verdict {
        Verdict::Runs { bindings, .. } => {
            Outcome::Understood { program, bindings: bindings.clone() }
        }
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
        // It has no program; its words are in the accounting.
        _ if candidate.program.steps.is_empty() => None,
        Verdict::Forbidden { reason, .. } | Verdict::Unfilled { reason } => {
            Some(Discarded { program: candidate.program.clone(), reason: reason.clone() })
        }
    });
    dropped.take(EVIDENCE_DISCARDED_MAX).collect()
}
