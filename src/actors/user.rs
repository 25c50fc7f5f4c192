use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Duration;

use actix::fut::{LocalBoxActorFuture, ready};
use actix::{
    Actor, ActorContext, ActorFutureExt, AsyncContext, AtomicResponse, Context, Handler, WrapFuture,
};

use super::directory::{Leaving, Sleep, Waking};
use super::life::{self, Life};
use super::response::{Ask, ErrorCode, Rejected, Response, Waited};
use super::submit::{AnswerTo, Submit};
use super::trainer::{Train, Trained};
use crate::events::{Durable, Report};
use crate::ids::{RequestId, Seq};
use crate::learning;
use crate::limits::{MAILBOX_MAX, WAIT_S_MAX, WAITERS_MAX};
use crate::sabotage;
use crate::session::{
    Command, Divergence, Outstanding, Phase, Proposed, Query, RejectionCode, Reply, Session,
    Status, Told, Turn,
};
use crate::store::AppendError;
use crate::world::Domain;

/// One person, awake. Owns the session and is the only writer of its stream; while an append is
/// in flight it handles nothing else, so it needs no lock.
pub(super) struct UserActor<D: Domain> {
    life: Arc<Life<D>>,
    waking: Waking,
    stage: Stage<D>,
    /// A training is queued or runs.
    training: bool,
    /// How the last training ended.
    last_told: Vec<Told>,
    waiters: Vec<(u64, AnswerTo)>,
    waiters_seen: u64,
}

enum Stage<D: Domain> {
    /// The session is being rebuilt from the log; messages wait.
    Waking,
    Awake(Box<Session<D>>),
    /// Cannot go on; whatever still arrives gets this answer, until the directory says sleep.
    Leaving(Response),
}

/// A step of work that must be over before the next message is handled.
type Atomic<D> = LocalBoxActorFuture<UserActor<D>, ()>;

/// Seconds after which a training is asked for again when the trainers' queue was full.
const TRAIN_AGAIN_S: u64 = 1;
/// Milliseconds after which a request may be sent again that met an actor on its way out.
const RETRY_LEAVING_MS: u32 = 20;
/// Milliseconds after which a request may be sent again that met another writer, or a full log.
const RETRY_APPEND_MS: u32 = 100;

impl<D: Domain> UserActor<D> {
    pub fn new(life: Arc<Life<D>>, waking: Waking) -> UserActor<D> {
        UserActor {
            life,
            waking,
            stage: Stage::Waking,
            training: false,
            last_told: Vec::new(),
            waiters: Vec::new(),
            waiters_seen: 0,
        }
    }

    fn done() -> Atomic<D> {
        Box::pin(ready(()))
    }

    /// Stops in the only way that loses no message: the directory forgets this actor, and then
    /// sends it to sleep. Whoever asks in between is told to ask again, which wakes a new one.
    fn leave(&mut self) {
        self.leave_with(Response::busy("the session is read from the log again", RETRY_LEAVING_MS));
    }

    /// As [`UserActor::leave`], when a new actor would fare no better: until the directory has
    /// heard of it, everybody is answered with `response`.
    fn leave_with(&mut self, response: Response) {
        self.waiters.clear();
        self.stage = Stage::Leaving(response);
        let (stream, generation) = (self.waking.stream.clone(), self.waking.generation);
        self.waking.leaving.do_send(Leaving { stream, generation });
    }

    fn ask(
        &mut self,
        ask: Ask,
        request: RequestId,
        answer: AnswerTo,
        ctx: &mut Context<Self>,
    ) -> Atomic<D> {
        let session = match &self.stage {
            Stage::Awake(session) => session,
            Stage::Leaving(response) => {
                answer.send(response.clone());
                return Self::done();
            }
            // `Context::wait` keeps messages away while the session is rebuilt.
            Stage::Waking => return Self::done(),
        };
        match ask {
            Ask::Command(command) => return self.perform(command, request, Some(answer)),
            Ask::Query(query) => match view(&self.life, session, query) {
                Ok(response) => answer.send(response),
                Err(panic) => {
                    answer.send(*panic);
                    self.leave();
                }
            },
            Ask::Wait { seconds } => self.wait(seconds, answer, ctx),
            Ask::Archive(_) => unreachable!("the archive answers questions about the log"),
            Ask::Feed => unreachable!("the gateway knows where the feed is"),
            Ask::Hello => unreachable!("the directory answers hello"),
            Ask::Order(_) => unreachable!("the gateway hands orders to the registrar"),
        }
        Self::done()
    }

