use std::fmt;

use apprentice::client::OnClash;
use apprentice::language::{Program, Step, Symbol};

/// A transcript: its lines in order, every one of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Transcript {
    pub lines: Vec<Line>,
}

/// One line, as written and as understood.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Counted from 1.
    pub number: usize,
    pub text: String,
    pub kind: Kind,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    /// A blank line or a comment.
    Remark,
    Setting(Setting),
    Act(Act),
    Answer(Answer),
    /// What the utterance above asked for; none when it asked for nothing. Who plays the transcript
    /// passes it over.
    Meant(Option<Request>),
}

/// What an utterance asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    pub program: Program,
    /// Names of things ([`apprentice::world::Thing::name`]), at most one of each type of the program:
    /// wherever a step names its type, this one was meant.
    pub on: Vec<String>,
}

/// What holds for the lines below it.
#[derive(Debug, Clone, PartialEq)]
pub enum Setting {
    User(String),
    Recipe(String),
    /// A file beside the transcript.
    Scene(String),
    Task(String),
    Seed(u64),
}

/// What the person does.
#[derive(Debug, Clone, PartialEq)]
pub enum Act {
    /// Starts an episode; the goal in words is what the service answers.
    Episode {
        goal: Option<String>,
    },
    Say(String),
    Done,
    Teach {
        utterance: String,
        /// First and last action, both included; none for `nothing`.
        actions: Option<(u32, u32)>,
        on_clash: OnClash,
    },
    /// Marks the last act as wrong.
    Wrong,
    /// Ends teaching and waits for the new mind; the number of examples is the answer.
    Learn {
        examples: Option<u32>,
    },
    /// Takes the last live lesson of this utterance back.
    Forget(String),
}

/// What came of an act, on a line of its own.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    Understood(Program),
    NotSure,
    /// It asked; the options that it offered.
    Asked(Vec<String>),
    /// It answered a question, or said something. What it said is not compared.
    Told,
    /// The last act is marked as wrong.
    Marked,
    /// The program and the failing step, counted from 1; none matches any.
    Impossible(Option<(Program, u32)>),
    /// The code of a rejection, as it stands on the wire.
    Refused(String),
    Achieved,
}

impl Transcript {
    /// The value of the first such header, if any.
    pub fn user(&self) -> Option<&str> {
        self.settings().find_map(|setting| match setting {
            Setting::User(name) => Some(name.as_str()),
            _ => None,
        })
    }

    /// The recipe it was written for.
    pub fn recipe(&self) -> Option<&str> {
        self.settings().find_map(|setting| match setting {
            Setting::Recipe(name) => Some(name.as_str()),
            _ => None,
        })
    }

    fn settings(&self) -> impl Iterator<Item = &Setting> {
        self.lines.iter().filter_map(|line| match &line.kind {
            Kind::Setting(setting) => Some(setting),
            _ => None,
        })
    }
}

impl Request {
    /// The type of a thing by its name: `Mug` of `Mug 2`.
    pub fn kind(name: &str) -> &str {
        match name.rsplit_once(' ') {
            Some((kind, number)) if number.bytes().all(|byte| byte.is_ascii_digit()) => kind,
            _ => name,
        }
    }

    /// The things that the arguments of a step were meant to be; none where any will do.
    pub fn chosen(&self, step: &Step) -> Vec<Option<String>> {
        let named =
            |kind: &Symbol| self.on.iter().find(|name| *kind == *Request::kind(name)).cloned();
        step.args.iter().map(named).collect()
    }
}

impl fmt::Display for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.program)?;
        match self.on.is_empty() {
            true => Ok(()),
            false => write!(f, " on {}", self.on.join(", ")),
        }
    }
}

impl Answer {
    /// Whether `real` is what this line expects. A bare `! impossible` expects any.
    pub fn expects(&self, real: &Answer) -> bool {
        match (self, real) {
            (Answer::Impossible(None), Answer::Impossible(_)) => true,
            _ => self == real,
        }
    }
}
