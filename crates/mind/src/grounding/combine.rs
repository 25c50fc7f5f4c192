use super::accounting::Account;
use super::arguments::{Arguments, Filling};
use super::chosen::Chosen;
use super::fill::{Filled, Missing, choices, fill, named_last};
use super::moment::Moment;
use super::purpose;
use super::resolver::resolve;
use super::run::Done;
use super::settings::Execution;
use crate::language::{
    Answerer, Clause, LiftedProgram, LiftedUtterance, Program, Symbol, Word, WordLists,
};
use crate::limits::{COMBINATIONS_MAX, PROGRAM_STEPS_MAX, TYPE_CHOICES_MAX};
use crate::world::{Edition, Pointing, Words};

/// A lifted program that the parser offers for a clause.
#[derive(Debug, Clone)]
pub(super) struct Offer<'a> {
    /// The clause in the reading that the program was found for.
    pub clause: &'a Clause,
    /// What it means.
    pub program: LiftedProgram,
    /// How far the exemplar is; no unit.
    pub distance: f32,
    /// Whether the clause has exactly the exemplar's lifted form.
    pub exact: bool,
    /// Whether the exemplar is a seed.
    pub seed: bool,
    /// Whether the world says which mention fills which slot.
    pub open: bool,
    /// Which part of the parser offers it, where it has parts.
    pub by: Option<Answerer>,
    /// The words of the exemplar that it comes from, where they are known.
    pub taught: Option<&'a LiftedUtterance>,
    /// The words of left-out clauses, where the offer answers the whole utterance.
    pub dropped: Vec<String>,
}

impl Offer<'_> {
    /// Whether the words are those of the exemplar, and not only near enough to decide.
    pub(super) fn is_literal(&self) -> bool {
        self.exact && !self.open
    }
}

/// How clauses are put together.
pub(super) struct Context<'a> {
    /// How a program is run.
    pub execution: &'a Execution,
    /// For choosing the arguments of open programs.
    pub lists: Option<&'a WordLists>,
    /// Words of amount in the utterance, which no single step can satisfy.
    pub amounts: &'a [String],
    /// The distance of a chain from that of its first clauses and the next one's.
    pub chain: &'a dyn Fn(f32, f32) -> f32,
    /// Of the world's words.
    pub edition: Edition,
}

/// A program for the whole utterance with all slots filled, and what the world says to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// All of its clauses.
    pub program: Program,
    /// The distance of the chain of its clauses; no unit.
    pub distance: f32,
    /// Whether every clause was read as a seed.
    pub seed: bool,
    /// Whether every clause has exactly the lifted form of its exemplar.
    pub exact: bool,
    /// What the world says to it.
    pub verdict: Verdict,
    /// The clauses that it answers.
    pub lifted: Vec<LiftedUtterance>,
    /// Per clause the part of the parser that answered; empty for a parser without parts.
    pub answered_by: Vec<Answerer>,
    /// What was named last, for a later "it".
    pub mentioned: Option<Symbol>,
    /// Whether the words of every clause were those of an exemplar.
    pub literal: bool,
    /// The words that it has no use for. A candidate with such words is not taken.
    pub left_over: Vec<String>,
}

impl Candidate {
    /// Per step the things that words chose; empty when they chose none.
    pub fn chosen(&self) -> Vec<Vec<Option<String>>> {
        match &self.verdict {
            Verdict::Runs { chosen, .. } if chosen.iter().any(|step| !step.is_empty()) => {
                chosen.clone()
            }
            _ => Vec::new(),
        }
    }
}

/// What the world says to a program.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// It runs.
    Runs {
        /// Per step the names of the things it acts on.
        bindings: Vec<Vec<String>>,
        /// Per step and argument the thing that words chose.
        chosen: Vec<Vec<Option<String>>>,
    },
    /// The words make sense, but the world does not allow one of its steps.
    Forbidden {
        /// The step; 0-based.
        step: u32,
        /// A sentence that names the object and the reason.
        reason: String,
        /// Whether another step before it, such as going there, would allow it.
        mendable: bool,
    },
    /// The words do not fill the program.
    Unfilled {
        /// A sentence that says what is missing.
        reason: String,
    },
}