    fn wait(&mut self, seconds: u32, answer: AnswerTo, ctx: &mut Context<Self>) {
        let Stage::Awake(session) = &self.stage else { return };
        if session.phase() != Phase::Learning {
            let status = status(&self.life, session);
            answer.send(Response::Waited(Waited { status, told: self.last_told.clone() }));
            return;
        }
        if self.waiters.len() >= WAITERS_MAX {
            answer.send(Response::busy("too many are waiting for this training", 1_000));
            return;
        }
        self.waiters_seen += 1;
        let number = self.waiters_seen;
        self.waiters.push((number, answer));
        let limit = Duration::from_secs(u64::from(seconds.min(WAIT_S_MAX)));
        ctx.run_later(limit, move |actor, _| {
            let Some(place) = actor.waiters.iter().position(|(waiter, _)| *waiter == number) else {
                return;
            };
            let (_, answer) = actor.waiters.remove(place);
            if let Stage::Awake(session) = &actor.stage {
                let waited = Waited { status: session.status(), told: Vec::new() };
                answer.send(Response::Waited(waited));
            }
        });
    }

    /// Decide, append, and only then apply and answer. The future is the append.
    fn perform(
        &mut self,
        command: Command,
        request: RequestId,
        answer: Option<AnswerTo>,
    ) -> Atomic<D> {
        let Stage::Awake(session) = &self.stage else { return Self::done() };
        let is_new = !session.is_open();
        if let Some(Err(refused)) = is_new.then(|| life::check_name(&self.waking.user)) {
            respond(answer, *refused);
            return Self::done();
        }
        let at = session.next_at(self.life.now());
        // Rust cannot know it, but `propose` only reads: a panic leaves the session as it was.
        let proposed = catch_unwind(AssertUnwindSafe(|| {
            sabotage::point("handler");
            session.propose(&command, request, at)
        }));
        let turn = match proposed {
            Ok(Ok(Proposed::Turn(turn))) => turn,
            Ok(Ok(Proposed::Repeat { first, last })) => {
                let response = self.repeat(session, &command, first, last);
                respond(answer, response);
                return Self::done();
            }
            Ok(Ok(Proposed::Defect(divergence))) => {
                respond(answer, self.cannot_be_applied(session, divergence));
                return Self::done();
            }
            Ok(Err(rejection)) => {
                respond(answer, rejection.into());
                return Self::done();
            }
            Err(panic) => {
                respond(answer, defect("deciding", &*panic));
                self.leave();
                return Self::done();
            }
        };
        // What is declined makes nobody; this is the first command that is not.
        if is_new {
            return self.open(command, request, answer);
        }
        let Turn { after, batch } = turn;
        let pending = self.life.log().append(&self.waking.stream, after, batch);
        Box::pin(pending.into_actor(self).map(move |result, actor, ctx| match result {
            Ok(durable) => {
                actor.life.growths().note(&actor.waking.stream, &durable);
                actor.settle(&command, &durable, answer, ctx);
            }
            Err(error) => actor.append_failed(error, answer),
        }))
    }

    /// Records who is new, and then carries out their first command.
    fn open(&mut self, first: Command, request: RequestId, answer: Option<AnswerTo>) -> Atomic<D> {
        let Stage::Awake(session) = &self.stage else { return Self::done() };
        let Turn { after, batch } = match life::open(&self.life, session, &self.waking.user) {
            Ok(turn) => turn,
            Err(response) => {
                respond(answer, *response);
                return Self::done();
            }
        };
        let pending = self.life.log().append(&self.waking.stream, after, batch);
        Box::pin(pending.into_actor(self).then(move |result, actor, _| {
            let durable = match result {
                Ok(durable) => durable,
                Err(error) => {
                    actor.append_failed(error, answer);
                    return Self::done();
                }
            };
            actor.life.growths().note(&actor.waking.stream, &durable);
            let Stage::Awake(session) = &mut actor.stage else { return Self::done() };
            if let Err(divergence) = session.settle(&durable) {
                tracing::error!(stream = %actor.waking.stream, %divergence, "binary and log disagree");
                respond(answer, Response::error(ErrorCode::Internal, divergence.to_string()));
                actor.leave();
                return Self::done();
            }
            session.install(actor.life.base().clone());
            tracing::info!(stream = %actor.waking.stream, "somebody new");
            actor.perform(first, request, answer)
        }))
    }

    /// The answer to a request id that was answered before, by the records `first` to `last`.
    fn repeat(&self, session: &Session<D>, command: &Command, first: Seq, last: Seq) -> Response {
        let records = match self.life.records(&self.waking.stream, first, last) {
            Ok(records) => records,
            Err(reason) => return Response::error(ErrorCode::Unavailable, reason),
        };
        // A stage may be set once more for it, in the same code that may have panicked before.
        match catch_unwind(AssertUnwindSafe(|| session.repeat(command, &records))) {
            Ok(Ok(reply)) => Response::Reply(reply),
            Ok(Err(rejection)) => rejection.into(),
            Err(panic) => defect("comparing a repeated request", &*panic),
        }
    }

