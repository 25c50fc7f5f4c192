//! What each kind of work is done in, step by step. The first step that fails ends it.

use std::collections::VecDeque;

use super::{Done, Moment, OrderError, TenantWork, TenantWriter, WriterEffect, WriterInput};
use crate::events::{Event, Head, SegmentClosed};
use crate::ids::{Digest, Seq, StreamId, TenantId};
use crate::invariants::Invariant;
use crate::replay::Through;
use crate::store::{AppendError, Durable};
use crate::tenancy::{self, Order, Refusal, Registry};

/// Work that is under way.
pub(super) struct Job<C> {
    pub caller: C,
    pub tenant: TenantId,
    /// What is still to be done, in this order.
    plan: VecDeque<Step>,
    /// The step whose effect has not ended yet.
    doing: Option<Step>,
    /// What came of the steps that are done.
    done: Done,
}

enum Step {
    /// Fold the tenant's stream again: it may hold more than is known.
    ///
    /// - 0: why the work failed, if it did. It is answered once the doors know what there is.
    Reread(Option<OrderError>),
    /// An order from outside; see [`TenantWork::Obey`].
    Examine(Order, bool),
    /// An order, and what must be there before it.
    Obey(Order),
    MakeSecret,
    /// Decide an order, append, and only then apply. The only step that does it.
    Append(Order),
    ListStreams(Through),
    CloseDue(StreamId, Through),
    KeepCheckpoint,
    /// Only somebody who was there is erased.
    FindSomebody(StreamId),
    DestroyKey(StreamId),
    /// Say that the key was destroyed, unless that is on record.
    NoteErasure(StreamId),
    SignErasure {
        stream: StreamId,
        last: Seq,
        head: Digest,
    },
    TellErasure(StreamId),
}

/// How a step begins.
enum Begun {
    /// It is over.
    Over,
    /// Its effect has to end first.
    UnderWay(Step),
}

impl<C> Job<C> {
    pub fn new(work: TenantWork, caller: C) -> Job<C> {
        let (tenant, plan, done) = match work {
            TenantWork::Obey { tenant, order, gone } => {
                (tenant, vec![Step::Examine(order, gone)], Done::Obeyed(Vec::new()))
            }
            TenantWork::Close { stream, through } => {
                let tenant = stream.tenant.clone();
                (tenant, vec![Step::CloseDue(stream, through)], Done::Closed(0))
            }
            TenantWork::Checkpoint { tenant } => {
                (tenant, vec![Step::KeepCheckpoint], Done::Closed(0))
            }
            TenantWork::Sign { tenant, through } => {
                let plan = vec![Step::ListStreams(through), Step::KeepCheckpoint];
                (tenant, plan, Done::Closed(0))
            }
            TenantWork::Erase { stream } => {
                (stream.tenant.clone(), erasing(stream), Done::Closed(0))
            }
        };
        Job { caller, tenant, plan: plan.into(), doing: None, done }
    }

    /// The tenant's stream is to be read before anything is decided.
    pub fn read_first(&mut self) {
        self.plan.push_front(Step::Reread(None));
    }

    /// The work has failed; before the answer the tenant's stream is read again.
    fn give_up(&mut self, error: OrderError) {
        self.plan = VecDeque::from([Step::Reread(Some(error))]);
    }

    /// Puts `steps` before all that is still to be done.
    fn first(&mut self, steps: impl DoubleEndedIterator<Item = Step>) {
        steps.rev().for_each(|step| self.plan.push_front(step));
    }

    /// What the last order led to is the answer.
    fn recorded(&mut self, events: Vec<Event>) {
        if let Done::Obeyed(recorded) = &mut self.done {
            *recorded = events;
        }
    }

    fn closes(&mut self, due: Vec<SegmentClosed>) {
        if let Done::Closed(count) = &mut self.done {
            *count += due.len();
        }
        self.first(due.into_iter().map(|segment| Step::Obey(Order::CloseSegment(segment))));
    }
}

fn erasing(stream: StreamId) -> Vec<Step> {
    vec![
        Step::FindSomebody(stream.clone()),
        // The key goes first: a crash in between leaves a note to be made up for, never a key.
        Step::DestroyKey(stream.clone()),
        Step::NoteErasure(stream.clone()),
        // Nobody will wake there again: what is left is covered now, sealed as it is.
        Step::CloseDue(stream.clone(), Through::Head),
        Step::TellErasure(stream),
    ]
}

impl<C> TenantWriter<C> {
    /// Takes the next steps, up to one whose effect has to end first, or to the answer.
    pub(super) fn go_on(&mut self, mut job: Job<C>, moment: Moment) {
        while let Some(step) = job.plan.pop_front() {
            match self.begin(&mut job, step, moment) {
                Ok(Begun::Over) => {}
                Ok(Begun::UnderWay(step)) => {
                    job.doing = Some(step);
                    self.job = Some(job);
                    return;
                }
                Err(error) => return self.answer(job.caller, Err(error)),
            }
        }
        self.answer(job.caller, Ok(job.done));
    }

