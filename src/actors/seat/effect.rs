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
    /// The session was read from the log, or cannot be: then this is everybody's answer.
    Woken(Result<Box<Session<D>>, Box<Response>>),
    /// Somebody asks.
    ///
    /// - `at`: what the wall clock read.
    /// - `fresh`: a request id that nobody used, for the record that somebody is new.
    Asked { ask: PersonAsk, request: RequestId, caller: C, at: Timestamp, fresh: RequestId },
    /// The end of [`Effect::Append`].
    Appended(Result<Durable, AppendError>),
    /// The end of [`Effect::ReadBack`]: all of the records, or why they cannot be read.
    ReadBack(Result<Vec<Record>, String>),
    /// The end of [`Effect::FindMind`]; none when it is not in memory.
    Found(Option<Arc<Mind>>),
    /// The end of [`Effect::Train`]. The mind's bytes were kept, or losing them costs time only.
    ///
    /// - `recipe`: digest of the recipe that it was trained by.
    /// - `fresh`: a request id that nobody used, for the record of it.
    Trained { recipe: Digest, outcome: Result<Arc<Mind>, String>, at: Timestamp, fresh: RequestId },
    /// The other end of [`Effect::Train`]: there was no room for it.
    TrainingRefused,
    /// The time of [`Effect::SetTimer`] is over.
    Due(Timer),
    /// The directory has forgotten this seat. The last input.
    Sleep,
}

/// What a person's seat wants done.
pub enum Effect<D: Domain, C> {
    /// Append to the person's stream; the end is [`Input::Appended`].
    Append { after: Head, batch: Batch },
    /// Answer a caller. Each caller is answered once.
    Answer { caller: C, response: Response },
    /// Read the records of a request from the person's stream; the end is [`Input::ReadBack`].
    ReadBack { request: RequestId, first: Seq, last: Seq },
    /// Keep a mind in memory, where [`Effect::FindMind`] looks.
    Remember(Arc<Mind>),
    /// Find a mind; the end is [`Input::Found`].
    FindMind(Digest),
    /// Train a mind; the end is [`Input::Trained`] or [`Input::TrainingRefused`]. Other inputs may
    /// come before it.
    Train { recipe: Arc<Recipe>, lessons: Vec<Lesson<D::Scene, D::Task>> },
    /// Keep a snapshot of [`Seat::session`](super::Seat::session). A cache: failing costs time only.
    KeepSnapshot,
    /// Drop the kept bytes of all minds but the session's. A cache, too.
    ForgetOldMinds,
    /// Have the segments closed that are due.
    CloseSegments,
    /// Tell the feed that these records are durable.
    Publish(Durable),
    /// Hand in [`Input::Due`] after this long.
    SetTimer(Timer, Duration),
    /// Tell the directory that this seat cannot go on.
    Leave,
    /// The log takes nothing more: the service ends, for this reason.
    Fatal(String),
    /// The seat is empty. The last effect.
    Stop,
}

/// What a seat measures time for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Timer {
    /// Somebody who waits for a training, by number.
    Waiter(u64),
    /// A training that found the queue full.
    AskForTraining,
}

impl<D: Domain, C> Input<D, C> {
    /// Whether this is what a seat waits for that takes nothing else meanwhile.
    pub(super) fn ends_what_is_under_way(&self) -> bool {
        matches!(self, Input::Woken(_) | Input::Appended(_) | Input::ReadBack(_) | Input::Found(_))
    }
}