    /// The answer to a command whose events the fold refuses. Nothing was appended, and the session
    /// did not change: it goes on.
    fn cannot_be_applied(&self, session: &Session<D>, divergence: Divergence) -> Response {
        // Both values may hold what a person said; the digest finds the state that shows it again.
        let Divergence { seq, field, .. } = &divergence;
        let (stream, state) = (&self.waking.stream, session.state_digest());
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

    fn settle(
        &mut self,
        command: &Command,
        durable: &Durable,
        answer: Option<AnswerTo>,
        ctx: &mut Context<Self>,
    ) {
        let Stage::Awake(session) = &mut self.stage else { return };
        // A panic may leave the session half changed: it is then dropped, never used again.
        let settled = catch_unwind(AssertUnwindSafe(|| {
            sabotage::point("settling");
            session.settle(durable)
        }));
        let reply = match settled {
            Ok(Ok(reply)) => reply,
            Ok(Err(divergence)) => {
                tracing::error!(stream = %self.waking.stream, %divergence, "binary and log disagree");
                respond(answer, Response::error(ErrorCode::Internal, divergence.to_string()));
                return self.leave();
            }
            Err(panic) => {
                respond(answer, defect("applying", &*panic));
                return self.leave();
            }
        };
        if let Command::FinishRetrain { .. } = command {
            self.last_told = reply.told.clone();
        }
        if !self.equip() {
            respond(answer, Response::Reply(reply));
            return self.leave();
        }
        if let (Command::FinishRetrain { .. }, Stage::Awake(session)) = (command, &self.stage) {
            life::forget_old_minds(&self.life, &self.waking.stream, session);
        }
        self.after(&reply, ctx);
        respond(answer, Response::Reply(reply));
    }

    /// Gives the session the mind that its state names since a training was recorded.
    ///
    /// - returns: whether it has it. Not having it is rare, the memory of minds being large:
    ///   waking again finds or trains it.
    fn equip(&mut self) -> bool {
        let Stage::Awake(session) = &mut self.stage else { return false };
        let Some(wanted) = session.mind_wanted() else { return true };
        let mind = self.life.mind(&self.waking.stream.tenant, wanted);
        let found = mind.is_some();
        mind.into_iter().for_each(|mind| session.install(mind));
        found
    }

    /// What is due after every turn and every activation.
    fn after(&mut self, reply: &Reply, ctx: &mut Context<Self>) {
        self.ask_for_training(ctx);
        let Stage::Awake(session) = &self.stage else { return };
        if session.phase() != Phase::Learning {
            let waited = Waited { status: session.status(), told: self.last_told.clone() };
            for (_, answer) in self.waiters.drain(..) {
                answer.send(Response::Waited(waited.clone()));
            }
        }
        if reply.told.iter().any(|told| matches!(told, Told::EpisodeEnded { .. })) {
            life::keep_snapshot(&self.life, &self.waking.stream, session);
        }
        let ends = |told: &Told| matches!(told, Told::EpisodeEnded { .. } | Told::Closed { .. });
        if reply.told.iter().any(ends) {
            self.life.registrar().close(&self.waking.stream);
        }
    }

    fn ask_for_training(&mut self, ctx: &mut Context<Self>) {
        let Stage::Awake(session) = &self.stage else { return };
        if self.training {
            return;
        }
        let Some(Outstanding::Retrain { recipe, lessons }) = session.outstanding() else { return };
        self.training = self.life.queue_training(Train {
            stream: self.waking.stream.clone(),
            recipe,
            lessons,
            tell: ctx.address().recipient(),
            attention: self.waking.presence.attend(),
        });
        if !self.training {
            tracing::warn!(stream = %self.waking.stream, "the tenant's queue for training is full");
            ctx.run_later(Duration::from_secs(TRAIN_AGAIN_S), |actor, ctx| {
                actor.ask_for_training(ctx);
            });
        }
    }

    /// The state did not change: the turn is dropped. When it is certain that nothing was appended
    /// either, the actor goes on; otherwise a new one reads what the log says.
    fn append_failed(&mut self, error: AppendError, answer: Option<AnswerTo>) {
        let (stream, sentence) = (&self.waking.stream, error.to_string());
        tracing::warn!(%stream, %error, "an append failed");
        let (response, stays) = match error {
            AppendError::Busy { .. } => (Response::busy(sentence, RETRY_APPEND_MS), true),
            AppendError::TooLarge { .. } => {
                (Response::error(ErrorCode::Unavailable, sentence), true)
            }
            AppendError::Conflict { .. } => (Response::busy(sentence, RETRY_APPEND_MS), false),
            AppendError::Erased | AppendError::Key { .. } => {
                (Response::error(ErrorCode::Unavailable, sentence), false)
            }
            AppendError::Poisoned { .. } | AppendError::Gone => {
                self.life.failure().report(sentence.clone());
                (Response::error(ErrorCode::Unavailable, sentence), false)
            }
        };
        respond(answer, response);
        if !stays {
            self.leave();
        }
    }
}

impl<D: Domain> Actor for UserActor<D> {
    type Context = Context<Self>;

