//! One stream under audit, record by record.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::audit::{Counts, Scrutiny, StreamReport};
use super::evidence::{SegmentError, check_segment, newest_checkpoint};
use super::origins::mind_origin;
use super::repropose::{self, Verdict};
use super::{Difference, erasures};
use crate::events::{Event, Record, RetrainCompleted, SegmentClosed, TenantEvent, Times};
use crate::ids::{Digest, Seq, StreamId, UserId};
use crate::learning::{self, Mind, Recipe};
use crate::limits::BATCH_EVENTS_MAX;
use crate::parallel::Progress;
use crate::session::{Outstanding, Session, command_of};
use crate::store::{Found, ReadError, Store};
use crate::tenancy::Registry;
use crate::world::Domain;

/// Records between two reports of progress.
const PROGRESS_EVERY: u64 = 256;

type Trained = Result<Arc<Mind>, String>;

/// Minds without a lesson, by recipe: every person starts with one, so each is trained once.
#[derive(Default)]
pub(super) struct BaseMinds(Mutex<BTreeMap<Digest, Arc<OnceLock<Trained>>>>);

impl BaseMinds {
    fn get<D: Domain>(&self, domain: &D, recipe: &Recipe) -> Trained {
        let cell = {
            let mut held = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            held.entry(recipe.digest()).or_default().clone()
        };
        // Outside the lock: another recipe need not wait for this training.
        cell.get_or_init(|| match learning::train(domain, recipe, &[]) {
            Ok(mind) => Ok(Arc::new(mind)),
            Err(error) => Err(error.to_string()),
        })
        .clone()
    }
}

pub(super) struct Auditor<'a, D: Domain> {
    domain: &'a Arc<D>,
    store: &'a Store,
    stream: &'a StreamId,
    scrutiny: Scrutiny,
    bases: &'a BaseMinds,
    session: Session<D>,
    counts: Counts,
    times: Times,
    first: Option<Difference>,
    /// The record that named the present mind.
    named_at: u64,
    /// The mind that the last training gave.
    trained: Option<Arc<Mind>>,
    /// A recorded mind that training does not give: what it answered cannot be decided again.
    lost: Option<Digest>,
}

