//! Speaks for one person, without actix: no clock, no thread, no file, no entropy. [`Seat::step`]
//! takes an input and returns effects. The service carries them out with actix (`actors/user.rs`),
//! the simulator in an order that a seed decides (`tests/simulation/`).

mod effect;
mod turn;
mod view;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

pub use effect::{Effect, Input, Timer};

use self::turn::{Doing, Work};
use crate::client::{PersonAsk, Phase, Response, Told, Waited};
use crate::ids::{RequestId, StreamId, Timestamp, UserId};
use crate::invariants::Invariant;
use crate::learning::{Mind, Recipe};
use crate::limits::{WAIT_S_MAX, WAITERS_MAX};
use crate::session::{Outstanding, Session};
use crate::world::Domain;

/// What the session of a new person starts with. It is the same for everybody.
pub struct NewSession {
    /// The recipe.
    pub recipe: Recipe,
    /// The recipe as it is recorded.
    pub recipe_text: String,
    /// The base mind. It contains no words of a person, so all people share it.
    pub base: Arc<Mind>,
}

/// Speaks for one person who is awake, and is the only writer of the person's stream. `C` answers a
/// caller.
///
/// The seat does one thing at a time (an append, a reading, a search for a mind). It takes no
/// request before the result of this thing.
pub struct Seat<D: Domain, C> {
    stream: StreamId,
    user: UserId,
    new: Arc<NewSession>,
    stage: Stage<D>,
    doing: Option<Doing<C>>,
    /// A training is queued or runs.
    training: bool,
    /// How the last training ended.
    last_told: Vec<Told>,
    waiters: BTreeMap<u64, C>,
    waiters_seen: u64,
    effects: Vec<Effect<D, C>>,
}

enum Stage<D: Domain> {
    /// The session is being rebuilt from the log.
    Waking,
    Awake(Box<Session<D>>),
    /// The seat cannot continue. All requests get this answer until the directory puts it to sleep.
    Leaving(Response),
}

/// How long after a refusal a training is asked for again.
const TRAIN_AGAIN: Duration = Duration::from_secs(1);
/// Milliseconds after which a request may be sent again if the seat was leaving.
const RETRY_LEAVING_MS: u32 = 20;

impl<D: Domain, C> Seat<D, C> {
    /// A seat whose session is being read from the log. Its first input must be [`Input::Woken`].
    pub fn new(stream: StreamId, user: UserId, new: Arc<NewSession>) -> Seat<D, C> {
        Seat {
            stream,
            user,
            new,
            stage: Stage::Waking,
            doing: None,
            training: false,
            last_told: Vec::new(),
            waiters: BTreeMap::new(),
            waiters_seen: 0,
            effects: Vec::new(),
        }
    }

    /// The session; none before it was read, and none while the seat is leaving.
    pub fn session(&self) -> Option<&Session<D>> {
        match &self.stage {
            Stage::Awake(session) => Some(session),
            Stage::Waking | Stage::Leaving(_) => None,
        }
    }

    /// True if the seat takes a request now. False: it waits for the result of an effect.
    pub fn is_ready(&self) -> bool {
        self.doing.is_none() && !matches!(self.stage, Stage::Waking)
    }

    /// The callers of a seat that died who have no answer yet.
    pub fn into_callers(self) -> Vec<C> {
        let doing = self.doing.and_then(Doing::into_caller);
        self.waiters.into_values().chain(doing).collect()
    }

    /// Takes an input.
    ///
    /// - returns: the effects, in the order in which they must be carried out.
    /// - panics: for a request while the seat is not ready ([`Seat::is_ready`]): then the stream
    ///   would have two writers (invariant `SingleWriter`).
    pub fn step(&mut self, input: Input<D, C>) -> Vec<Effect<D, C>> {
        let ends = input.ends_what_is_under_way();
        assert!(
            ends || self.is_ready(),
            "{}: a seat is given two at once",
            Invariant::SingleWriter
        );
        match input {
            Input::Woken(woken) => self.woken(woken),
            Input::Asked { ask, request, caller, at, fresh } => {
                self.asked(ask, request, caller, at, fresh);
            }
            Input::Appended(result) => self.appended(result),
            Input::ReadBack(records) => self.read_back(records),
            Input::Found(mind) => self.found(mind),
            Input::Trained { recipe, outcome, at, fresh } => {
                self.trained(recipe, outcome, at, fresh);
            }
            Input::TrainingRefused => {
                self.training = false;
                self.effects.push(Effect::SetTimer(Timer::AskForTraining, TRAIN_AGAIN));
            }
            Input::Due(Timer::AskForTraining) => self.ask_for_training(),
            Input::Due(Timer::Waiter(number)) => self.stop_waiting(number),
            Input::Sleep => self.sleep(),
        }
        std::mem::take(&mut self.effects)
    }

