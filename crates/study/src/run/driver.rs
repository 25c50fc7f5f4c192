//! Runs a study: for each condition a service with real sockets, and everybody at it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use apprentice::client::Client;
use apprentice::ids::UserId;
use apprentice::parallel::{Progress, in_order};
use apprentice::service::{Config, Data, Service, StartError};
use apprentice::store::OpenError;
use apprentice::world::household::Household;

use super::design::{Condition, Design, STUDY_FILE, data_dir, difference};
use super::journal::{Journal, Line};
use super::people::{Participant, Planned};
use crate::measures::Entry;
use crate::participant::{
    Person, RecordedEpisode, SimulatedEpisode, TalkError, Turn, Wire, speak, teach,
};

/// How long a killed study's last helper may hold its directory.
const LET_GO: Duration = Duration::from_secs(10);
/// How long a client waits before it is looked whether the service lives.
const PATIENCE: Duration = Duration::from_secs(10);
const LOOK_AGAIN: Duration = Duration::from_millis(100);

/// A study to run.
pub struct Run<'a> {
    pub out: &'a Path,
    pub design: &'a Design,
    pub household: Arc<Household>,
    pub people: &'a [Participant],
    /// People at once.
    pub workers: usize,
    pub progress: &'a dyn Progress,
}

/// What was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Finished {
    pub episodes: usize,
    /// Of them, those that an earlier run had finished.
    pub before: usize,
}

/// Why a study did not come to its end.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    #[error("{} cannot be used for a study: {error}", path.display())]
    Out { path: PathBuf, error: io::Error },
    #[error("{} holds other files and no {STUDY_FILE}; name a new directory", path.display())]
    NotOurs { path: PathBuf },
    #[error("{} holds another study: {difference}; name a new directory or run it with its own settings", path.display())]
    Different { path: PathBuf, difference: String },
    #[error("the service of condition {condition} did not start: {error}; {state}")]
    Start { condition: String, error: Box<StartError>, state: State },
    #[error("{what} in condition {condition}: {reason}; {state}")]
    Stopped { condition: String, what: String, reason: String, state: State },
}

/// How far a study is when it stops, and how it goes on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct State {
    pub finished: usize,
    pub all: usize,
    pub out: PathBuf,
}

impl std::fmt::Display for State {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} of {} episodes are finished and kept (one line for each in {}); run the same \
             command again to go on",
            self.finished,
            self.all,
            self.out.join("journal").display()
        )
    }
}