    fn begin(&mut self, job: &mut Job<C>, step: Step, moment: Moment) -> Result<Begun, OrderError> {
        let tenant = job.tenant.clone();
        let effect = match &step {
            Step::Examine(order, gone) => {
                let order = self.examine(&tenant, order, *gone)?;
                job.plan.push_front(Step::Obey(order));
                return Ok(Begun::Over);
            }
            Step::Obey(order) => {
                self.prepare(job, order)?;
                return Ok(Begun::Over);
            }
            Step::Append(order) => match self.propose(&tenant, order, moment)? {
                Some(append) => append,
                None => {
                    job.recorded(Vec::new());
                    return Ok(Begun::Over);
                }
            },
            Step::CloseDue(stream, _) if stream.is_tenants() => return Ok(Begun::Over),
            Step::CloseDue(stream, through) => {
                let from = self.registry(&tenant).map_or(Seq::FIRST, |it| it.uncovered(stream.key));
                WriterEffect::FindDue { stream: stream.clone(), from, through: *through }
            }
            Step::NoteErasure(stream) if self.has_noted(stream) => return Ok(Begun::Over),
            Step::TellErasure(stream) => {
                let registry = self.registry(&tenant);
                let noted = registry.and_then(|registry| registry.erased().get(&stream.key));
                let noted = noted.ok_or(OrderError::NobodyThere { tenant })?;
                tracing::info!(%stream, records = %noted.last, "a person was erased");
                job.done = Done::Erased(noted.clone());
                return Ok(Begun::Over);
            }
            Step::Reread(_) => WriterEffect::Fold { tenant },
            Step::MakeSecret => WriterEffect::MakeSecret { tenant },
            Step::ListStreams(_) => WriterEffect::ListStreams { tenant },
            Step::KeepCheckpoint => WriterEffect::KeepCheckpoint { tenant },
            Step::FindSomebody(stream) | Step::NoteErasure(stream) => {
                WriterEffect::FindEnd { stream: stream.clone() }
            }
            Step::DestroyKey(stream) => WriterEffect::DestroyKey { stream: stream.clone() },
            Step::SignErasure { stream, last, head } => {
                let statement = tenancy::erasure_statement(&tenant, stream.key, *last, *head);
                WriterEffect::SignStatement { tenant, statement }
            }
        };
        self.effects.push(effect);
        Ok(Begun::UnderWay(step))
    }

    /// Takes the end of what is under way.
    ///
    /// - errors: why the work has failed.
    /// - panics: when it is the end of something else (invariant `SingleWriter`).
    pub(super) fn end(&mut self, job: &mut Job<C>, end: WriterInput<C>) -> Result<(), OrderError> {
        let tenant = job.tenant.clone();
        let unreadable = |error| OrderError::Read { tenant: tenant.clone(), error };
        let no_key = |error| OrderError::Key { tenant: tenant.clone(), error };
        let nobody = || OrderError::NobodyThere { tenant: tenant.clone() };
        match (job.doing.take(), end) {
            (Some(Step::Reread(because)), WriterInput::Folded(found)) => {
                self.folded(&tenant, found, because)?;
            }
            (Some(Step::Append(_)), WriterInput::Appended(result)) => self.appended(job, result)?,
            (Some(Step::MakeSecret), WriterInput::SecretMade(made)) => made.map_err(no_key)?,
            (Some(Step::ListStreams(through)), WriterInput::Streams(streams)) => {
                let streams = streams.map_err(unreadable)?.into_iter();
                job.first(streams.map(|stream| Step::CloseDue(stream, through)));
            }
            (Some(Step::CloseDue(..)), WriterInput::Due(due)) => {
                job.closes(due.map_err(unreadable)?);
            }
            (Some(Step::KeepCheckpoint), WriterInput::CheckpointKept(kept)) => {
                let note = kept.map_err(|error| OrderError::Evidence { tenant, error })?;
                job.done = Done::Signed(note);
            }
            (Some(Step::FindSomebody(_)), WriterInput::End(end)) => {
                Seq::new(end.map_err(unreadable)?.seq).ok_or_else(nobody)?;
            }
            (Some(Step::DestroyKey(_)), WriterInput::KeyDestroyed(gone)) => gone.map_err(no_key)?,
            (Some(Step::NoteErasure(stream)), WriterInput::End(end)) => {
                let Head { seq, digest: head } = end.map_err(unreadable)?;
                let last = Seq::new(seq).ok_or_else(nobody)?;
                job.plan.push_front(Step::SignErasure { stream, last, head });
            }
            (
                Some(Step::SignErasure { stream, last, head }),
                WriterInput::StatementSigned(signed),
            ) => {
                let (stream, signature) = (stream.key, signed.map_err(no_key)?);
                let order = Order::NoteErasure { stream, last, head, signature };
                job.plan.push_front(Step::Obey(order));
            }
            _ => panic!("{}: an end of what was not begun", Invariant::SingleWriter),
        }
        Ok(())
    }

