use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::program::{join, parse_steps, text_form};
use super::{Program, ProgramError, Step, Symbol};

/// One word of a lifted utterance: a plain word, or the place of a mention.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Word {
    /// A plain word, lower-case.
    Text(String),
    /// A mention: the `n`-th slot of an utterance is its `n`-th mention.
    Slot {
        /// The sort of what is mentioned.
        sort: Symbol,
        /// The word for a fixture ("sink", "fridge"), where the recipe keeps it.
        fixture: Option<String>,
    },
}

/// An utterance with its objects abstracted away: `wash the <obj>`.
///
/// Slots are numbered by mention, from 1, in the order of the words, so the printed `<obj>` needs
/// no number.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct LiftedUtterance {
    /// In the order of the utterance.
    pub words: Vec<Word>,
}

impl LiftedUtterance {
    /// How many mentions it has.
    pub fn slots(&self) -> usize {
        self.words.iter().filter(|word| matches!(word, Word::Slot { .. })).count()
    }

    /// Reads the form that [`fmt::Display`] prints; every `<name>` is a slot of that sort and
    /// `<name=word>` one with its fixture's word.
    pub fn parse(text: &str) -> LiftedUtterance {
        let read = |word: &str| match word.strip_prefix('<').and_then(|w| w.strip_suffix('>')) {
            Some(slot) => {
                let (sort, fixture) = match slot.split_once('=') {
                    Some((sort, fixture)) => (sort, Some(fixture.to_owned())),
                    None => (slot, None),
                };
                Word::Slot { sort: Symbol::new(sort), fixture }
            }
            None => Word::Text(word.to_owned()),
        };
        LiftedUtterance { words: text.split_whitespace().map(read).collect() }
    }
}

impl fmt::Display for Word {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Word::Text(text) => f.write_str(text),
            Word::Slot { sort, fixture: None } => write!(f, "<{sort}>"),
            Word::Slot { sort, fixture: Some(fixture) } => write!(f, "<{sort}={fixture}>"),
        }
    }
}

impl fmt::Display for LiftedUtterance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, word) in self.words.iter().enumerate() {
            let gap = if index > 0 { " " } else { "" };
            write!(f, "{gap}{word}")?;
        }
        Ok(())
    }
}

impl Serialize for LiftedUtterance {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for LiftedUtterance {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(LiftedUtterance::parse(&String::deserialize(deserializer)?))
    }
}

/// Words of an utterance that name a thing: "the coffee mug", "it".
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mention {
    /// The name as said, lower-cased, without what surrounds it: `coffee mug`.
    pub surface: String,
    /// The sort of its types; of a pronoun, the usual sort.
    pub sort: Symbol,
    /// The types this name may mean, likeliest first; empty for a pronoun.
    pub types: Vec<Symbol>,
    /// Whether it is a pronoun: "it".
    pub pronoun: bool,
    /// Whether it is a plural: "the mugs".
    pub plural: bool,
}

/// An argument of a lifted step.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LiftedArg {
    /// What a mention of the utterance means.
    Slot {
        /// The sort of the mention.
        sort: Symbol,
        /// Which mention; from 1.
        number: u8,
    },
    /// What the robot holds when the program starts.
    Held,
    /// A type that the utterance did not mention: "wash the mug" keeps its `SinkBasin`.
    Constant(Symbol),
}

/// A step with slots: `PUT <obj:1> <obj:2>`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct LiftedStep {
    /// The primitive.
    pub operator: Symbol,
    /// In the order of the operator's signature.
    pub args: Vec<LiftedArg>,
}

/// A program with slots for what the utterance mentions: `GOTO <obj:2>; PUT <obj:1> <obj:2>`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct LiftedProgram {
    /// In the order in which they run.
    pub steps: Vec<LiftedStep>,
}

impl LiftedProgram {
    /// The highest slot number used; 0 when there is none.
    pub fn slots(&self) -> usize {
        let args = self.steps.iter().flat_map(|step| &step.args);
        let number = |arg: &LiftedArg| match arg {
            LiftedArg::Slot { number, .. } => *number as usize,
            _ => 0,
        };
        args.map(number).max().unwrap_or(0)
    }

    /// The program with each slot filled by its mention, and `<held>` by what the robot holds.
    ///
    /// - `mentioned`: the type that each mention means, in order.
    /// - returns: none when a slot has no mention, or the program has `<held>` and the hand is
    ///   empty.
    pub fn fill(&self, mentioned: &[Symbol], held: Option<&Symbol>) -> Option<Program> {
        let fill_arg = |arg: &LiftedArg| match arg {
            LiftedArg::Slot { number, .. } => mentioned.get(*number as usize - 1).cloned(),
            LiftedArg::Held => held.cloned(),
            LiftedArg::Constant(symbol) => Some(symbol.clone()),
        };
        let fill_step = |step: &LiftedStep| {
            let args = step.args.iter().map(fill_arg).collect::<Option<Vec<_>>>()?;
            Some(Step { operator: step.operator.clone(), args })
        };
        Some(Program { steps: self.steps.iter().map(fill_step).collect::<Option<Vec<_>>>()? })
    }