/// All combinations of the clauses' offers. Each is filled and run on a copy of the scene (paper,
/// section 3.1.3). A clause is filled in the scene after the clauses before it, so "it" means what
/// is then in the hand.
///
/// - returns: at most [`COMBINATIONS_MAX`], in the order of the offers, the last clause's varying
///   fastest.
pub(super) fn combine<D: Words>(
    moment: &Moment<'_, D>,
    context: &Context<'_>,
    clauses: &[Vec<Offer<'_>>],
) -> Vec<Candidate> {
    let start = Partial {
        scene: moment.scene.clone(),
        candidate: Candidate {
            program: Program { steps: Vec::new() },
            distance: 0.0,
            seed: true,
            exact: true,
            verdict: Verdict::Runs { bindings: Vec::new(), chosen: Vec::new() },
            lifted: Vec::new(),
            answered_by: Vec::new(),
            mentioned: moment.mentioned.cloned(),
            literal: true,
            left_over: Vec::new(),
        },
        lessons: Vec::new(),
    };
    let mut done = Vec::new();
    if !clauses.is_empty() {
        extend(&Ground { moment, context }, clauses, &start, &mut done);
    }
    done
}

/// The first clauses of a combination, and the scene they lead to.
pub(super) struct Partial<S> {
    /// After the first clauses.
    pub scene: S,
    /// What these clauses are read as.
    pub candidate: Candidate,
    /// The programs of clauses that a lesson answered.
    pub lessons: Vec<Program>,
}

fn extend<D: Words>(
    ground: &Ground<'_, D>,
    clauses: &[Vec<Offer<'_>>],
    partial: &Partial<D::Scene>,
    done: &mut Vec<Candidate>,
) {
    let Some((next, rest)) = clauses.split_first() else {
        let mut whole = partial.candidate.clone();
        let roles = &ground.moment.domain.lexicon(ground.context.edition).roles;
        // Clauses that ask for nothing ("turn around") are no request by themselves.
        if whole.program.steps.is_empty() && whole.left_over.is_empty() {
            return;
        }
        let steps = &whole.program.steps;
        // Whether every clause was read as one primitive.
        let spelled_out = ground.context.lists.is_some() && whole.seed;
        let reason = match spelled_out {
            true if purpose::undoes_itself(roles, steps) => Some(
                "it would be taken again from where it was put, so it was put there for \
                 something that is not known",
            ),
            true if ground.context.execution.purposes => {
                let forbidden = matches!(whole.verdict, Verdict::Forbidden { .. });
                purpose::beyond_steps(roles, steps, whole.lifted.len(), forbidden)
            }
            _ => None,
        };
        if let Some(reason) = reason {
            whole.verdict = Verdict::Unfilled { reason: reason.to_owned() };
        }
        done.push(whole);
        return;
    };
    for offer in next {
        if done.len() >= COMBINATIONS_MAX {
            return;
        }
        extend(ground, rest, &ground.advance(partial, offer, rest.is_empty()), done);
    }
}

pub(super) struct Ground<'a, D: Words> {
    /// When it is said.
    pub moment: &'a Moment<'a, D>,
    /// How clauses are put together.
    pub context: &'a Context<'a>,
}

impl<D: Words> Ground<'_, D> {
    /// Grounds one more clause. Once a step is forbidden nothing more is run, but the program is
    /// completed, so that the answer can show all of what was understood.
    ///
    /// - `last`: whether no clause follows.
    fn advance(
        &self,
        partial: &Partial<D::Scene>,
        offer: &Offer<'_>,
        last: bool,
    ) -> Partial<D::Scene> {
        let domain = self.moment.domain;
        let left = self.passed_over(offer);
        if !left.is_empty() {
            return self.leave(partial, offer, left);
        }
        let before = partial.candidate.mentioned.as_ref();
        let edition = self.context.edition;
        let mut referents =
            resolve(domain, edition, &partial.scene, &offer.clause.mentions, before);
        self.prefer_what_is_there(&partial.scene, offer.clause, &mut referents.types);
        let held = domain.held(&partial.scene);
        let mentioned = referents.last.clone();
        // "Put the plate in it": what is in the hand goes in something else, whatever "it" means.
        let mentions = &offer.clause.mentions;
        let pronoun = offer.seed && mentions.len() > 1 && mentions.iter().any(|m| m.pronoun);
        let accounts = self.context.execution.accounting.is_some();
        let chosen_by_world = offer.open || pronoun || (accounts && offer.seed);
        if let (true, Some(lists)) = (chosen_by_world, self.context.lists) {
            let arguments = Arguments {
                domain,
                lists,
                clause: offer.clause,
                types: &referents.types,
                held: held.clone(),
                here: domain.here(&partial.scene),
                last: before,
                recent: self.recent(partial),
                absent: self.absent(partial, &referents.types),
                accounting: self.context.execution.accounting.as_ref(),
                edition: self.context.edition,
            };
            let carrying = self.context.execution.carrying.as_ref().filter(|_| offer.seed);
            let operator = offer.program.steps.first().map(|step| &step.operator);
            let carried = carrying.zip(operator).and_then(|(c, o)| arguments.carry(c, o, last));
            let strictly = carried.is_some();
            let filling = match offer.program.steps.is_empty() {
                true => None,
                false => carried.or_else(|| arguments.fill(&offer.program)),
            };
            // A seed's own words are answered, if only with what the world says against them.
            if filling.is_some() || offer.open || pronoun {
                return self.advance_open(partial, offer, &arguments, filling, strictly, mentioned);
            }
        }
        let mentions = &offer.clause.mentions;
        let best: Vec<Option<Symbol>> =
            referents.types.iter().map(|t| t.first().cloned()).collect();
        let obvious = fill(&offer.program, mentions, &best, held.as_ref()).program;
        let chosen = match self.choose(partial, offer, &referents.types, &obvious, false) {
            Ok(chosen) => chosen,
            Err(reason) => return self.nothing_like_it(partial, offer, obvious, reason),
        };
        let mut first = None;
        for types in choices(&referents.types, &offer.program) {
            let mut filled = fill(&offer.program, &offer.clause.mentions, &types, held.as_ref());
            filled.chosen = chosen.clone();
            let next = self.try_filled(partial, offer, filled, named_last(&types, before));
            match next.candidate.verdict {
                _ if self.context.execution.kinds => return next,
                Verdict::Runs { .. } => return next,
                // "The counter" across the room does not come to mean the table beside the robot.
                Verdict::Forbidden { mendable: true, .. } if first.is_none() => return next,
                _ => first.get_or_insert(next),
            };
        }
        first.expect("there is always the choice of every mention's best type")
    }

    /// Grounds a clause whose arguments the world chooses.
    fn advance_open(
        &self,
        partial: &Partial<D::Scene>,
        offer: &Offer<'_>,
        arguments: &Arguments<'_, D>,
        filling: Option<Filling>,
        strictly: bool,
        mentioned: Option<Symbol>,
    ) -> Partial<D::Scene> {
        let obvious = filling.as_ref().and_then(|filling| filling.programs.first());
        let chosen =
            match obvious.map(|o| self.choose(partial, offer, arguments.types, o, strictly)) {
                None => Chosen::default(),
                Some(Ok(chosen)) => chosen,
                Some(Err(reason)) => {
                    let obvious = obvious.expect("something was chosen for it").clone();
                    return self.nothing_like_it(partial, offer, obvious, reason);
                }
            };
        let program = |program| Filled { program, chosen: chosen.clone(), missing: None };
        let Some(filling) = filling else {
            let mut filled = program(Program { steps: Vec::new() });
            let steps = &partial.candidate.program.steps;
            let known = |kind: &Symbol| steps.iter().any(|step| step.args.contains(kind));
            if offer.program.steps.is_empty() && arguments.types.iter().flatten().any(known) {
                let reason = "it is about something that was already used".to_owned();
                filled.missing = Some(Missing::Slot { reason });
            }
            if !offer.program.steps.is_empty() {
                let reason = format!("the words do not say what {} is for", offer.program);
                filled.missing = Some(Missing::Slot { reason });
            }
            return self.try_filled(partial, offer, filled, mentioned);
        };
        let unlike = |ground: &Program| self.unlike(&partial.scene, offer.clause, ground);
        if let (true, Some(word)) = (offer.seed, filling.programs.first().and_then(unlike)) {
            let mut filled = program(Program { steps: Vec::new() });
            filled.missing = Some(Missing::Slot { reason: format!("nothing of it is {word}") });
            return self.try_filled(partial, offer, filled, mentioned);
        }
        if let (true, Some(first)) = (arguments.accounts(), filling.programs.first()) {
            let left = arguments.passed_over(first, offer.taught.filter(|_| !offer.seed));
            if !left.is_empty() {
                return self.leave(partial, offer, left);
            }
        }
        let further = Offer { distance: further(offer.distance, filling.penalty), ..offer.clone() };
        let mut first = None;
        let choices = if self.context.execution.kinds { 1 } else { TYPE_CHOICES_MAX };
        for ground in filling.programs.into_iter().take(choices) {
            let named = ground.steps.last().and_then(|step| step.args.first()).cloned();
            let mentioned = named.or_else(|| mentioned.clone());
            let next = self.try_filled(partial, &further, program(ground), mentioned);
            match next.candidate.verdict {
                Verdict::Runs { .. } => return next,
                Verdict::Forbidden { mendable: true, .. } if first.is_none() => return next,
                _ => {}
            }
            first.get_or_insert(next);
        }
        first.expect("a filling has at least one program")
    }

    /// A reading whose words say of a thing what none here is: understood, and impossible.
    fn nothing_like_it(
        &self,
        partial: &Partial<D::Scene>,
        offer: &Offer<'_>,
        program: Program,
        reason: String,
    ) -> Partial<D::Scene> {
        let missing = Some(Missing::Meaning { step: 0, reason });
        let filled = Filled { program, chosen: Chosen::default(), missing };
        self.try_filled(partial, offer, filled, partial.candidate.mentioned.clone())
    }

    /// Per mention whether nothing of its likeliest type is in the scene.
    fn absent(&self, partial: &Partial<D::Scene>, types: &[Vec<Symbol>]) -> Vec<bool> {
        if self.context.execution.accounting.is_none() {
            return Vec::new();
        }
        let first = Pointing { number: Some(1), ..Pointing::default() };
        let absent = |kinds: &Vec<Symbol>| {
            let kind = kinds.first();
            kind.is_some_and(|k| self.moment.domain.choose(&partial.scene, k, &first).is_err())
        };
        types.iter().map(absent).collect()
    }

    /// The types of what was acted on, newest first.
    fn recent(&self, partial: &Partial<D::Scene>) -> Vec<Symbol> {
        let steps = partial.candidate.program.steps.iter().rev();
        let here = steps.flat_map(|step| step.args.iter().cloned());
        // `Mug 2` is a `Mug`.
        let kind = |name: &String| Symbol::new(name.split(' ').next().unwrap_or_default());
        here.chain(self.moment.handled.iter().map(kind)).collect()
    }

    /// The words that an offer passes over, before anything is filled.
    fn passed_over(&self, offer: &Offer<'_>) -> Vec<String> {
        let Some((accounting, lists)) =
            self.context.execution.accounting.as_ref().zip(self.context.lists)
        else {
            return Vec::new();
        };
        let lesson = !offer.seed;
        let taught = |phrase: &&String| {
            let words = phrase.split(' ');
            offer.taught.is_some_and(|taught| {
                words.into_iter().all(|word| {
                    taught.words.iter().any(|w| matches!(w, Word::Text(t) if t == word))
                })
            })
        };
        let literal = lesson && offer.is_literal();
        let amounts = self.context.amounts.iter().filter(|phrase| !(literal && taught(phrase)));
        let mut left: Vec<String> = amounts.cloned().collect();
        left.extend(offer.dropped.iter().cloned());
        if literal {
            return left;
        }
        let lexicon = self.moment.domain.lexicon(self.context.edition);
        let (adjectives, roles) = (lexicon.adjectives.as_slice(), &lexicon.roles);
        let account = Account { lists, adjectives, roles, accounting, clause: offer.clause };
        let more = match (lesson, offer.taught, offer.program.steps.as_slice()) {
            (true, taught, _) => account.of_lesson(taught.unwrap_or(&LiftedUtterance::default())),
            (false, _, [step]) => account.of_primitive(&step.operator),
            (false, _, []) => account.of_idle(),
            _ => Vec::new(),
        };
        left.extend(more.into_iter().filter(|word| !amounts_hold(self.context.amounts, word)));
        left
    }

    /// A reading that would pass words over: none of it is done.
    fn leave(
        &self,
        partial: &Partial<D::Scene>,
        offer: &Offer<'_>,
        left: Vec<String>,
    ) -> Partial<D::Scene> {
        let quoted: Vec<String> = left.iter().map(|word| format!("{word:?}")).collect();
        let reason = format!("nothing that was understood is about {}", quoted.join(" and "));
        let missing = Some(Missing::Slot { reason });
        let program = Program { steps: Vec::new() };
        let filled = Filled { program, chosen: Chosen::default(), missing };
        let mentioned = partial.candidate.mentioned.clone();
        let mut next = self.try_filled(partial, offer, filled, mentioned);
        next.candidate.left_over.extend(left);
        next
    }

    /// A word before a mention of something in the program that is true of nothing of its type.
    fn unlike<'c>(
        &self,
        scene: &D::Scene,
        clause: &'c Clause,
        program: &Program,
    ) -> Option<&'c String> {
        let words = &clause.lifted.words;
        let slots = (0..words.len()).filter(|&at| matches!(words[at], Word::Slot { .. }));
        let described = slots.zip(&clause.mentions).filter_map(|(at, mention)| {
            let before = at.checked_sub(1).and_then(|before| words.get(before))?;
            let Word::Text(word) = before else { return None };
            Some((word, mention))
        });
        let used = |kind: &Symbol| program.steps.iter().any(|step| step.args.contains(kind));
        described
            .filter(|(word, mention)| {
                let mut kinds = mention.types.iter().filter(|kind| used(kind));
                kinds.any(|kind| self.moment.domain.unlike(scene, kind, word))
            })
            .map(|(word, _)| word)
            .next()
    }

    fn try_filled(
        &self,
        partial: &Partial<D::Scene>,
        offer: &Offer<'_>,
        mut filled: Filled,
        mentioned: Option<Symbol>,
    ) -> Partial<D::Scene> {
        let so_far = &partial.candidate;
        let mut scene = partial.scene.clone();
        let mut lessons = partial.lessons.clone();
        if !offer.seed && self.context.execution.accounting.is_some() {
            // "Put it in the microwave, heat it": once is what was asked for.
            if filled.missing.is_none() && lessons.contains(&filled.program) {
                let reason = "the same lesson would be done twice".to_owned();
                filled.missing = Some(Missing::Slot { reason });
            }
            lessons.push(filled.program.clone());
        }
        let mut steps = so_far.program.steps.clone();
        let mut verdict = match (so_far.verdict.clone(), filled.missing) {
            (Verdict::Runs { .. }, Some(Missing::Slot { reason })) => Verdict::Unfilled { reason },
            (Verdict::Runs { .. }, Some(Missing::Meaning { step, reason })) => {
                let step = (steps.len() + step) as u32;
                Verdict::Forbidden { step, reason, mendable: false }
            }
            (Verdict::Runs { bindings, chosen }, None) => {
                let mut done = Done { steps: steps.clone(), bindings, chosen };
                let wished = &filled.chosen;
                let after_lesson = !so_far.seed;
                match self.run(&mut scene, &mut done, offer, after_lesson, &filled.program, wished)
                {
                    Ok(()) => {
                        steps = done.steps;
                        Verdict::Runs { bindings: done.bindings, chosen: done.chosen }
                    }
                    Err(failed) => failed,
                }
            }
            (failed, _) => failed,
        };
        if !matches!(verdict, Verdict::Runs { .. }) {
            // The scene stays as it was before the clause: none of it will be carried out.
            scene = partial.scene.clone();
            steps.extend(filled.program.steps);
        }
        if steps.len() > PROGRAM_STEPS_MAX {
            let found = steps.len();
            steps.truncate(PROGRAM_STEPS_MAX);
            let reason =
                format!("that would take {found} steps; at most {PROGRAM_STEPS_MAX} are allowed");
            verdict = Verdict::Unfilled { reason };
        }
        let mut lifted = so_far.lifted.clone();
        lifted.push(offer.clause.lifted.clone());
        let mut answered_by = so_far.answered_by.clone();
        answered_by.extend(offer.by);
        let candidate = Candidate {
            program: Program { steps },
            distance: (self.context.chain)(so_far.distance, offer.distance),
            seed: so_far.seed && offer.seed,
            exact: so_far.exact && offer.exact,
            verdict,
            lifted,
            answered_by,
            mentioned,
            literal: so_far.literal && offer.is_literal(),
            left_over: so_far.left_over.clone(),
        };
        Partial { scene, candidate, lessons }
    }
}

fn amounts_hold(amounts: &[String], word: &str) -> bool {
    amounts.iter().any(|phrase| phrase.split(' ').any(|part| part == word))
}

/// The distance of a reading whose arguments are not the obvious ones: each point of penalty takes
/// half a logit from its probability.
fn further(distance: f32, penalty: f32) -> f32 {
    let factor = crate::numerics::exp(-0.5 * penalty);
    let kept = (1.0 - distance) * factor;
    distance / (distance + kept).max(f32::MIN_POSITIVE)
}
