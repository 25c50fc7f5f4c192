use super::arguments::Arguments;
use super::moment::Moment;
use super::purpose;
use super::resolver::resolve;
use super::settings::Execution;
use crate::language::{
    Answerer, Clause, LiftedArg, LiftedProgram, LiftedUtterance, Mention, Program, Step, Symbol,
    Word, WordLists,
};
use crate::limits::{COMBINATIONS_MAX, PROGRAM_STEPS_MAX, TYPE_CHOICES_MAX};
use crate::world::Domain;

/// A lifted program that the parser offers for a clause.
#[derive(Debug, Clone)]
pub struct Offer<'a> {
    /// The clause in the reading that the program was found for.
    pub clause: &'a Clause,
    pub program: LiftedProgram,
    pub distance: f32,
    /// Whether the clause has exactly the exemplar's lifted form.
    pub exact: bool,
    /// Whether the exemplar is a seed.
    pub seed: bool,
    /// Whether the world says which mention fills which slot.
    pub open: bool,
    /// Which part of the parser offers it, where it has parts.
    pub by: Option<Answerer>,
}

/// How clauses are put together.
pub struct Context<'a> {
    pub execution: &'a Execution,
    /// For choosing the arguments of open programs.
    pub lists: Option<&'a WordLists>,
    /// The distance of a chain from that of its first clauses and the next one's.
    pub chain: &'a dyn Fn(f32, f32) -> f32,
}

/// A ground program for the whole utterance, and what the world says to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    pub program: Program,
    /// That of the chain of its clauses.
    pub distance: f32,
    pub seed: bool,
    /// Whether all of its words were exactly an exemplar's, clause by clause.
    pub exact: bool,
    pub verdict: Verdict,
    pub lifted: Vec<LiftedUtterance>,
    /// Which part of the parser gave each clause's program; empty where it has no parts.
    pub answered_by: Vec<Answerer>,
    /// What was named last, for a later "it".
    pub mentioned: Option<Symbol>,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// It runs; per step the things it acts on.
    Runs { bindings: Vec<Vec<String>> },
    /// The words make sense and the world forbids the 0-based `step`. `mendable`: another step
    /// first, such as going there, would allow it.
    Forbidden { step: u32, reason: String, mendable: bool },
    /// The words do not fill the program.
    Unfilled { reason: String },
}

