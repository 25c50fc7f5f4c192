//! One turn: decide, append, and only then apply and answer. No other code does this.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use super::{Effect, Seat, Stage};
use crate::actors::defect::defect;
use crate::client::{ErrorCode, Phase, Reply, Response, Told, Waited};
use crate::events::Record;
use crate::ids::{Digest, RequestId, Timestamp};
use crate::learning::Mind;
use crate::sabotage;
use crate::session::{Command, Divergence, Proposed, Session, Turn};
use crate::store::{AppendError, Durable};
use crate::world::Domain;

/// A command to carry out.
pub(super) struct Work<C> {
    pub command: Command,
    pub request: RequestId,
    /// The time of the wall clock. The session never goes back in time.
    pub at: Timestamp,
    /// None if the service itself asks.
    pub caller: Option<C>,
}

/// What the seat is doing.
pub(super) enum Doing<C> {
    /// Recording that the person is new. The first command is decided after that.
    Opening(Work<C>, RequestId),
    /// Recording a turn.
    Appending(Work<C>),
    /// Reading the records of the first answer to this request id.
    ReadingBack(Work<C>),
    /// Finding the mind that the records name.
    Equipping(Work<C>, Reply),
}

impl<C> Doing<C> {
    pub fn into_caller(self) -> Option<C> {
        match self {
            Doing::Opening(work, _) | Doing::Appending(work) => work.caller,
            Doing::ReadingBack(work) | Doing::Equipping(work, _) => work.caller,
        }
    }
}

impl<D: Domain, C> Seat<D, C> {
    /// Decides, and asks for the append.
    ///
    /// - `fresh`: an unused request id, for the record that the person is new.
    pub(super) fn perform(&mut self, work: Work<C>, fresh: RequestId) {
        let Stage::Awake(session) = &self.stage else { return };
        let is_new = !session.is_open();
        if is_new && let Err(error) = self.user.check_new() {
            let message = format!("a new person cannot have this name: {error}");
            return self.answer(work.caller, Response::error(ErrorCode::Refused, message));
        }
        let at = session.next_at(work.at);
        // Unwind-safe, because `propose` only reads: a panic leaves the session as it was.
        let proposed = catch_unwind(AssertUnwindSafe(|| {
            sabotage::point("handler");
            session.propose(&work.command, work.request, at)
        }));
        match proposed {
            // A person is recorded with the first command that is not declined.
            Ok(Ok(Proposed::Turn(_))) if is_new => self.open(work, fresh),
            Ok(Ok(Proposed::Turn(turn))) => self.append(turn, Doing::Appending(work)),
            Ok(Ok(Proposed::Repeat { first, last })) => {
                self.effects.push(Effect::ReadBack { request: work.request, first, last });
                self.doing = Some(Doing::ReadingBack(work));
            }
            Ok(Ok(Proposed::Defect(divergence))) => {
                let response = self.cannot_be_applied(session, divergence);
                self.answer(work.caller, response);
            }
            Ok(Err(rejection)) => self.answer(work.caller, rejection.into()),
            Err(panic) => {
                self.answer(work.caller, defect("deciding", &*panic));
                self.leave();
            }
        }
    }

    fn append(&mut self, turn: Turn, doing: Doing<C>) {
        let Turn { after, batch } = turn;
        self.effects.push(Effect::Append { after, batch });
        self.doing = Some(doing);
    }

    /// Records that the person is new. The first command is decided when that is durable.
    fn open(&mut self, first: Work<C>, fresh: RequestId) {
        let Stage::Awake(session) = &self.stage else { return };
        let command = Command::Open {
            user: self.user.clone(),
            recipe_text: self.new.recipe_text.clone(),
            mind: self.new.base.digest(),
        };
        let reason = match session.propose(&command, fresh, session.next_at(first.at)) {
            Ok(Proposed::Turn(turn)) => return self.append(turn, Doing::Opening(first, fresh)),
            Ok(Proposed::Repeat { .. }) => "a request id was drawn twice".to_owned(),
            Ok(Proposed::Defect(divergence)) => divergence.to_string(),
            Err(rejection) => rejection.to_string(),
        };
        self.answer(first.caller, Response::error(ErrorCode::Unavailable, reason));
    }

