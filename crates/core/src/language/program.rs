use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::Symbol;
use crate::limits::PROGRAM_STEPS_MAX;

/// One primitive with its arguments, which name object *types*: `PUT Tomato Fridge`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Step {
    /// The primitive.
    pub operator: Symbol,
    /// Object types, in the order of the operator's signature.
    pub args: Vec<Symbol>,
}

/// A flat sequence of primitives: `GOTO Apple; PICKUP Apple`. Stored and printed as that text.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Program {
    /// In the order in which they run.
    pub steps: Vec<Step>,
}

/// Why a text is not a program.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ProgramError {
    /// The text has no step.
    #[error("the program is empty")]
    Empty,
    /// There is nothing between two semicolons.
    #[error("step {step} of the program is empty")]
    EmptyStep {
        /// Counted from 1.
        step: usize,
    },
    /// There are more than [`PROGRAM_STEPS_MAX`] steps.
    #[error("the program has {found} steps; at most {PROGRAM_STEPS_MAX} are allowed")]
    TooLong {
        /// Steps found.
        found: usize,
    },
    /// An argument of a lifted step is neither a name nor a slot.
    #[error("{found:?} is not a name or a slot such as <obj:1>")]
    BadArgument {
        /// The argument.
        found: String,
    },
}

impl FromStr for Step {
    type Err = ProgramError;
    fn from_str(text: &str) -> Result<Step, ProgramError> {
        let mut words = text.split_whitespace().map(Symbol::new);
        let operator = words.next().ok_or(ProgramError::EmptyStep { step: 1 })?;
        Ok(Step { operator, args: words.collect() })
    }
}

impl FromStr for Program {
    type Err = ProgramError;
    fn from_str(text: &str) -> Result<Program, ProgramError> {
        let steps = parse_steps(text)?;
        Ok(Program { steps })
    }
}

/// Splits at `;` and reads each part, for programs and lifted programs.
pub(super) fn parse_steps<S: FromStr<Err = ProgramError>>(
    text: &str,
) -> Result<Vec<S>, ProgramError> {
    if text.trim().is_empty() {
        return Err(ProgramError::Empty);
    }
    let parts: Vec<&str> = text.trim().trim_end_matches(';').split(';').collect();
    if parts.len() > PROGRAM_STEPS_MAX {
        return Err(ProgramError::TooLong { found: parts.len() });
    }
    let numbered = parts.iter().enumerate();
    numbered
        .map(|(index, part)| {
            part.parse().map_err(|error| match error {
                ProgramError::EmptyStep { .. } => ProgramError::EmptyStep { step: index + 1 },
                other => other,
            })
        })
        .collect()
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.operator)?;
        self.args.iter().try_for_each(|arg| write!(f, " {arg}"))
    }
}

impl fmt::Display for Program {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        join(f, &self.steps)
    }
}

pub(super) fn join<S: fmt::Display>(f: &mut fmt::Formatter<'_>, steps: &[S]) -> fmt::Result {
    for (index, step) in steps.iter().enumerate() {
        if index > 0 {
            f.write_str("; ")?;
        }
        write!(f, "{step}")?;
    }
    Ok(())
}

macro_rules! text_form {
    ($($name:ty),*) => {$(
        impl TryFrom<String> for $name {
            type Error = ProgramError;
            fn try_from(text: String) -> Result<Self, ProgramError> {
                text.parse()
            }
        }
        impl From<$name> for String {
            fn from(value: $name) -> String {
                value.to_string()
            }
        }
    )*};
}
pub(super) use text_form;
text_form!(Step, Program);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_reads_and_prints_as_the_paper_writes_it() {
        let text = "GOTO Apple; PICKUP Apple; PUT Apple Fridge";
        let program: Program = text.parse().unwrap();
        assert_eq!(program.steps.len(), 3);
        assert_eq!(program.to_string(), text);
    }

    #[test]
    fn a_broken_program_says_where() {
        let error = "GOTO Apple; ; PICKUP Apple".parse::<Program>().unwrap_err();
        assert_eq!(error, ProgramError::EmptyStep { step: 2 });
        assert_eq!("".parse::<Program>().unwrap_err(), ProgramError::Empty);
        let long = "GOTO A;".repeat(PROGRAM_STEPS_MAX + 1);
        assert!(matches!(long.parse::<Program>(), Err(ProgramError::TooLong { .. })));
    }
}
