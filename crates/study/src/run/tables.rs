//! The tables of a study that has ended, from the logs that its services kept and the journals.

use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

use apprentice::events::Record;
use apprentice::ids::{IdError, Seq, TenantId, UserId};
use apprentice::store::{self, KeyError, OpenError, ReadError, Store};
use apprentice::world::household::Household;

use super::design::{Design, data_dir};
use super::driver::write_whole;
use super::journal::Journal;
use super::people::Participant;
use crate::measures::{Entry, Life, LifeError, Tables, UtteranceRow, answered, rows_of, summary};

/// Recorded people with fewer episodes are reported apart.
const EPISODES_ENOUGH: usize = 5;

/// Why there are no tables.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    #[error(transparent)]
    Open(#[from] OpenError),
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error(transparent)]
    Keys(#[from] KeyError),
    #[error(transparent)]
    User(#[from] IdError),
    #[error("the journals cannot be read: {0}")]
    Journal(io::Error),
    #[error(transparent)]
    Life(#[from] LifeError),
    #[error("{} cannot be written: {error}", path.display())]
    Write { path: PathBuf, error: io::Error },
}

/// Measures what was recorded, and writes the four tables, each whole or not at all.
pub fn make_tables(
    out: &Path,
    design: &Design,
    household: &Household,
    people: &[Participant],
) -> Result<Tables, MeasureError> {
    let tables = measure(out, design, household, people)?;
    for (name, text) in tables.written() {
        let path = out.join(name);
        write_whole(&path, &text).map_err(|error| MeasureError::Write { path, error })?;
    }
    Ok(tables)
}

/// What private copies of the data directories and the journals tell.
fn measure(
    out: &Path,
    design: &Design,
    household: &Household,
    people: &[Participant],
) -> Result<Tables, MeasureError> {
    let (mut utterances, mut episodes) = (Vec::new(), Vec::new());
    for condition in &design.conditions {
        let copy = store::copy_private(&data_dir(out, &condition.name))?;
        let store = copy.open()?;
        for person in people {
            let journal = Journal::open(out, &condition.name, person.number)
                .map_err(MeasureError::Journal)?;
            let entries: Vec<Entry> =
                journal.lines().iter().map(|line| line.entry.clone()).collect();
            let records = records_of(&store, &person.user)?;
            let life = Life {
                condition: &condition.name,
                user: &person.user,
                records: &records,
                journal: &entries,
            };
            let (said, lived) = rows_of(household, &life)?;
            utterances.extend(said);
            episodes.extend(lived);
        }
    }
    let recorded = !design.who.simulated();
    let few: BTreeSet<&str> = people
        .iter()
        .filter(|person| recorded && person.episodes.len() < EPISODES_ENOUGH)
        .map(|person| person.user.as_str())
        .collect();
    utterances.sort_by(|a, b| {
        let key = |row: &UtteranceRow| (row.episode, row.turn);
        (&a.condition, &a.task_type, &a.user, key(a)).cmp(&(
            &b.condition,
            &b.task_type,
            &b.user,
            key(b),
        ))
    });
    episodes.sort_by(|a, b| {
        (&a.condition, &a.task_type, &a.user, a.episode).cmp(&(
            &b.condition,
            &b.task_type,
            &b.user,
            b.episode,
        ))
    });
    Ok(Tables {
        summary: summary(&episodes, |row| few.contains(row.user.as_str())),
        answered: answered(&utterances),
        utterances,
        episodes,
    })
}

fn records_of(store: &Store, user: &str) -> Result<Vec<Record>, MeasureError> {
    let stream = store.keys.stream_id(&TenantId::local(), &UserId::new(user)?)?;
    let records = store.log.read(&stream, Seq::FIRST)?.collect::<Result<_, _>>()?;
    Ok(records)
}
