use std::collections::BTreeSet;

use crate::language::{
    Exemplar, LiftedArg, LiftedProgram, LiftedStep, LiftedUtterance, Signature, Symbol, Word,
};

/// How many slots the decoder's input tells apart. It can copy more.
const SLOTS_TOLD: usize = 4;

/// The tokens of programs. Those that can be written have numbers: operators, then the end, then
/// constants. A slot is never written; it is copied from its place in the utterance.
#[derive(Debug, Clone)]
pub(super) struct Vocabulary {
    /// Each operator and the sorts of its arguments.
    operators: Vec<(Symbol, Vec<Symbol>)>,
    /// The arguments that are not slots: types, `<held>`.
    constants: Vec<LiftedArg>,
    /// Steps of the longest program in training. No longer one is written.
    pub steps_max: usize,
}

/// One token of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Choice {
    Write(usize),
    /// The n-th slot of the utterance, from 0.
    Copy(usize),
}

/// What may come next in a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Expected {
    /// An operator, or the end if there is a step before.
    Step { first: bool, last: bool },
    /// An argument of an operator.
    Argument { operator: usize, place: usize },
}

impl Vocabulary {
    /// - `exemplars`: whose programs name the constants.
    pub(super) fn new(signature: &Signature, exemplars: &[&Exemplar]) -> Vocabulary {
        let operators = signature.operators.iter();
        let operators = operators.map(|o| (o.name.clone(), o.args.clone())).collect();
        let programs = exemplars.iter().map(|exemplar| &exemplar.program);
        let args = programs.clone().flat_map(|p| &p.steps).flat_map(|step| &step.args);
        let constant = |arg: &&LiftedArg| !matches!(arg, LiftedArg::Slot { .. });
        let constants: BTreeSet<LiftedArg> = args.filter(constant).cloned().collect();
        let steps_max = programs.map(|program| program.steps.len()).max().unwrap_or(1);
        Vocabulary { operators, constants: constants.into_iter().collect(), steps_max }
    }

    /// How many tokens can be written.
    pub(super) fn writes(&self) -> usize {
        self.operators.len() + 1 + self.constants.len()
    }

    /// How many tokens the decoder's input can have.
    pub(super) fn tokens(&self) -> usize {
        self.writes() + SLOTS_TOLD
    }

    pub(super) fn end(&self) -> usize {
        self.operators.len()
    }

    /// The input of the decoder after a choice.
    pub(super) fn told(&self, choice: Choice) -> usize {
        match choice {
            Choice::Write(token) => token,
            Choice::Copy(slot) => self.writes() + slot.min(SLOTS_TOLD - 1),
        }
    }

    /// The tokens of a program, the end included.
    ///
    /// - returns: `None` for a program that is none of this signature's, or has a slot that the
    ///   utterance has not.
    pub(super) fn encode(&self, exemplar: &Exemplar) -> Option<Vec<Choice>> {
        let slots = exemplar.utterance.slots();
        let mut out = Vec::new();
        for step in &exemplar.program.steps {
            let operator = self.operators.iter().position(|(name, _)| *name == step.operator)?;
            if self.operators[operator].1.len() != step.args.len() {
                return None;
            }
            out.push(Choice::Write(operator));
            for arg in &step.args {
                out.push(match arg {
                    LiftedArg::Slot { number, .. } => {
                        let slot = usize::from(*number).checked_sub(1)?;
                        (slot < slots).then_some(Choice::Copy(slot))?
                    }
                    constant => {
                        let place = self.constants.iter().position(|known| known == constant)?;
                        Choice::Write(self.end() + 1 + place)
                    }
                });
            }
        }
        (!out.is_empty()).then(|| out.push(Choice::Write(self.end())))?;
        Some(out)
    }

    /// The program that whole choices stand for, the end left out.
    ///
    /// - `sorts`: of the utterance's slots.
    pub(super) fn decode(&self, choices: &[Choice], sorts: &[Symbol]) -> LiftedProgram {
        let mut steps: Vec<LiftedStep> = Vec::new();
        for choice in choices {
            let arg = match *choice {
                Choice::Write(token) if token < self.operators.len() => {
                    let operator = self.operators[token].0.clone();
                    steps.push(LiftedStep { operator, args: Vec::new() });
                    continue;
                }
                Choice::Write(token) if token == self.end() => break,
                Choice::Write(token) => self.constants[token - self.end() - 1].clone(),
                Choice::Copy(slot) => {
                    LiftedArg::Slot { sort: sorts[slot].clone(), number: slot as u8 + 1 }
                }
            };
            let step = steps.last_mut().expect("a program begins with an operator");
            step.args.push(arg);
        }
        LiftedProgram { steps }
    }

    /// What is expected at the beginning, then after each choice.
    pub(super) fn start(&self) -> Expected {
        Expected::Step { first: true, last: false }
    }