    fn started(&mut self, ctx: &mut Context<Self>) {
        ctx.set_mailbox_capacity(MAILBOX_MAX);
        let (life, stream) = (self.life.clone(), self.waking.stream.clone());
        // Reading a long stream, or training a mind again, must not hold up the other people of
        // this arbiter.
        let rebuilt = tokio::task::spawn_blocking(move || life::wake(&life, &stream));
        ctx.wait(rebuilt.into_actor(self).map(|result, actor, ctx| {
            let woken = result.unwrap_or_else(|panic| {
                let message = format!("waking failed: {panic}");
                Err(Box::new(Response::error(ErrorCode::Internal, message)))
            });
            match woken {
                Ok(session) => {
                    let is_new = !session.is_open();
                    actor.stage = Stage::Awake(Box::new(session));
                    if is_new {
                        return;
                    }
                    // What a crash kept from being closed.
                    actor.life.registrar().close(&actor.waking.stream);
                    actor.ask_for_training(ctx);
                }
                Err(response) => {
                    tracing::error!(stream = %actor.waking.stream, ?response, "cannot be woken");
                    actor.leave_with(*response);
                }
            }
        }));
    }
}

impl<D: Domain> Handler<Submit> for UserActor<D> {
    type Result = AtomicResponse<Self, ()>;

    fn handle(&mut self, submit: Submit, ctx: &mut Context<Self>) -> Self::Result {
        let Submit { request, ask, answer, .. } = submit;
        AtomicResponse::new(self.ask(ask, request, answer, ctx))
    }
}

impl<D: Domain> Handler<Trained> for UserActor<D> {
    type Result = AtomicResponse<Self, ()>;

    /// The result of a training enters through the same door as an utterance.
    fn handle(&mut self, trained: Trained, _: &mut Context<Self>) -> Self::Result {
        let Trained { recipe, outcome, attention } = trained;
        self.training = false;
        let outcome = outcome.map(|mind| {
            let learning::Report { exemplars, threshold, figures } = mind.report().clone();
            let digest = mind.digest();
            self.life.remember(&self.waking.stream.tenant, mind);
            (digest, Report { exemplars, threshold, figures })
        });
        let command = Command::FinishRetrain { recipe, outcome };
        let finish = self.perform(command, life::fresh_request(), None);
        AtomicResponse::new(Box::pin(finish.map(move |_, actor, ctx| {
            // Still outstanding if the append was refused; harmless if not.
            actor.ask_for_training(ctx);
            drop(attention);
        })))
    }
}

impl<D: Domain> Handler<Sleep> for UserActor<D> {
    type Result = ();

    fn handle(&mut self, _: Sleep, ctx: &mut Context<Self>) {
        if let Stage::Awake(session) = &self.stage
            && session.is_open()
        {
            life::keep_snapshot(&self.life, &self.waking.stream, session);
        }
        ctx.stop();
    }
}

fn respond(answer: Option<AnswerTo>, response: Response) {
    if let Some(answer) = answer {
        answer.send(response);
    }
}

/// - errors: what to answer when the session panicked; it is then to be left.
fn view<D: Domain>(
    life: &Life<D>,
    session: &Session<D>,
    query: Query,
) -> Result<Response, Box<Response>> {
    catch_unwind(AssertUnwindSafe(|| match query {
        Query::Status => Response::Status(status(life, session)),
        Query::Known if !session.is_open() => Response::Known(session.known_before(life.base())),
        Query::Known => Response::Known(session.known()),
        Query::Look => match session.look() {
            Some(view) => Response::Look(view),
            None => Response::Rejected(Rejected {
                code: RejectionCode::WrongPhase,
                message: "there is nothing to see before the first episode; start one".to_owned(),
            }),
        },
    }))
    .map_err(|panic| Box::new(defect("looking", &*panic)))
}

/// Of a name that nothing was recorded of: what its bearer would start with.
fn status<D: Domain>(life: &Life<D>, session: &Session<D>) -> Status {
    match session.is_open() {
        true => session.status(),
        false => session.status_before(life.recipe(), life.base()),
    }
}

fn defect(doing: &str, panic: &(dyn std::any::Any + Send)) -> Response {
    let words = life::panic_words(panic);
    // The words of a panic may hold what a person said: they are for who looks closely.
    tracing::error!(doing, "a defect; the actor is replaced by one from the log");
    tracing::debug!(doing, %words, "what the defect said");
    Response::error(
        ErrorCode::Internal,
        format!(
            "a defect of apprentice while {doing}; nothing was lost, please report it: {words}"
        ),
    )
}