/// The cross product of the clauses' offers, each combination grounded and run on a copy of the
/// scene (paper, section 3.1.3). A clause is grounded in the scene that the clauses before it lead
/// to, so "it" follows the hand.
///
/// - returns: at most [`COMBINATIONS_MAX`], in the order of the offers, the last clause's varying
///   fastest.
pub fn combine<D: Domain>(
    moment: &Moment<'_, D>,
    context: &Context<'_>,
    clauses: &[Vec<Offer<'_>>],
) -> Vec<Candidate> {
    let start = Partial {
        scene: moment.scene.clone(),
        literal: true,
        candidate: Candidate {
            program: Program { steps: Vec::new() },
            distance: 0.0,
            seed: true,
            exact: true,
            verdict: Verdict::Runs { bindings: Vec::new() },
            lifted: Vec::new(),
            answered_by: Vec::new(),
            mentioned: moment.mentioned.cloned(),
        },
    };
    let mut done = Vec::new();
    if !clauses.is_empty() {
        extend(&Ground { moment, context }, clauses, &start, &mut done);
    }
    done
}

/// The first clauses of a combination, and the scene they lead to.
struct Partial<S> {
    scene: S,
    /// Whether every clause so far was read as one primitive.
    literal: bool,
    candidate: Candidate,
}

fn extend<D: Domain>(
    ground: &Ground<'_, D>,
    clauses: &[Vec<Offer<'_>>],
    partial: &Partial<D::Scene>,
    done: &mut Vec<Candidate>,
) {
    let Some((next, rest)) = clauses.split_first() else {
        let mut whole = partial.candidate.clone();
        let roles = &ground.moment.domain.lexicon().roles;
        // Clauses that ask for nothing ("turn around") are no request by themselves.
        if whole.program.steps.is_empty() {
            return;
        }
        let steps = &whole.program.steps;
        let literal = ground.context.lists.is_some() && partial.literal;
        let reason = match literal {
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
        extend(ground, rest, &ground.advance(partial, offer), done);
    }
}

struct Ground<'a, D: Domain> {
    moment: &'a Moment<'a, D>,
    context: &'a Context<'a>,
}

impl<D: Domain> Ground<'_, D> {
    /// Grounds one more clause. Once a step is forbidden nothing more is run, but the program is
    /// completed, so that the answer can show all of what was understood.
    fn advance(&self, partial: &Partial<D::Scene>, offer: &Offer<'_>) -> Partial<D::Scene> {
        let domain = self.moment.domain;
        let before = partial.candidate.mentioned.as_ref();
        let referents = resolve(domain, &partial.scene, &offer.clause.mentions, before);
        let held = domain.held(&partial.scene);
        let mentioned = referents.last.clone();
        // "Put the plate in it": what is in the hand goes in something else, whatever "it" means.
        let mentions = &offer.clause.mentions;
        let pronoun = offer.seed && mentions.len() > 1 && mentions.iter().any(|m| m.pronoun);
        if let (true, Some(lists)) = (offer.open || pronoun, self.context.lists) {
            let arguments = Arguments {
                domain,
                lists,
                clause: offer.clause,
                types: &referents.types,
                held: held.clone(),
                here: domain.here(&partial.scene),
                last: before,
            };
            return self.advance_open(partial, offer, &arguments, mentioned);
        }
        let mut first = None;
        for types in choices(&referents.types, &offer.program) {
            let filled = fill(&offer.program, &offer.clause.mentions, &types, held.as_ref());
            let next = self.try_filled(partial, offer, filled, named_last(&types, before));
            match next.candidate.verdict {
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
        mentioned: Option<Symbol>,
    ) -> Partial<D::Scene> {
        let program = |program| Filled { program, missing: None };
        let filling = match offer.program.steps.is_empty() {
            true => None,
            false => arguments.fill(&offer.program),
        };
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
        let further = Offer { distance: further(offer.distance, filling.penalty), ..offer.clone() };
        let mut first = None;
        for ground in filling.programs.into_iter().take(TYPE_CHOICES_MAX) {
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
        filled: Filled,
        mentioned: Option<Symbol>,
    ) -> Partial<D::Scene> {
        let so_far = &partial.candidate;
        let mut scene = partial.scene.clone();
        let mut steps = so_far.program.steps.clone();
        let mut verdict = so_far.verdict.clone();
        if let Verdict::Runs { bindings } = &mut verdict {
            let failed = match filled.missing {
                Some(Missing::Slot { reason }) => Some(Verdict::Unfilled { reason }),
                Some(Missing::Meaning { step, reason }) => {
                    let step = (steps.len() + step) as u32;
                    Some(Verdict::Forbidden { step, reason, mendable: false })
                }
                None => self.run(&mut scene, &mut steps, bindings, offer, &filled.program).err(),
            };
            if let Some(failed) = failed {
                verdict = failed;
                // The scene stays as it was before the clause: none of it will be carried out.
                scene = partial.scene.clone();
                steps.truncate(so_far.program.steps.len());
                steps.extend(filled.program.steps);
            }
        } else {
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
        };
        let literal = partial.literal && offer.seed;
        Partial { scene, literal, candidate }
    }

    /// Carries the steps out on the copy of the scene.
    ///
    /// - errors: [`Verdict::Forbidden`], its step counted over the whole program.
    fn run(
        &self,
        scene: &mut D::Scene,
        steps: &mut Vec<Step>,
        bindings: &mut Vec<Vec<String>>,
        offer: &Offer<'_>,
        program: &Program,
    ) -> Result<(), Verdict> {
        let (domain, task) = (self.moment.domain, self.moment.task);
        let before = steps.len();
        let contradicted = |scene: &D::Scene, from: usize| {
            let rest = Program { steps: program.steps[from..].to_vec() };
            if !self.context.execution.polarity {
                return None;
            }
            let (step, reason) = domain.contradiction(scene, &offer.clause.words, &rest)?;
            let step = (before + from + step) as u32;
            Some(Verdict::Forbidden { step, reason, mendable: false })
        };
        if let Some(contradiction) = contradicted(scene, 0) {
            return Err(contradiction);
        }
        for (index, step) in program.steps.iter().enumerate() {
            let refused = |reason, mendable| Verdict::Forbidden {
                step: (before + index) as u32,
                reason,
                mendable,
            };
            if steps.len() >= PROGRAM_STEPS_MAX {
                return Err(refused("the program is too long".to_owned(), false));
            }
            domain.signature().check(step).map_err(|reason| refused(reason, false))?;
            let mut unasked = 0;
            let bound = loop {
                let refusal = match domain.step(scene, task, step) {
                    Ok(bound) => break Some(bound),
                    Err(refusal) => refusal,
                };
                // What is in the fridge across the room takes two: going there and opening it.
                let roles = &domain.lexicon().roles;
                let means = roles.goes(&step.operator) || roles.is_door(&step.operator);
                // How the lesson got there need not be how one gets there here.
                if offer.open && program.steps.len() > 1 && means && refusal.first.is_none() {
                    break None;
                }
                let mendable = refusal.first.is_some();
                let first = refusal.first.filter(|_| self.context.execution.approach);
                let Some(first) = first.filter(|_| unasked < UNASKED_STEPS_MAX) else {
                    return Err(refused(refusal.reason, mendable));
                };
                let bound =
                    domain.step(scene, task, &first).map_err(|e| refused(e.reason, false))?;
                steps.push(first);
                bindings.push(bound);
                unasked += 1;
                // What was too far away to contradict the words is near now.
                if let Some(contradiction) = contradicted(scene, index) {
                    return Err(contradiction);
                }
            };
            if let Some(bound) = bound {
                bindings.push(bound);
                steps.push(step.clone());
            }
        }
        Ok(())
    }
}

/// The distance of a reading whose arguments are not the obvious ones: each point of penalty takes
/// half a logit from its probability.
fn further(distance: f32, penalty: f32) -> f32 {
    let factor = crate::numerics::exp(-0.5 * penalty);
    let kept = (1.0 - distance) * factor;
    distance / (distance + kept).max(f32::MIN_POSITIVE)
}

/// Steps taken unasked before one step that needs them.
const UNASKED_STEPS_MAX: usize = 3;

/// Which types the mentions are tried with: first the best of each; then, one mention at a time,
/// the others that share its name ("cup" when only the mug can be picked up).
fn choices(types: &[Vec<Symbol>], program: &LiftedProgram) -> Vec<Vec<Option<Symbol>>> {
    let best: Vec<Option<Symbol>> = types.iter().map(|types| types.first().cloned()).collect();
    let mut all = vec![best.clone()];
    for (index, others) in types.iter().enumerate() {
        let used = program.steps.iter().flat_map(|step| &step.args).any(
            |arg| matches!(arg, LiftedArg::Slot { number, .. } if *number as usize == index + 1),
        );
        for other in others.iter().skip(1).filter(|_| used) {
            if all.len() >= TYPE_CHOICES_MAX {
                return all;
            }
            let mut choice = best.clone();
            choice[index] = Some(other.clone());
            all.push(choice);
        }
    }
    all
}

fn named_last(types: &[Option<Symbol>], before: Option<&Symbol>) -> Option<Symbol> {
    types.iter().rev().flatten().next().or(before).cloned()
}

/// A lifted program with its slots filled, as far as that went.
struct Filled {
    program: Program,
    missing: Option<Missing>,
}

enum Missing {
    /// The utterance has no such mention: the program is not what it asks for.
    Slot { reason: String },
    /// The mention is there, but nothing tells what it means.
    Meaning { step: usize, reason: String },
}

/// What cannot be filled keeps the word that stood for it, so that the answer can show it.
fn fill(
    program: &LiftedProgram,
    mentions: &[Mention],
    types: &[Option<Symbol>],
    held: Option<&Symbol>,
) -> Filled {
    let mut missing = None;
    let mut steps = Vec::with_capacity(program.steps.len());
    for (index, step) in program.steps.iter().enumerate() {
        let mut fill_arg = |arg: &LiftedArg| {
            let (lacking, stand_in) = match arg {
                LiftedArg::Constant(symbol) => return symbol.clone(),
                LiftedArg::Held => match held {
                    Some(held) => return held.clone(),
                    None => {
                        let reason = "the robot holds nothing".to_owned();
                        (Missing::Meaning { step: index, reason }, arg.to_string())
                    }
                },
                LiftedArg::Slot { number, .. } => {
                    let place = *number as usize - 1;
                    match (mentions.get(place), types.get(place)) {
                        (_, Some(Some(kind))) => return kind.clone(),
                        (Some(mention), _) => {
                            (unexplained(index, mention), mention.surface.clone())
                        }
                        (None, _) => {
                            let reason = format!(
                                "it takes {} named things, and {} were named",
                                program.slots(),
                                mentions.len()
                            );
                            (Missing::Slot { reason }, arg.to_string())
                        }
                    }
                }
            };
            // A missing slot outweighs a missing meaning: it says the program is another one.
            let replace = matches!(
                (&missing, &lacking),
                (None, _) | (Some(Missing::Meaning { .. }), Missing::Slot { .. })
            );
            if replace {
                missing = Some(lacking);
            }
            Symbol::new(&stand_in)
        };
        let args = step.args.iter().map(&mut fill_arg).collect();
        steps.push(Step { operator: step.operator.clone(), args });
    }
    Filled { program: Program { steps }, missing }
}

fn unexplained(step: usize, mention: &Mention) -> Missing {
    let word = &mention.surface;
    let reason = if mention.pronoun {
        format!("nothing was named before that {word:?} could mean, and the robot holds nothing")
    } else {
        format!("there is no {word} here")
    };
    Missing::Meaning { step, reason }
}
