//! The minds that a rerun asks: the recorded ones, and those of another recipe.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use apprentice::events::{Event, Record};
use apprentice::ids::{Digest, Seq, StreamId};
use apprentice::learning::{self, Lesson, Mind, Recipe};
use apprentice::replay;
use apprentice::session::{Outstanding, Session};
use apprentice::store::Store;
use apprentice::world::Domain;
use serde::Serialize;

/// Minds of one person and one recipe kept at a time; who takes lessons back returns to an older
/// list. A mind has some hundred kilobytes.
const KEPT_MAX: usize = 64;

type Trained = Result<Arc<Mind>, String>;

/// How the minds that answered came to be there. Minds without a lesson, which are made once for
/// everybody, are not counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct MindCounts {
    /// Minds of another recipe that were trained on recorded lessons.
    pub trained: u64,
    /// Trainings under another recipe that failed; the mind before then stays, as it would have.
    pub trainings_failed: u64,
    /// Recorded minds that answered with another threshold.
    pub recorded: u64,
    /// Those of them whose bytes the directory had no longer: made again from the log, and held
    /// against the digest that the log names. Not told to programs: it is a matter of caches.
    #[serde(skip)]
    pub recorded_rebuilt: u64,
}

impl MindCounts {
    pub fn add(&mut self, other: &MindCounts) {
        let MindCounts { trained, trainings_failed, recorded, recorded_rebuilt } = other;
        self.trained += trained;
        self.trainings_failed += trainings_failed;
        self.recorded += recorded;
        self.recorded_rebuilt += recorded_rebuilt;
    }
}

/// Minds without a lesson, by the recipe that is asked instead or by the digest that was recorded:
/// everybody starts with one, and it holds nobody's words.
#[derive(Default)]
pub(super) struct BaseMinds(Mutex<BTreeMap<Digest, Arc<OnceLock<Trained>>>>);

impl BaseMinds {
    fn get(&self, of: Digest, make: impl FnOnce() -> Trained) -> Trained {
        let cell = {
            let mut held = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            held.entry(of).or_default().clone()
        };
        // Outside the lock: another recipe need not wait for this training.
        cell.get_or_init(make).clone()
    }
}

/// The recorded minds of one person.
#[derive(Default)]
pub(super) struct RecordedMinds {
    minds: replay::Minds,
    present: Option<Arc<Mind>>,
}

impl RecordedMinds {
    /// The mind that answered at this moment of the session, bit for bit.
    ///
    /// - errors: a sentence: this program cannot make the mind that the log names.
    pub fn get<D: Domain>(
        &mut self,
        session: &Session<D>,
        store: &Store,
        stream: &StreamId,
        bases: &BaseMinds,
        counts: &mut MindCounts,
    ) -> Trained {
        let wanted = session.state().mind.expect("the session is open where people say something");
        if let Some(mind) = self.present.as_ref().filter(|mind| mind.digest() == wanted) {
            return Ok(mind.clone());
        }
        let find = |minds: &replay::Minds| {
            let found = replay::mind_of(session, store, stream, minds);
            found.map_err(|error| error.to_string())
        };
        let mind = match session.trained_lessons().is_empty() {
            true => {
                // By its own digest: other code may have trained another one for somebody else.
                let make = || find(&replay::Minds::default());
                bases.get(wanted, make)?
            }
            false => {
                let before = self.minds.work().trainings;
                let mind = find(&self.minds)?;
                counts.recorded += 1;
                counts.recorded_rebuilt += self.minds.work().trainings - before;
                mind
            }
        };
        self.present = Some(mind.clone());
        Ok(mind)
    }
}

/// A training that the log scheduled and that this recipe has not been asked for yet.
struct Due<D: Domain> {
    lessons: Vec<Lesson<D::Scene, D::Task>>,
    /// What tells one list of lessons of this person from another.
    list: Vec<Seq>,
}

/// The minds that one person would have had under another recipe, from the lessons that were live
/// at each recorded training.
pub(super) struct OtherMinds<D: Domain> {
    recipe: Recipe,
    present: Option<Arc<Mind>>,
    /// Since the present mind, oldest first. Most are never asked for: nothing was said before the
    /// next.
    due: Vec<Due<D>>,
    kept: VecDeque<(Vec<Seq>, Trained)>,
}

impl<D: Domain> OtherMinds<D> {
    pub fn new(recipe: Recipe) -> OtherMinds<D> {
        OtherMinds { recipe, present: None, due: Vec::new(), kept: VecDeque::new() }
    }

    /// Notes what `record`, which was just applied to `session`, means for what is to be trained.
    pub fn note(&mut self, session: &Session<D>, record: &Record) {
        match &record.event {
            Event::SessionOpened(_) => {
                self.due.push(Due { lessons: Vec::new(), list: Vec::new() });
            }
            Event::RetrainScheduled(event) => {
                let Some(Outstanding::Retrain { lessons, .. }) = session.outstanding() else {
                    return;
                };
                self.due.push(Due { lessons, list: event.lessons.clone() });
            }
            // With the very recipe that failed there is nothing to wonder about. Any other might
            // have succeeded.
            Event::RetrainFailed(event) if event.recipe == self.recipe.digest() => {
                self.due.pop();
            }
            _ => {}
        }
    }

    /// The mind of the newest training that succeeds.
    ///
    /// - errors: a sentence: not even the mind without lessons can be trained.
    pub fn get(&mut self, domain: &D, bases: &BaseMinds, counts: &mut MindCounts) -> Trained {
        let mut failed = String::new();
        while let Some(due) = self.due.pop() {
            match self.train(domain, due, bases, counts) {
                Ok(mind) => {
                    self.present = Some(mind);
                    self.due.clear();
                }
                Err(reason) => {
                    counts.trainings_failed += 1;
                    failed = reason;
                }
            }
        }
        self.present.clone().ok_or(failed)
    }

    fn train(
        &mut self,
        domain: &D,
        due: Due<D>,
        bases: &BaseMinds,
        counts: &mut MindCounts,
    ) -> Trained {
        let Due { lessons, list } = due;
        let anew = || {
            let trained = learning::train(domain, &self.recipe, &lessons);
            trained.map(Arc::new).map_err(|error| error.to_string())
        };
        if lessons.is_empty() {
            return bases.get(self.recipe.digest(), anew);
        }
        if let Some((_, known)) = self.kept.iter().find(|(known, _)| *known == list) {
            return known.clone();
        }
        let trained = anew();
        counts.trained += u64::from(trained.is_ok());
        if self.kept.len() == KEPT_MAX {
            self.kept.pop_front();
        }
        self.kept.push_back((list, trained.clone()));
        trained
    }
}
