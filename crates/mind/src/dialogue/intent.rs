use super::Dialogue;
use super::questions;
use super::replies;
use crate::language::{AnswerOption, Mention, Question, Utterance, WordLists, is_mark};
use crate::world::{Lexicon, Words};

/// What a person wants with an utterance.
#[derive(Debug, Clone, PartialEq)]
pub enum Intent {
    /// It chooses this from the open question.
    Chose(AnswerOption),
    /// It refuses everything that the open question offers.
    Refused,
    /// It says that the last act was wrong.
    Wrong,
    /// It answers, and nothing was asked.
    NothingAsked,
    /// It is a question of the person.
    Question(About),
    /// Anything else: perhaps a request.
    Request,
}

/// What a person asks about.
#[derive(Debug, Clone, PartialEq)]
pub enum About {
    /// Where a thing is.
    Place(Named),
    /// What is in or on a thing.
    Contents(Named),
    /// Whether a thing is as a word says: "open".
    State(Named, String),
    /// Whether a thing is in or on another one.
    Within(Named, Named),
    /// Whether there is such a thing.
    Presence(Named),
    /// How many of them there are.
    Count(Named),
    /// Where the robot stands.
    Robot,
    /// What the robot holds, or whether it holds this.
    Hand(Option<Named>),
    /// What is in sight.
    Sight,
    /// What the task is.
    Goal,
    /// What the robot can do.
    Abilities,
    /// What it was taught.
    Lessons,
    /// Why it did the last act.
    Reason,
}

/// A thing in a question: a name that is known, or the word in the place of a name.
#[derive(Debug, Clone, PartialEq)]
pub enum Named {
    Known(Mention),
    Unknown(String),
}

impl Dialogue {
    /// Reads an utterance against what is open.
    ///
    /// - `lexicon`, `lists`: of the recipe. Without lists no question is read.
    /// - `open`: the question that was asked right before it.
    pub fn read<D: Words>(
        &self,
        domain: &D,
        lexicon: &Lexicon,
        lists: Option<&WordLists>,
        said: &Utterance,
        open: Option<&Question>,
    ) -> Intent {
        let tokens = said.tokens();
        let words: Vec<&str> =
            tokens.iter().map(String::as_str).filter(|token| !is_mark(token)).collect();
        let text = words.join(" ");
        let accepts = self.yes.contains(&text);
        let refuses = self.no.contains(&text);
        if let Some(question) = open {
            if refuses {
                return Intent::Refused;
            }
            if let Some(place) = replies::chosen(question, &words, accepts) {
                return Intent::Chose(question.options[place].clone());
            }
        }
        if self.wrong.contains(&text) {
            return Intent::Wrong;
        }
        if accepts {
            return Intent::NothingAsked;
        }
        let lists = lists.filter(|_| self.questions);
        match lists.and_then(|lists| questions::about(domain, lexicon, lists, &words)) {
            Some(about) => Intent::Question(about),
            None => Intent::Request,
        }
    }
}
