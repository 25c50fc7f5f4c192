//! Filling the slots of a lifted program with the types that the words mean.

use super::chosen::Chosen;
use crate::language::{LiftedArg, LiftedProgram, Mention, Program, Step, Symbol};
use crate::limits::TYPE_CHOICES_MAX;

/// A lifted program with its slots filled as far as possible.
pub(super) struct Filled {
    /// With the words of unfilled slots in their places.
    pub program: Program,
    /// Which things words chose.
    pub chosen: Chosen,
    /// Why it is not complete, if it is not.
    pub missing: Option<Missing>,
}

pub(super) enum Missing {
    /// The utterance has no such mention: the program is not what it asks for.
    Slot { reason: String },
    /// The mention is there, but nothing tells what it means.
    Meaning { step: usize, reason: String },
}

/// Which types the mentions are tried with: first the best of each; then, one mention at a time,
/// the others that share its name ("cup" when only the mug can be picked up).
pub(super) fn choices(types: &[Vec<Symbol>], program: &LiftedProgram) -> Vec<Vec<Option<Symbol>>> {
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

pub(super) fn named_last(types: &[Option<Symbol>], before: Option<&Symbol>) -> Option<Symbol> {
    types.iter().rev().flatten().next().or(before).cloned()
}

/// What cannot be filled keeps the word that stood for it, so that the answer can show it.
pub(super) fn fill(
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
    Filled { program: Program { steps }, chosen: Chosen::default(), missing }
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
