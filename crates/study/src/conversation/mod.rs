//! The protocol *conversation*: transcripts whose lines say what was meant. Every utterance is
//! asked at its moment, and its answer is judged by what it leads to.

mod play;
mod reach;
mod table;

use std::fs;
use std::path::{Path, PathBuf};

use apprentice::learning::{TrainError, train};
use apprentice::parallel::in_order;
use apprentice::world::household::Household;
use serde::Serialize;

use super::figures::share;
use super::report::Setting;
use super::transcript::{FILE_BYTES_MAX, SyntaxError, Transcript};

/// What the protocol found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConversationReport {
    pub protocol: &'static str,
    pub recipe: String,
    /// The first digits of the recipe's digest.
    pub recipe_digest: String,
    /// Another training seed than the recipe's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Trainings after lessons that failed; the mind before them went on.
    pub trainings_failed: usize,
    pub total: Counts,
    pub shares: Shares,
    pub transcripts: Vec<OfTranscript>,
    /// The answers that were not right, transcript by transcript.
    #[serde(skip)]
    pub cases: Vec<Case>,
}

/// What one transcript gave.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OfTranscript {
    /// The file's name.
    pub name: String,
    #[serde(flatten)]
    pub counts: Counts,
}

/// What became of some utterances.
///
/// `utterances` = `asked` + `spared`; `asked` = `right` + `something_else` + `misread` +
/// `impossible` + `not_sure` + `rightly_left` + `wrongly_acted`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Counts {
    pub utterances: usize,
    pub asked: usize,
    /// Not asked: an answer that was ahead had done it already.
    pub spared: usize,
    pub right: usize,
    /// Of the right ones, those that did what the next utterances asked for, too.
    pub ahead: usize,
    pub something_else: usize,
    pub misread: usize,
    pub impossible: usize,
    pub not_sure: usize,
    /// Asked for nothing, and nothing was carried out.
    pub rightly_left: usize,
    pub wrongly_acted: usize,
}

/// Counts as shares of all that was asked, and of the requests among it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Shares {
    /// Something was carried out that was not meant, after a request or without one.
    pub something_else: f64,
    pub misread: f64,
    /// Right, or rightly left.
    pub as_meant: f64,
    pub requests: usize,
    /// The same of the utterances that asked for something.
    pub requests_something_else: f64,
    pub requests_misread: f64,
    pub requests_as_meant: f64,
}

/// What became of one utterance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Class {
    /// It led where it was meant to lead.
    Right,
    /// Right, and so many steps of the following utterances were carried out as well.
    Ahead(usize),
    /// Something was carried out that leads elsewhere.
    SomethingElse,
    /// Nothing was carried out, for a reason that is about another request.
    Misread,
    /// The meant program, which the world was said to forbid.
    Impossible,
    NotSure,
    /// It asked for nothing, and nothing was carried out.
    RightlyLeft,
    /// It asked for nothing, and something was carried out.
    WronglyActed,
}

/// An answer that was not right.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    pub class: Class,
    /// The file's name.
    pub file: String,
    /// The utterance's line, counted from 1.
    pub line: usize,
    pub utterance: String,
    pub meant: String,
    pub answered: String,
}

/// Why a directory of transcripts cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum ConversationError {
    #[error("{} cannot be read: {error}", path.display())]
    Read { path: PathBuf, error: std::io::Error },
    #[error("{} has no transcript; transcripts are files whose names end in .txt", path.display())]
    Empty { path: PathBuf },
    #[error("{} has {bytes} bytes; the limit is {FILE_BYTES_MAX}", path.display())]
    TooLarge { path: PathBuf, bytes: u64 },
    #[error("{}: {error}", path.display())]
    Syntax { path: PathBuf, error: SyntaxError },
    /// What the transcript says cannot be.
    #[error("{}: line {line}: {reason}", path.display())]
    Line { path: PathBuf, line: usize, reason: String },
    /// Nothing was taught yet; the files are innocent.
    #[error(transparent)]
    Training(#[from] TrainError),
}

/// A transcript and where it is.
struct Written {
    path: PathBuf,
    transcript: Transcript,
}

/// What playing one transcript gave.
struct Played {
    of: OfTranscript,
    trainings_failed: usize,
    cases: Vec<Case>,
}