    fn woken(&mut self, woken: Result<Box<Session<D>>, Box<Response>>) {
        match woken {
            Ok(session) => {
                let is_new = !session.is_open();
                self.stage = Stage::Awake(session);
                if !is_new {
                    // A crash may have prevented this.
                    self.effects.push(Effect::CloseSegments);
                    self.ask_for_training();
                }
            }
            Err(response) => {
                tracing::error!(stream = %self.stream, ?response, "cannot be woken");
                self.leave_with(*response);
            }
        }
    }

    fn asked(
        &mut self,
        ask: PersonAsk,
        request: RequestId,
        caller: C,
        at: Timestamp,
        fresh: RequestId,
    ) {
        let session = match &self.stage {
            Stage::Awake(session) => session,
            Stage::Leaving(response) => return self.answer(Some(caller), response.clone()),
            Stage::Waking => unreachable!("`step` looks whether the seat is ready"),
        };
        match ask {
            PersonAsk::Command(command) => {
                let command = command.into();
                self.perform(Work { command, request, at, caller: Some(caller) }, fresh);
            }
            PersonAsk::Query(query) => match view::answer(&self.new, session, query) {
                Ok(response) => self.answer(Some(caller), response),
                Err(defect) => {
                    self.answer(Some(caller), *defect);
                    self.leave();
                }
            },
            PersonAsk::Wait { seconds } => self.wait(seconds, caller),
        }
    }

    fn wait(&mut self, seconds: u32, caller: C) {
        let Stage::Awake(session) = &self.stage else { return };
        if session.phase() != Phase::Learning {
            let status = view::status(&self.new, session);
            let waited = Waited { status, told: self.last_told.clone() };
            return self.answer(Some(caller), Response::Waited(waited));
        }
        if self.waiters.len() >= WAITERS_MAX {
            let full = Response::busy("too many are waiting for this training", 1_000);
            return self.answer(Some(caller), full);
        }
        self.waiters_seen += 1;
        self.waiters.insert(self.waiters_seen, caller);
        let limit = Duration::from_secs(u64::from(seconds.min(WAIT_S_MAX)));
        self.effects.push(Effect::SetTimer(Timer::Waiter(self.waiters_seen), limit));
    }

    /// The time of a waiting caller is over. Does nothing if the caller has an answer already.
    fn stop_waiting(&mut self, number: u64) {
        let Some(caller) = self.waiters.remove(&number) else { return };
        let Stage::Awake(session) = &self.stage else { return };
        let waited = Waited { status: session.status(), told: Vec::new() };
        self.answer(Some(caller), Response::Waited(waited));
    }

    fn ask_for_training(&mut self) {
        let Stage::Awake(session) = &self.stage else { return };
        if self.training {
            return;
        }
        if let Some(Outstanding::Retrain { recipe, lessons }) = session.outstanding() {
            self.training = true;
            self.effects.push(Effect::Train { recipe, lessons });
        }
    }

    fn sleep(&mut self) {
        // When everybody is put to sleep, callers may still wait for a training.
        let interrupted = "the request was interrupted; send it again";
        self.answer_waiters_with(&Response::busy(interrupted, RETRY_LEAVING_MS));
        if self.session().is_some_and(Session::is_open) {
            self.effects.push(Effect::KeepSnapshot);
        }
        self.effects.push(Effect::Stop);
    }

    /// Asks the directory to remove this seat and to put it to sleep. In this way no message is
    /// lost: requests until then are answered with busy, and the next request wakes a new seat.
    fn leave(&mut self) {
        self.leave_with(Response::busy("the session is read from the log again", RETRY_LEAVING_MS));
    }

    /// As [`Seat::leave`], with another answer.
    fn leave_with(&mut self, response: Response) {
        self.answer_waiters_with(&response);
        self.stage = Stage::Leaving(response);
        self.effects.push(Effect::Leave);
    }

    fn answer_waiters_with(&mut self, response: &Response) {
        for (_, caller) in std::mem::take(&mut self.waiters) {
            self.effects.push(Effect::Answer { caller, response: response.clone() });
        }
    }

    /// - `caller`: none if the service itself asked.
    fn answer(&mut self, caller: Option<C>, response: Response) {
        self.effects.extend(caller.map(|caller| Effect::Answer { caller, response }));
    }
}