    /// Holds an order from outside against what the doors and the other tenants know.
    fn examine(&self, tenant: &TenantId, order: &Order, gone: bool) -> Result<Order, OrderError> {
        match order {
            Order::Admit { key, .. } | Order::Rotate { new: key, .. } => {
                if self.is_anothers(tenant, key) {
                    return Err(OrderError::KeyOfOther);
                }
                if gone {
                    let refusal = Refusal::Retired { key: *key };
                    return Err(OrderError::Refused { tenant: tenant.clone(), refusal });
                }
                Ok(order.clone())
            }
            Order::Retire { key, .. } if gone => {
                Ok(Order::Retire { key: *key, overlap_seconds: 0 })
            }
            _ => Ok(order.clone()),
        }
    }

    /// Plans an order, after what must be there before it.
    fn prepare(&self, job: &mut Job<C>, order: &Order) -> Result<(), OrderError> {
        let tenant = &job.tenant;
        let append = Step::Append(order.clone());
        let before = match order {
            // A tenant that is there keeps the name that it has.
            Order::Open if self.registry(tenant).is_none() => {
                let name = |error| OrderError::Name { tenant: tenant.clone(), error };
                tenant.check_new().map_err(name)?;
                // The only order that may make a secret: records behind a lost one would be lost
                // too.
                Some(Step::MakeSecret)
            }
            Order::Open => None,
            // The tenant of the single-user default is there without having been added.
            _ if *tenant == TenantId::local() && !self.is_open(tenant) => {
                Some(Step::Obey(Order::Open))
            }
            _ => None,
        };
        job.first(before.into_iter().chain([append]));
        Ok(())
    }

    /// - returns: the append; none when it is so already.
    fn propose(
        &self,
        tenant: &TenantId,
        order: &Order,
        moment: Moment,
    ) -> Result<Option<WriterEffect<C>>, OrderError> {
        // A name in an order does not make a tenant.
        let none = Registry::default();
        let registry = self.registry(tenant).unwrap_or(&none);
        let batch = registry
            .propose(order, moment.at, moment.fresh)
            .map_err(|refusal| OrderError::Refused { tenant: tenant.clone(), refusal })?;
        let (stream, after) = (StreamId::of_tenant(tenant), registry.head());
        Ok(batch.map(|batch| WriterEffect::Append { stream, after, batch }))
    }

    fn appended(
        &mut self,
        job: &mut Job<C>,
        result: Result<Durable, AppendError>,
    ) -> Result<(), OrderError> {
        let tenant = job.tenant.clone();
        match result {
            Ok(durable) => self.settle(job, durable),
            Err(error) => {
                if error.is_fatal() {
                    // Before the answer: a caller may look at once whether the service ends.
                    self.effects.push(WriterEffect::Fatal(error.to_string()));
                }
                let is_certain = error.is_certain();
                let error = OrderError::Append { tenant: tenant.clone(), error };
                if is_certain {
                    return Err(error);
                }
                // Whether it was appended is unknown: what there is, is read again.
                self.unread.insert(tenant);
                job.give_up(error);
            }
        }
        Ok(())
    }

    /// Makes durable records true, and lets the doors know.
    fn settle(&mut self, job: &mut Job<C>, durable: Durable) {
        let tenant = job.tenant.clone();
        let registry = self.registries.entry(tenant.clone()).or_default();
        if let Err(error) = registry.settle(&durable) {
            self.unread.insert(tenant.clone());
            return job.give_up(OrderError::Disagreement { tenant, error });
        }
        job.recorded(durable.records().iter().map(|record| record.event.clone()).collect());
        let stream = StreamId::of_tenant(&tenant);
        self.effects.push(WriterEffect::TellDoors { tenant });
        self.effects.push(WriterEffect::Publish { stream, durable });
    }

    /// - `because`: why the work failed, if it did.
    fn folded(
        &mut self,
        tenant: &TenantId,
        found: Result<Registry, OrderError>,
        because: Option<OrderError>,
    ) -> Result<(), OrderError> {
        let read = found.map(|registry| {
            self.unread.remove(tenant);
            self.registries.insert(tenant.clone(), registry);
            self.effects.push(WriterEffect::TellDoors { tenant: tenant.clone() });
        });
        because.map_or(read, Err)
    }
}