    pub(super) fn appended(&mut self, result: Result<Durable, AppendError>) {
        match (self.doing.take(), result) {
            (Some(Doing::Opening(first, fresh)), Ok(durable)) => self.opened(first, fresh, durable),
            (Some(Doing::Appending(work)), Ok(durable)) => self.settle(work, durable),
            (Some(Doing::Opening(work, _) | Doing::Appending(work)), Err(error)) => {
                self.append_failed(work, &error);
            }
            (other, _) => self.doing = other,
        }
    }

    fn opened(&mut self, first: Work<C>, fresh: RequestId, durable: Durable) {
        let Stage::Awake(session) = &mut self.stage else { return };
        let settled = session.settle(&durable);
        if settled.is_ok() {
            session.install(self.new.base.clone());
        }
        self.effects.push(Effect::Publish(durable));
        match settled {
            Ok(_) => {
                tracing::info!(stream = %self.stream, "a new person");
                self.perform(first, fresh);
            }
            Err(divergence) => self.disagrees(first.caller, &divergence),
        }
    }

    /// Applies a durable turn.
    fn settle(&mut self, work: Work<C>, durable: Durable) {
        let Stage::Awake(session) = &mut self.stage else { return };
        // A panic may leave the session half changed. Then the session is not used again.
        let settled = catch_unwind(AssertUnwindSafe(|| {
            sabotage::point("settling");
            session.settle(&durable)
        }));
        self.effects.push(Effect::Publish(durable));
        match settled {
            Ok(Ok(reply)) => self.equip(work, reply),
            Ok(Err(divergence)) => self.disagrees(work.caller, &divergence),
            Err(panic) => {
                self.answer(work.caller, defect("applying", &*panic));
                self.leave();
            }
        }
    }

    /// Finds the mind that the records name, if it is another one now.
    fn equip(&mut self, work: Work<C>, reply: Reply) {
        let Stage::Awake(session) = &self.stage else { return };
        if let Command::FinishRetrain { .. } = work.command {
            self.last_told = reply.told.clone();
        }
        match session.mind_wanted() {
            None => self.finish(work, reply),
            Some(mind) => {
                self.effects.push(Effect::FindMind(mind));
                self.doing = Some(Doing::Equipping(work, reply));
            }
        }
    }

    pub(super) fn found(&mut self, mind: Option<Arc<Mind>>) {
        let Some(Doing::Equipping(work, reply)) = self.doing.take() else { return };
        let Stage::Awake(session) = &mut self.stage else { return };
        match mind {
            Some(mind) => {
                session.install(mind);
                self.finish(work, reply);
            }
            // Rare, because the memory of minds is large. The next waking finds it in the store or
            // trains it.
            None => {
                self.answer(work.caller, Response::Reply(reply));
                self.leave();
            }
        }
    }

    /// Does what is due after every turn, and answers.
    fn finish(&mut self, work: Work<C>, reply: Reply) {
        let trained = matches!(work.command, Command::FinishRetrain { .. });
        if trained {
            self.effects.push(Effect::ForgetOldMinds);
        }
        self.ask_for_training();
        self.answer_waiters();
        let told = |is: fn(&Told) -> bool| reply.told.iter().any(is);
        if told(|told| matches!(told, Told::EpisodeEnded { .. })) {
            self.effects.push(Effect::KeepSnapshot);
        }
        if told(|told| matches!(told, Told::EpisodeEnded { .. } | Told::Closed { .. })) {
            self.effects.push(Effect::CloseSegments);
        }
        self.answer(work.caller, Response::Reply(reply));
    }