impl Run<'_> {
    /// Runs what is not finished yet.
    pub fn go(&self) -> Result<Finished, RunError> {
        self.prepare()?;
        let each: usize = self.people.iter().map(|person| person.episodes.len()).sum();
        self.progress.expect((each * self.design.conditions.len()) as u64);
        let done = AtomicUsize::new(0);
        let mut before = 0;
        for condition in &self.design.conditions {
            before += self.condition(condition, &done)?;
        }
        Ok(Finished { episodes: done.load(Ordering::Relaxed), before })
    }

    /// Makes the directory, or sees that it holds this very study.
    fn prepare(&self) -> Result<(), RunError> {
        let out = |error| RunError::Out { path: self.out.to_owned(), error };
        fs::create_dir_all(self.out).map_err(out)?;
        let file = self.out.join(STUDY_FILE);
        let text = self.design.text();
        match fs::read_to_string(&file) {
            Ok(before) => match difference(&before, &text) {
                None => Ok(()),
                Some(difference) => {
                    Err(RunError::Different { path: self.out.to_owned(), difference })
                }
            },
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                if fs::read_dir(self.out).map_err(out)?.next().is_some() {
                    return Err(RunError::NotOurs { path: self.out.to_owned() });
                }
                write_whole(&file, &text).map_err(out)
            }
            Err(error) => Err(out(error)),
        }
    }

    /// One condition.
    ///
    /// - returns: how many of its episodes an earlier run had finished.
    fn condition(&self, condition: &Condition, done: &AtomicUsize) -> Result<usize, RunError> {
        let stopped = |what: &str, reason: String| RunError::Stopped {
            condition: condition.name.clone(),
            what: what.to_owned(),
            reason,
            state: self.state(done),
        };
        let mut before = 0;
        let mut unfinished = Vec::new();
        for person in self.people {
            let journal = Journal::open(self.out, &condition.name, person.number)
                .map_err(|error| stopped("the journals cannot be read", error.to_string()))?;
            let lines = journal.lines().len().min(person.episodes.len());
            self.progress.advance(lines as u64);
            before += lines;
            if lines < person.episodes.len() {
                unfinished.push((person, journal));
            }
        }
        done.fetch_add(before, Ordering::Relaxed);
        if unfinished.is_empty() {
            return Ok(before);
        }
        let service = self.start(condition).map_err(|error| RunError::Start {
            condition: condition.name.clone(),
            error: Box::new(error),
            state: self.state(done),
        })?;
        let stop = AtomicBool::new(false);
        let people: Vec<Mutex<(&Participant, Journal)>> =
            unfinished.into_iter().map(Mutex::new).collect();
        let results = in_order(self.workers, &(), &people, |person| {
            if stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            let mut person = person.lock().expect("each person has one worker");
            let (participant, journal) = &mut *person;
            let lived = self.live(condition, &service, participant, journal, done, &stop);
            stop.fetch_or(lived.is_err(), Ordering::Relaxed);
            lived
        });
        let ended = service.stop();
        // What the service says of itself explains what its clients met.
        if let Err(reason) = ended {
            return Err(stopped("the service failed", reason));
        }
        match results.into_iter().find_map(Result::err) {
            Some((what, reason)) => Err(stopped(&what, reason)),
            None => Ok(before),
        }
    }

    fn start(&self, condition: &Condition) -> Result<Service, StartError> {
        let end = Instant::now() + LET_GO;
        loop {
            let data = Data::Directory(data_dir(self.out, &condition.name));
            let mut config = Config::new(self.household.clone(), data);
            config.recipe_text = condition.recipe_text.clone();
            config.listen = vec!["tcp://127.0.0.1:0".to_owned()];
            match Service::start(config) {
                // A helper of a study that was just killed has not let go yet.
                Err(StartError::Store(OpenError::InUse { .. })) if Instant::now() < end => {
                    thread::sleep(LOOK_AGAIN);
                }
                started => return started,
            }
        }
    }

    /// The rest of a person's episodes.
    ///
    /// - errors: what was being done, and what stood in the way.
    fn live(
        &self,
        condition: &Condition,
        service: &Service,
        participant: &Participant,
        journal: &mut Journal,
        done: &AtomicUsize,
        stop: &AtomicBool,
    ) -> Result<(), (String, String)> {
        let user = &participant.user;
        let failed = |number: usize, error: String| {
            (format!("episode {number} of {user} was cut short"), error)
        };
        let id = UserId::new(user).map_err(|error| failed(1, error.to_string()))?;
        let endpoint = service.endpoint().expect("the service listens where it was told");
        let client = Client::connect(endpoint, id).map_err(|error| failed(1, error.to_string()))?;
        let client = client.with_patience(PATIENCE);
        let wire = Wire { client: &client, alive: &|| service.failed().is_none() };
        let last = journal.lines().last().and_then(|line| line.person.clone());
        let mut person = last.unwrap_or_else(|| Person::new(&self.design.teacher));
        let begun = journal.lines().len();
        for (number, planned) in (1..).zip(&participant.episodes).skip(begun) {
            if stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            let turns = self
                .episode(condition, &wire, user, number, planned, &mut person)
                .map_err(|error| failed(number as usize, error.to_string()))?;
            let entry = Entry {
                episode: number,
                task_type: planned.task_type.clone(),
                recorded: planned.recorded,
                turns,
            };
            let person = planned.script.is_none().then(|| person.clone());
            journal.note(Line { entry, person }).map_err(|error| {
                (
                    format!("episode {number} of {user} could not be written to the journal"),
                    error.to_string(),
                )
            })?;
            done.fetch_add(1, Ordering::Relaxed);
            self.progress.advance(1);
        }
        Ok(())
    }

    fn episode(
        &self,
        condition: &Condition,
        wire: &Wire<'_>,
        user: &str,
        number: u32,
        planned: &Planned,
        person: &mut Person,
    ) -> Result<Vec<Turn>, TalkError> {
        let place = format!("{} {user} {number}", condition.name);
        let (seed, household) = (self.design.seed, &*self.household);
        let (stage, teacher) = (&planned.stage, &self.design.teacher);
        match &planned.script {
            None => {
                let task = planned.task.as_str();
                let episode =
                    SimulatedEpisode { seed, user, number, task, stage, household, teacher };
                teach(person, wire, &episode, place)
            }
            Some(script) => {
                let episode =
                    RecordedEpisode { seed, user, number, stage, script, household, teacher };
                speak(wire, &episode, place)
            }
        }
    }

    fn state(&self, done: &AtomicUsize) -> State {
        let each: usize = self.people.iter().map(|person| person.episodes.len()).sum();
        State {
            finished: done.load(Ordering::Relaxed),
            all: each * self.design.conditions.len(),
            out: self.out.to_owned(),
        }
    }
}

/// Writes a file whole or not at all.
pub(super) fn write_whole(path: &Path, text: &str) -> io::Result<()> {
    let beside = path.with_extension("part");
    fs::write(&beside, text)?;
    fs::File::open(&beside)?.sync_all()?;
    fs::rename(&beside, path)
}
