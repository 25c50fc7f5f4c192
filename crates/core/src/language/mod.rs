//! What people say, what programs are, and what came of an utterance. Nothing here depends on a
//! world.

mod answer;
mod clause;
mod document;
mod grammar;
mod habits;
mod lifted;
mod lists;
mod program;
mod report;
mod signature;
mod symbol;
mod utterance;

pub use answer::{
    Accounted, Answer, AnswerOption, Answerer, Discarded, Evidence, Mood, Near, Outcome, Question,
    Use,
};
pub use clause::Clause;
pub use document::Document;
pub use grammar::{Grammar, Verb};
pub use habits::{Habits, Roles};
pub use lifted::{Exemplar, LiftedArg, LiftedProgram, LiftedStep, LiftedUtterance, Mention, Word};
pub use lists::WordLists;
pub use program::{Program, ProgramError, Step};
pub use report::Report;
pub use signature::{Operator, Signature};
pub use symbol::Symbol;
pub use utterance::{Utterance, UtteranceError, is_mark, tokens};