    fn answer_waiters(&mut self) {
        let Stage::Awake(session) = &self.stage else { return };
        if session.phase() == Phase::Learning {
            return;
        }
        let waited = Waited { status: session.status(), told: self.last_told.clone() };
        self.answer_waiters_with(&Response::Waited(waited));
    }

    /// The turn is dropped, and the state did not change. The seat continues only if it is certain
    /// that nothing was appended. Otherwise a new seat reads the log.
    fn append_failed(&mut self, work: Work<C>, error: &AppendError) {
        tracing::warn!(stream = %self.stream, %error, "an append failed");
        if error.is_fatal() {
            // Before the answer, because the caller may look at once whether the service has
            // failed.
            self.effects.push(Effect::Fatal(error.to_string()));
        }
        let response = match error.retry_after_ms() {
            Some(after_ms) => Response::busy(error.to_string(), after_ms),
            None => Response::error(ErrorCode::Unavailable, error.to_string()),
        };
        self.answer(work.caller, response);
        match error.is_certain() {
            // A training that could not be recorded is still due.
            true => self.ask_for_training(),
            false => self.leave(),
        }
    }

    /// Answers a repeated request id from the records of the first answer.
    pub(super) fn read_back(&mut self, records: Result<Vec<Record>, String>) {
        let Some(Doing::ReadingBack(work)) = self.doing.take() else { return };
        let Stage::Awake(session) = &self.stage else { return };
        let records = match records {
            Ok(records) => records,
            Err(reason) => {
                let response = Response::error(ErrorCode::Unavailable, reason);
                return self.answer(work.caller, response);
            }
        };
        // It may set up the stage again, and that code may have panicked before.
        let repeated = catch_unwind(AssertUnwindSafe(|| session.repeat(&work.command, &records)));
        let response = match repeated {
            Ok(Ok(reply)) => Response::Reply(reply),
            Ok(Err(rejection)) => rejection.into(),
            Err(panic) => defect("comparing a repeated request", &*panic),
        };
        self.answer(work.caller, response);
    }

    /// Records the result of a training, in the same way as an utterance.
    pub(super) fn trained(
        &mut self,
        recipe: Digest,
        outcome: Result<Arc<Mind>, String>,
        at: Timestamp,
        fresh: RequestId,
    ) {
        self.training = false;
        let outcome = outcome.map(|mind| {
            let found = (mind.digest(), mind.report().clone());
            self.effects.push(Effect::Remember(mind));
            found
        });
        let command = Command::FinishRetrain { recipe, outcome };
        self.perform(Work { command, request: fresh, at, caller: None }, fresh);
        if self.doing.is_none() {
            // It was declined. Another training may be due.
            self.ask_for_training();
        }
    }

    /// The answer to a command whose events cannot be applied. Nothing was appended, the session
    /// did not change, and the seat continues.
    fn cannot_be_applied(&self, session: &Session<D>, divergence: Divergence) -> Response {
        // Both values may contain what a person said, so the log has only the digest of the state.
        let Divergence { seq, field, .. } = &divergence;
        let (stream, state) = (&self.stream, session.state_digest());
        tracing::error!(
            %stream, %seq, field, %state,
            "a defect: what was decided cannot be applied; nothing was recorded"
        );
        tracing::debug!(%stream, %divergence, "what the defect was");
        Response::error(
            ErrorCode::Internal,
            format!(
                "a defect of apprentice while deciding; nothing was recorded, please report it: \
                 {divergence}"
            ),
        )
    }

    /// The records contradict the state. A new seat reads them from the log.
    fn disagrees(&mut self, caller: Option<C>, divergence: &Divergence) {
        let law = divergence.law().map(tracing::field::display);
        tracing::error!(stream = %self.stream, law, %divergence, "binary and log disagree");
        self.answer(caller, Response::error(ErrorCode::Internal, divergence.to_string()));
        self.leave();
    }
}
