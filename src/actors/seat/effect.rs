use std::sync::Arc;
use std::time::Duration;

use crate::client::{PersonAsk, Response};
use crate::events::{Batch, Head, Record};
use crate::ids::{Digest, RequestId, Seq, Timestamp};
use crate::learning::{Lesson, Mind, Recipe};
use crate::session::Session;
use crate::store::{AppendError, Durable};
use crate::world::Domain;

/// What happened to a person's seat.
pub enum Input<D: Domain, C> {
    /// The session was read from the log. If that failed: the answer to all requests.
    Woken(Result<Box<Session<D>>, Box<Response>>),
    /// A request came.
    ///
    /// - `at`: the time of the wall clock.
    /// - `fresh`: an unused request id, for the record that the person is new.
    Asked { ask: PersonAsk, request: RequestId, caller: C, at: Timestamp, fresh: RequestId },
    /// The result of [`Effect::Append`].
    Appended(Result<Durable, AppendError>),
    /// The result of [`Effect::ReadBack`]: all the records, or why they cannot be read.
    ReadBack(Result<Vec<Record>, String>),
    /// The result of [`Effect::FindMind`]; none if the mind is not in memory.
    Found(Option<Arc<Mind>>),
    /// The result of [`Effect::Train`].
    ///
    /// - `recipe`: the digest of the recipe of the training.
    /// - `at`: the time of the wall clock.
    /// - `fresh`: an unused request id, for the record of the result.
    Trained { recipe: Digest, outcome: Result<Arc<Mind>, String>, at: Timestamp, fresh: RequestId },
    /// [`Effect::Train`] failed, because the queue is full.
    TrainingRefused,
    /// The time of [`Effect::SetTimer`] is over.
    Due(Timer),
    /// The directory has removed this seat. This is the last input.
    Sleep,
}

/// What a person's seat wants done.
pub enum Effect<D: Domain, C> {
    /// Append to the person's stream. [`Input::Appended`] follows.
    Append { after: Head, batch: Batch },
    /// Answer a caller. Each caller gets one answer.
    Answer { caller: C, response: Response },
    /// Read the records of a request from the person's stream. [`Input::ReadBack`] follows.
    ReadBack { request: RequestId, first: Seq, last: Seq },
    /// Keep a mind in memory, where [`Effect::FindMind`] looks.
    Remember(Arc<Mind>),
    /// Find a mind. [`Input::Found`] follows.
    FindMind(Digest),
    /// Train a mind. [`Input::Trained`] or [`Input::TrainingRefused`] follows; other inputs may
    /// come before it.
    Train { recipe: Arc<Recipe>, lessons: Vec<Lesson<D::Scene, D::Task>> },
    /// Keep a snapshot of [`Seat::session`](super::Seat::session). It is a cache: a failure only
    /// costs time.
    KeepSnapshot,
    /// Delete the kept bytes of all minds but the session's. They are a cache, too.
    ForgetOldMinds,
    /// Let the registrar close the segments that are due.
    CloseSegments,
    /// Tell the feed about these new records.
    Publish(Durable),
    /// Give [`Input::Due`] after this time.
    SetTimer(Timer, Duration),
    /// Tell the directory that this seat cannot continue.
    Leave,
    /// Stop the service for this reason: the log is poisoned.
    Fatal(String),
    /// Drop the seat. This is the last effect.
    Stop,
}

/// What a timer of a seat is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Timer {
    /// A caller who waits for a training, by number.
    Waiter(u64),
    /// A training that found the queue full, and is asked for again.
    AskForTraining,
}

impl<D: Domain, C> Input<D, C> {
    /// True if the seat waits for this and takes no request before it.
    pub(super) fn ends_what_is_under_way(&self) -> bool {
        matches!(self, Input::Woken(_) | Input::Appended(_) | Input::ReadBack(_) | Input::Found(_))
    }
}
