//! The four tables of a study's directory, written and read back.

use std::fs;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::rows::{EpisodeRow, UtteranceRow};
use super::summary::{AnsweredRow, SummaryRow};
use crate::cells;

const UTTERANCES: &str = "utterances.csv";
const EPISODES: &str = "episodes.csv";
const SUMMARY: &str = "summary.csv";
const ANSWERED: &str = "answered.csv";

/// Everything a study measured; `docs/study.md` describes the columns.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tables {
    pub utterances: Vec<UtteranceRow>,
    pub episodes: Vec<EpisodeRow>,
    pub summary: Vec<SummaryRow>,
    pub answered: Vec<AnsweredRow>,
}

/// What is wrong with a table, and where.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TablesError {
    #[error(
        "the table {file} cannot be read: {reason}; is this the directory of a finished study?"
    )]
    File { file: &'static str, reason: String },
    #[error("{file}, line {line}: {reason}")]
    Line { file: &'static str, line: u64, reason: String },
}

impl Tables {
    /// Reads the tables of a directory.
    ///
    /// - errors: the first thing that is wrong, with file and line.
    pub fn read(directory: &Path) -> Result<Tables, TablesError> {
        Ok(Tables {
            utterances: rows(directory, UTTERANCES)?,
            episodes: rows(directory, EPISODES)?,
            summary: rows(directory, SUMMARY)?,
            answered: rows(directory, ANSWERED)?,
        })
    }

    /// The files and their texts.
    pub fn written(&self) -> [(&'static str, String); 4] {
        [
            (UTTERANCES, cells::written(&self.utterances)),
            (EPISODES, cells::written(&self.episodes)),
            (SUMMARY, cells::written(&self.summary)),
            (ANSWERED, cells::written(&self.answered)),
        ]
    }
}

fn rows<R>(directory: &Path, file: &'static str) -> Result<Vec<R>, TablesError>
where
    R: Serialize + DeserializeOwned + Default,
{
    let text = fs::read_to_string(directory.join(file))
        .map_err(|error| TablesError::File { file, reason: error.to_string() })?;
    cells::read(&text).map_err(|(line, reason)| TablesError::Line { file, line, reason })
}
