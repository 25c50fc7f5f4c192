use crate::language::Program;
use crate::session::OnClash;

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

impl Answer {
    /// Whether `real` is what this line expects. A bare `! impossible` expects any.
    pub fn expects(&self, real: &Answer) -> bool {
        match (self, real) {
            (Answer::Impossible(None), Answer::Impossible(_)) => true,
            _ => self == real,
        }
    }
}