impl<'a, D: Domain> Auditor<'a, D> {
    pub fn new(
        domain: &'a Arc<D>,
        store: &'a Store,
        stream: &'a StreamId,
        scrutiny: Scrutiny,
        bases: &'a BaseMinds,
    ) -> Auditor<'a, D> {
        Auditor {
            domain,
            store,
            stream,
            scrutiny,
            bases,
            session: Session::new(domain.clone()),
            counts: Counts { streams: 1, ..Counts::default() },
            times: Times::default(),
            first: None,
            named_at: 0,
            trained: None,
            lost: None,
        }
    }

    pub fn audit(mut self, progress: &dyn Progress) -> StreamReport {
        if self.stream.is_tenants() {
            return self.audit_tenant(progress);
        }
        match self.store.log.read(self.stream, Seq::FIRST) {
            Ok(records) => {
                if let Err(difference) = self.walk(records, progress) {
                    self.note(difference);
                }
                self.report(false)
            }
            Err(ReadError::Erased) => {
                self.counts.erased_streams = 1;
                match self.store.log.walk(self.stream) {
                    Ok(head) => {
                        self.counts.records = head.seq;
                        progress.advance(head.seq);
                        StreamReport {
                            head: head.seq,
                            head_digest: head.digest,
                            ..self.report(true)
                        }
                    }
                    Err(error) => {
                        self.note(Difference::of_read(&error, 1));
                        self.report(true)
                    }
                }
            }
            Err(error) => {
                self.note(Difference::of_read(&error, 1));
                self.report(false)
            }
        }
    }

    /// The tenant's own stream is folded by its own rules, and holds no mind.
    fn audit_tenant(mut self, progress: &dyn Progress) -> StreamReport {
        let mut registry = Registry::default();
        let walked = self.walk_tenant(&mut registry);
        if let Err(difference) = walked.and_then(|()| self.check_tree(&registry)) {
            self.note(difference);
        }
        progress.advance(self.counts.records);
        let head = registry.head();
        StreamReport {
            head: head.seq,
            head_digest: head.digest,
            state_digest: None,
            ..self.report(false)
        }
    }

    fn walk_tenant(&mut self, registry: &mut Registry) -> Result<(), Difference> {
        let failed = |error: &ReadError, seq| Difference::of_read(error, seq);
        let records = self.store.log.read(self.stream, Seq::FIRST);
        for record in records.map_err(|error| failed(&error, 1))? {
            let record = record.map_err(|error| failed(&error, registry.head().seq + 1))?;
            self.counts.records += 1;
            self.counts.held_times += u64::from(self.times.is_held(&record));
            registry.apply(&record).map_err(|error| {
                Difference::new(error.seq.get(), "place in history", "what is there", error.reason)
            })?;
            if let Event::Tenant(TenantEvent::PersonErased(erased)) = &record.event {
                let tenant = &self.stream.tenant;
                erasures::check(self.store, tenant, record.seq.get(), erased)
                    .into_iter()
                    .for_each(|difference| self.note(difference));
            }
        }
        Ok(())
    }

    /// Holds each segment against the records it was closed over, and the tree against the newest
    /// checkpoint that was given out.
    fn check_tree(&mut self, registry: &Registry) -> Result<(), Difference> {
        let tenant = &self.stream.tenant;
        for segment in registry.segments() {
            let closed = &segment.closed;
            let differs = |what: &str, recorded: &dyn Display, found: &dyn Display| {
                let SegmentClosed { stream, first, last, .. } = closed;
                let field =
                    format!("segment of stream {stream}, records {first} to {last}: {what}");
                Difference::new(segment.seq.get(), &field, recorded, found)
            };
            self.counts.segments += 1;
            match check_segment(&*self.store.log, tenant, closed, None) {
                Ok(_) => {}
                Err(SegmentError::Root { found }) => {
                    return Err(differs("root", &closed.root, &found));
                }
                Err(SegmentError::Head { found }) => {
                    return Err(differs("head", &closed.head, &found));
                }
                Err(error) => return Err(differs("records", &"all that it covers", &error)),
            }
        }
        let signed = newest_checkpoint(self.store, tenant, registry);
        let last = registry.head().seq;
        signed.map(|_| ()).map_err(|error| {
            Difference::new(last, "newest checkpoint", "what was signed and given out", error)
        })
    }

    fn report(mut self, erased: bool) -> StreamReport {
        self.counts.streams_differ = u64::from(self.first.is_some());
        let (head, state) = (self.session.head(), self.session.state());
        let user: Option<UserId> = state.opened.as_ref().map(|opened| opened.user.clone());
        StreamReport {
            tenant: self.stream.tenant.clone(),
            stream: self.stream.key,
            user,
            erased,
            head: head.seq,
            head_digest: head.digest,
            state_digest: (!erased).then(|| self.session.state_digest()),
            mind: state.mind,
            difference: self.first,
            counts: self.counts,
        }
    }

    /// - errors: what makes going on senseless: a record that cannot be read or applied.
    fn walk(
        &mut self,
        records: impl Iterator<Item = Result<Record, ReadError>>,
        progress: &dyn Progress,
    ) -> Result<(), Difference> {
        let mut batch: Vec<Record> = Vec::new();
        let mut untold = 0;
        for record in records {
            let record = match record {
                Ok(record) => record,
                Err(error) => {
                    let next = self.session.head().seq + batch.len() as u64 + 1;
                    self.settle(&mut batch)?;
                    return Err(Difference::of_read(&error, next));
                }
            };
            // One command's records carry its request id.
            let another = batch.last().is_some_and(|last| last.request != record.request);
            if another || batch.len() == BATCH_EVENTS_MAX {
                self.settle(&mut batch)?;
            }
            batch.push(record);
            untold += 1;
            if untold == PROGRESS_EVERY {
                progress.advance(std::mem::take(&mut untold));
            }
        }
        self.settle(&mut batch)?;
        progress.advance(untold);
        Ok(())
    }

    /// Checks and applies one command's records.
    fn settle(&mut self, batch: &mut Vec<Record>) -> Result<(), Difference> {
        if self.scrutiny.repropose && !batch.is_empty() {
            self.repropose(batch);
        }
        for record in batch.drain(..) {
            self.count(&record.event);
            self.counts.held_times += u64::from(self.times.is_held(&record));
            if self.scrutiny.retrain {
                self.retrain(&record);
            }
            self.session.apply(&record).map_err(Difference::of_fold)?;
            if matches!(record.event, Event::SessionOpened(_) | Event::RetrainCompleted(_)) {
                self.named_at = record.seq.get();
                self.check_recipe(&record)?;
            }
        }
        Ok(())
    }

    fn count(&mut self, event: &Event) {
        self.counts.records += 1;
        self.counts.episodes += u64::from(matches!(event, Event::EpisodeStarted(_)));
        self.counts.utterances += u64::from(matches!(event, Event::Interpreted(_)));
    }

    /// Training is a function of the recipe that the log carries: nothing can be trained again
    /// when this binary reads another one out of it.
    fn check_recipe(&self, record: &Record) -> Result<(), Difference> {
        let Event::SessionOpened(event) = &record.event else { return Ok(()) };
        if !self.scrutiny.retrain && !self.scrutiny.repropose {
            return Ok(());
        }
        let seq = record.seq.get();
        match Recipe::parse(&event.recipe_text) {
            Ok(recipe) if recipe.digest() == event.recipe_digest => Ok(()),
            Ok(recipe) => {
                Err(Difference::new(seq, "recipe_digest", event.recipe_digest, recipe.digest()))
            }
            Err(error) => Err(Difference::new(seq, "recipe_text", "a recipe", error)),
        }
    }

    fn repropose(&mut self, batch: &[Record]) {
        let Some(command) = command_of(batch) else { return };
        if !self.session.is_open() {
            return;
        }
        let says = matches!(batch[0].event, Event::Interpreted(_));
        if says && !self.equip() {
            return;
        }
        self.counts.reproposed += 1;
        self.counts.reproposed_utterances += u64::from(says);
        match repropose::compare(&self.session, &command.into(), batch) {
            Verdict::Same => {}
            Verdict::OfOld => self.counts.proposals_differ += 1,
            Verdict::Differs(difference) => {
                self.counts.proposals_differ += 1;
                self.note(difference);
            }
        }
    }

    /// Trains what `record` says was trained, before the record is applied.
    fn retrain(&mut self, record: &Record) {
        let seq = record.seq.get();
        let (trained, recorded) = match &record.event {
            Event::SessionOpened(event) => {
                self.counts.retrained_base += 1;
                let trained = match Recipe::parse(&event.recipe_text) {
                    Ok(recipe) => self.bases.get(&**self.domain, &recipe),
                    Err(error) => Err(error.to_string()),
                };
                if let Ok(mind) = &trained
                    && mind.digest() != event.mind
                {
                    self.counts.trainings_differ += 1;
                    self.note(Difference::new(seq, "mind", event.mind, mind.digest()));
                }
                (trained, event.mind)
            }
            Event::RetrainCompleted(event) => {
                let Some(Outstanding::Retrain { recipe, lessons }) = self.session.outstanding()
                else {
                    return;
                };
                self.counts.retrained += 1;
                let trained = match lessons.is_empty() {
                    true => self.bases.get(&**self.domain, &recipe),
                    false => learning::train(&**self.domain, &recipe, &lessons)
                        .map(Arc::new)
                        .map_err(|error| error.to_string()),
                };
                if let Ok(mind) = &trained {
                    let today = Event::RetrainCompleted(RetrainCompleted {
                        recipe: recipe.digest(),
                        mind: mind.digest(),
                        report: mind.report().clone(),
                        // Other code may have trained it: the question is whether this one agrees.
                        code: event.code,
                    });
                    if let Some(found) = Difference::of_events(seq, &record.event, &today) {
                        self.counts.trainings_differ += 1;
                        self.note(found);
                    }
                }
                (trained, event.mind)
            }
            _ => return,
        };
        match trained {
            Ok(mind) => self.trained = Some(mind),
            Err(reason) => {
                self.counts.trainings_differ += 1;
                self.note(Difference::new(seq, "mind", recorded, reason));
            }
        }
    }

    /// Gives the session the mind that its state names: the one just trained, a cached one, or one
    /// trained for this.
    ///
    /// - returns: whether it is there.
    fn equip(&mut self) -> bool {
        let Some(wanted) = self.session.mind_wanted() else {
            return self.session.mind().is_some();
        };
        if self.lost == Some(wanted) {
            return false;
        }
        let mind = match self.trained.take().filter(|mind| mind.digest() == wanted) {
            Some(mind) => Ok(mind),
            None => self.find(wanted),
        };
        match mind {
            Ok(mind) => {
                self.session.install(mind);
                true
            }
            Err(recomputed) => {
                self.lost = Some(wanted);
                self.note(Difference::new(self.named_at, "mind", wanted, recomputed));
                false
            }
        }
    }

    /// - errors: what training gives instead.
    fn find(&mut self, wanted: Digest) -> Trained {
        let (domain, recipe) = (&**self.domain, self.session.recipe().clone());
        let lessons = self.session.trained_lessons();
        let origin = mind_origin(recipe.digest());
        let read = |bytes: &[u8]| Mind::from_bytes(domain, &recipe, bytes).ok();
        let kept = match self.store.models.load(self.stream, &origin, wanted, read) {
            Found::Fits(mind) => return Ok(Arc::new(mind)),
            // What other code trained answers only when this code cannot train the same.
            Found::Stale(mind) => Some(mind),
            Found::Absent | Found::Damaged => None,
        };
        let trained = match lessons.is_empty() {
            true => self.bases.get(domain, &recipe),
            false => {
                self.counts.minds_missing += 1;
                let trained = learning::train(domain, &recipe, &lessons);
                trained.map(Arc::new).map_err(|error| error.to_string())
            }
        };
        match (trained, kept) {
            (Ok(mind), _) if mind.digest() == wanted => Ok(mind),
            (_, Some(kept)) => Ok(Arc::new(kept)),
            (trained, None) => Err(trained?.digest().to_string()),
        }
    }

    /// Keeps the difference that stands first in the stream.
    fn note(&mut self, difference: Difference) {
        if self.first.as_ref().is_none_or(|first| difference.seq < first.seq) {
            self.first = Some(difference);
        }
    }
}