/// Runs the protocol on the transcripts (`*.txt`) of a directory, in the order of their names. Each
/// is a new person's.
///
/// - `setting`: of the recipe, its first seed (the recipe's own without one), the threads, the
///   progress and `cases`; the rest is for protocols with a corpus.
/// - errors: a file that cannot be read or has an error, and a training without lessons that fails.
pub fn conversation(
    setting: &Setting<'_>,
    directory: &Path,
) -> Result<ConversationReport, ConversationError> {
    let written = read_all(directory)?;
    let household = Household::new();
    let seed = setting.seeds.first().copied();
    let recipe = seed.map_or_else(|| setting.recipe.clone(), |seed| setting.recipe.reseeded(seed));
    let before = train(&household, &recipe, &[])?;
    let play = |written: &Written| play::play(&household, &recipe, &before, written);
    let played = in_order(setting.threads, setting.progress, &written, play);
    let played = played.into_iter().collect::<Result<Vec<Played>, ConversationError>>()?;

    let mut total = Counts::default();
    played.iter().for_each(|played| total.add(&played.of.counts));
    let mut cases = Vec::new();
    for case in played.iter().flat_map(|played| &played.cases) {
        let alike = |other: &&Case| other.class == case.class;
        if cases.iter().filter(alike).count() < setting.cases {
            cases.push(case.clone());
        }
    }
    Ok(ConversationReport {
        protocol: "conversation",
        recipe: setting.recipe.name().to_owned(),
        recipe_digest: setting.recipe.digest().short(),
        seed,
        trainings_failed: played.iter().map(|played| played.trainings_failed).sum(),
        total,
        shares: Shares::of(&total),
        transcripts: played.into_iter().map(|played| played.of).collect(),
        cases,
    })
}

fn read_all(directory: &Path) -> Result<Vec<Written>, ConversationError> {
    let unreadable = |path: &Path, error| ConversationError::Read { path: path.to_owned(), error };
    let paths = fs::read_dir(directory).and_then(|entries| {
        entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<Vec<_>, _>>()
    });
    let paths = paths.map_err(|error| unreadable(directory, error))?;
    let is_transcript = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "txt");
    let mut paths: Vec<PathBuf> = paths.into_iter().filter(is_transcript).collect();
    if paths.is_empty() {
        return Err(ConversationError::Empty { path: directory.to_owned() });
    }
    paths.sort();
    let read = |path: PathBuf| {
        let bytes = fs::metadata(&path).map_err(|error| unreadable(&path, error))?.len();
        if bytes > FILE_BYTES_MAX {
            return Err(ConversationError::TooLarge { path, bytes });
        }
        let text = fs::read_to_string(&path).map_err(|error| unreadable(&path, error))?;
        match Transcript::parse(&text) {
            Ok(transcript) => Ok(Written { path, transcript }),
            Err(error) => Err(ConversationError::Syntax { path, error }),
        }
    };
    paths.into_iter().map(read).collect()
}

impl Counts {
    fn count(&mut self, class: Class) {
        self.utterances += 1;
        self.asked += 1;
        match class {
            Class::Right => self.right += 1,
            Class::Ahead(_) => {
                self.right += 1;
                self.ahead += 1;
            }
            Class::SomethingElse => self.something_else += 1,
            Class::Misread => self.misread += 1,
            Class::Impossible => self.impossible += 1,
            Class::NotSure => self.not_sure += 1,
            Class::RightlyLeft => self.rightly_left += 1,
            Class::WronglyActed => self.wrongly_acted += 1,
        }
    }

    fn spare(&mut self) {
        self.utterances += 1;
        self.spared += 1;
    }

    fn add(&mut self, other: &Counts) {
        self.utterances += other.utterances;
        self.asked += other.asked;
        self.spared += other.spared;
        self.right += other.right;
        self.ahead += other.ahead;
        self.something_else += other.something_else;
        self.misread += other.misread;
        self.impossible += other.impossible;
        self.not_sure += other.not_sure;
        self.rightly_left += other.rightly_left;
        self.wrongly_acted += other.wrongly_acted;
    }
}

impl Shares {
    pub fn of(counts: &Counts) -> Shares {
        let Counts { asked, right, something_else, misread, .. } = *counts;
        let Counts { rightly_left, wrongly_acted, .. } = *counts;
        let requests = asked - rightly_left - wrongly_acted;
        Shares {
            something_else: share(something_else + wrongly_acted, asked),
            misread: share(misread, asked),
            as_meant: share(right + rightly_left, asked),
            requests,
            requests_something_else: share(something_else, requests),
            requests_misread: share(misread, requests),
            requests_as_meant: share(right, requests),
        }
    }
}

impl Class {
    fn is_right(self) -> bool {
        matches!(self, Class::Right | Class::Ahead(_) | Class::RightlyLeft)
    }
}