    /// - `steps`: operators chosen so far, this choice included.
    pub(super) fn after(&self, expected: Expected, choice: Choice, steps: usize) -> Expected {
        let next = |operator: usize, place: usize| match self.operators[operator].1.len() > place {
            true => Expected::Argument { operator, place },
            false => Expected::Step { first: false, last: steps >= self.steps_max },
        };
        match (expected, choice) {
            (Expected::Argument { operator, place }, _) => next(operator, place + 1),
            (Expected::Step { .. }, Choice::Write(token)) if token < self.end() => next(token, 0),
            // After the end, nothing is expected.
            (Expected::Step { .. }, _) => expected,
        }
    }

    /// The choices that lead to a program (grammar of programs): an operator whose arguments can
    /// all be filled, the end behind a step, a constant or a slot of the argument's sort.
    ///
    /// - `sorts`: of the utterance's slots.
    pub(super) fn allowed(&self, expected: Expected, sorts: &[Symbol]) -> Vec<Choice> {
        match expected {
            Expected::Step { first, last } => {
                let fills = |sort: &Symbol| !self.constants.is_empty() || sorts.contains(sort);
                let fillable = |operator: &usize| self.operators[*operator].1.iter().all(fills);
                let operators = (0..self.operators.len()).filter(|o| !last && fillable(o));
                let end = (!first).then_some(self.end());
                operators.chain(end).map(Choice::Write).collect()
            }
            Expected::Argument { operator, place } => {
                let wanted = &self.operators[operator].1[place];
                let constants = self.end() + 1..self.writes();
                let slots = (0..sorts.len()).filter(|&slot| sorts[slot] == *wanted);
                constants.map(Choice::Write).chain(slots.map(Choice::Copy)).collect()
            }
        }
    }
}

/// The sorts of an utterance's slots, and where they stand among its words.
pub(super) fn slots(utterance: &LiftedUtterance) -> (Vec<Symbol>, Vec<usize>) {
    let slot = |(place, word): (usize, &Word)| match word {
        Word::Slot { sort, .. } => Some((sort.clone(), place)),
        Word::Text(_) => None,
    };
    utterance.words.iter().enumerate().filter_map(slot).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::Operator;

    fn vocabulary() -> (Vocabulary, Exemplar) {
        let operator = |name: &str, args: usize| Operator {
            name: Symbol::new(name),
            args: vec![Symbol::new("obj"); args],
        };
        let signature = Signature { operators: vec![operator("GOTO", 1), operator("PUT", 2)] };
        let exemplar = Exemplar {
            utterance: LiftedUtterance::parse("put the <obj> by the <obj>"),
            program: "GOTO <obj:2>; PUT <obj:1> Sink; GOTO <held>".parse().unwrap(),
        };
        (Vocabulary::new(&signature, &[&exemplar]), exemplar)
    }

    #[test]
    fn a_program_comes_back_from_its_tokens() {
        let (vocabulary, exemplar) = vocabulary();
        let choices = vocabulary.encode(&exemplar).unwrap();
        assert_eq!(choices.len(), 8);
        let (sorts, places) = slots(&exemplar.utterance);
        assert_eq!(places, [2, 5]);
        assert_eq!(vocabulary.decode(&choices, &sorts), exemplar.program);
        let other = Exemplar { program: "JUMP <obj:1>".parse().unwrap(), ..exemplar.clone() };
        assert_eq!(vocabulary.encode(&other), None);
        let other = Exemplar { program: "GOTO <obj:3>".parse().unwrap(), ..exemplar };
        assert_eq!(vocabulary.encode(&other), None);
    }

    #[test]
    fn only_what_leads_to_a_program_is_allowed() {
        let (vocabulary, exemplar) = vocabulary();
        let choices = vocabulary.encode(&exemplar).unwrap();
        let (sorts, _) = slots(&exemplar.utterance);
        let (mut expected, mut steps) = (vocabulary.start(), 0);
        let end = Choice::Write(vocabulary.end());
        assert!(!vocabulary.allowed(expected, &sorts).contains(&end), "no empty program");
        for choice in choices {
            assert!(vocabulary.allowed(expected, &sorts).contains(&choice), "{choice:?}");
            steps += usize::from(matches!(choice, Choice::Write(token) if token < 2));
            expected = vocabulary.after(expected, choice, steps);
        }
        let full = Expected::Step { first: false, last: true };
        assert_eq!(vocabulary.allowed(full, &sorts), [end]);
        let signature = Signature {
            operators: vec![Operator { name: "GOTO".into(), args: vec!["obj".into()] }],
        };
        let bare = Vocabulary::new(&signature, &[]);
        assert_eq!(bare.allowed(bare.start(), &[]), [], "nothing can be its argument");
    }
}