    /// The same program with slots renumbered by first use. Two lifted programs are *the same*
    /// when their canonical forms are equal (ADR 14: slots are numbered by mention).
    pub fn canonical(&self) -> LiftedProgram {
        let mut order: Vec<u8> = Vec::new();
        let mut renumber = |arg: &LiftedArg| match arg {
            LiftedArg::Slot { sort, number } => {
                let place = order.iter().position(|n| n == number).unwrap_or_else(|| {
                    order.push(*number);
                    order.len() - 1
                });
                LiftedArg::Slot { sort: sort.clone(), number: place as u8 + 1 }
            }
            other => other.clone(),
        };
        let steps = self.steps.iter().map(|step| LiftedStep {
            operator: step.operator.clone(),
            args: step.args.iter().map(&mut renumber).collect(),
        });
        LiftedProgram { steps: steps.collect() }
    }
}

/// A lifted utterance and the lifted program it stands for: what the parser compares with.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Exemplar {
    /// The words.
    pub utterance: LiftedUtterance,
    /// What they mean.
    pub program: LiftedProgram,
}

impl FromStr for LiftedArg {
    type Err = ProgramError;
    fn from_str(text: &str) -> Result<LiftedArg, ProgramError> {
        let bad = || ProgramError::BadArgument { found: text.to_owned() };
        let Some(inner) = text.strip_prefix('<') else {
            return Ok(LiftedArg::Constant(Symbol::new(text)));
        };
        let inner = inner.strip_suffix('>').ok_or_else(bad)?;
        if inner == "held" {
            return Ok(LiftedArg::Held);
        }
        let (sort, number) = inner.split_once(':').ok_or_else(bad)?;
        match number.parse() {
            Ok(number) if number >= 1 => Ok(LiftedArg::Slot { sort: Symbol::new(sort), number }),
            _ => Err(bad()),
        }
    }
}

impl FromStr for LiftedStep {
    type Err = ProgramError;
    fn from_str(text: &str) -> Result<LiftedStep, ProgramError> {
        let mut words = text.split_whitespace();
        let operator = words.next().ok_or(ProgramError::EmptyStep { step: 1 })?;
        let args = words.map(str::parse).collect::<Result<_, _>>()?;
        Ok(LiftedStep { operator: Symbol::new(operator), args })
    }
}

impl FromStr for LiftedProgram {
    type Err = ProgramError;
    fn from_str(text: &str) -> Result<LiftedProgram, ProgramError> {
        Ok(LiftedProgram { steps: parse_steps(text)? })
    }
}

impl fmt::Display for LiftedArg {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LiftedArg::Slot { sort, number } => write!(f, "<{sort}:{number}>"),
            LiftedArg::Held => f.write_str("<held>"),
            LiftedArg::Constant(symbol) => write!(f, "{symbol}"),
        }
    }
}

impl fmt::Display for LiftedStep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.operator)?;
        self.args.iter().try_for_each(|arg| write!(f, " {arg}"))
    }
}

impl fmt::Display for LiftedProgram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        join(f, &self.steps)
    }
}

text_form!(LiftedStep, LiftedProgram);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lifted_program_is_filled_by_mention() {
        let lifted: LiftedProgram =
            "GOTO <obj:2>; PUT <obj:1> <obj:2>; OPEN Fridge; PUT <held> Fridge".parse().unwrap();
        let mentioned = [Symbol::new("Mug"), Symbol::new("DiningTable")];
        let held = Symbol::new("Pan");
        assert_eq!(
            lifted.fill(&mentioned, Some(&held)).unwrap().to_string(),
            "GOTO DiningTable; PUT Mug DiningTable; OPEN Fridge; PUT Pan Fridge"
        );
        assert_eq!(lifted.fill(&mentioned[..1], Some(&held)), None);
        assert_eq!(lifted.fill(&mentioned, None), None);
    }

    #[test]
    fn programs_that_differ_in_numbering_are_the_same() {
        let one: LiftedProgram = "GOTO <obj:2>; PUT <obj:1> <obj:2>".parse().unwrap();
        let two: LiftedProgram = "GOTO <obj:1>; PUT <obj:2> <obj:1>".parse().unwrap();
        assert_ne!(one, two);
        assert_eq!(one.canonical(), two.canonical());
    }

    #[test]
    fn a_lifted_utterance_is_read_back() {
        let text = "put the <obj> in the <obj=sink> please";
        let lifted = LiftedUtterance::parse(text);
        assert_eq!(lifted.slots(), 2);
        assert_eq!(lifted.to_string(), text);
        assert!("PUT <obj:0>".parse::<LiftedProgram>().is_err());
    }
}
