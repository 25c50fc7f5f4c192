use std::collections::VecDeque;
use std::sync::Arc;

use actix::fut::{LocalBoxActorFuture, ready};
use actix::{
    Actor, ActorContext, ActorFutureExt, AsyncContext, AtomicResponse, Context, Handler, WrapFuture,
};

use super::directory::actor::{Leaving, Sleep, Waking};
use super::seat::{Effect, Input, Seat};
use super::shared::{self, Shared};
use super::submit::{AnswerTo, Submit};
use super::trainer::{Train, Trained};
use crate::client::{ErrorCode, Response};
use crate::limits::MAILBOX_MAX;
use crate::replay;
use crate::store::Pending;
use crate::world::Domain;

/// Carries out the effects of a person's [`Seat`], and gives it the results.
pub(super) struct UserActor<D: Domain> {
    shared: Arc<Shared<D>>,
    waking: Waking,
    seat: Seat<D, AnswerTo>,
}

/// Work that must end before the actor takes the next message.
type Atomic<D> = LocalBoxActorFuture<UserActor<D>, ()>;

/// The result of an effect.
enum Outcome<D: Domain> {
    Done,
    Known(Input<D, AnswerTo>),
    Pending(Pending),
}

impl<D: Domain> UserActor<D> {
    pub fn new(shared: Arc<Shared<D>>, waking: Waking) -> UserActor<D> {
        let (stream, user) = (waking.stream.clone(), waking.user.clone());
        let seat = Seat::new(stream, user, shared.new_session().clone());
        UserActor { shared, waking, seat }
    }

    /// Gives `input` to the seat and carries out all effects that follow. While the log appends,
    /// the actor takes no other message, so the stream has one writer.
    fn step(&mut self, input: Input<D, AnswerTo>, ctx: &mut Context<Self>) -> Atomic<D> {
        let mut inputs = VecDeque::from([input]);
        let mut appending = None;
        while let Some(input) = inputs.pop_front() {
            for effect in self.seat.step(input) {
                match self.carry_out(effect, ctx) {
                    Outcome::Done => {}
                    Outcome::Known(input) => inputs.push_back(input),
                    Outcome::Pending(pending) => appending = Some(pending),
                }
            }
        }
        match appending {
            None => Box::pin(ready(())),
            Some(pending) => Box::pin(
                pending
                    .into_actor(self)
                    .then(|result, actor, ctx| actor.step(Input::Appended(result), ctx)),
            ),
        }
    }

    fn carry_out(&mut self, effect: Effect<D, AnswerTo>, ctx: &mut Context<Self>) -> Outcome<D> {
        let (shared, stream) = (&self.shared, &self.waking.stream);
        match effect {
            Effect::Append { after, batch } => {
                return Outcome::Pending(shared.log().append(stream, after, batch));
            }
            Effect::ReadBack { request, first, last } => {
                let records = replay::read_back(shared.log(), stream, request, (first, last));
                return Outcome::Known(Input::ReadBack(records));
            }
            Effect::FindMind(digest) => {
                return Outcome::Known(Input::Found(shared.mind(&stream.tenant, digest)));
            }
            Effect::Train { recipe, lessons } => {
                let train = Train {
                    stream: stream.clone(),
                    recipe,
                    lessons,
                    tell: ctx.address().recipient(),
                    attention: self.waking.presence.attend(),
                };
                if !shared.queue_training(train) {
                    tracing::warn!(%stream, "the tenant's queue for training is full");
                    return Outcome::Known(Input::TrainingRefused);
                }
            }
            Effect::SetTimer(timer, after) => {
                ctx.run_later(after, move |actor, ctx| {
                    let step = actor.step(Input::Due(timer), ctx);
                    ctx.wait(step);
                });
            }
            Effect::Leave => {
                let generation = self.waking.generation;
                self.waking.leaving.do_send(Leaving { stream: stream.clone(), generation });
            }
            Effect::KeepSnapshot => {
                self.seat
                    .session()
                    .inspect(|session| shared::keep_snapshot(shared, stream, session));
            }
            Effect::ForgetOldMinds => {
                self.seat.session().inspect(|it| shared::forget_old_minds(shared, stream, it));
            }
            Effect::Answer { caller, response } => caller.send(response),
            Effect::Remember(mind) => shared.remember(&stream.tenant, mind),
            Effect::CloseSegments => shared.registrar().close(stream),
            Effect::Publish(durable) => shared.notifications().note(stream, &durable),
            Effect::Fatal(reason) => shared.failure().report(reason),
            Effect::Stop => ctx.stop(),
        }
        Outcome::Done
    }
}

impl<D: Domain> Actor for UserActor<D> {
    type Context = Context<Self>;

    fn started(&mut self, ctx: &mut Context<Self>) {
        ctx.set_mailbox_capacity(MAILBOX_MAX);
        let (shared, stream) = (self.shared.clone(), self.waking.stream.clone());
        // On another thread: reading a long stream or training a mind must not delay the other
        // people of this arbiter.
        let rebuilt = tokio::task::spawn_blocking(move || shared::wake(&shared, &stream));
        ctx.wait(rebuilt.into_actor(self).then(|result, actor, ctx| {
            let woken = result.unwrap_or_else(|panic| {
                let message = format!("waking failed: {panic}");
                Err(Box::new(Response::error(ErrorCode::Internal, message)))
            });
            actor.step(Input::Woken(woken.map(Box::new)), ctx)
        }));
    }
}

impl<D: Domain> Handler<Submit> for UserActor<D> {
    type Result = AtomicResponse<Self, ()>;

    fn handle(&mut self, submit: Submit, ctx: &mut Context<Self>) -> Self::Result {
        submit.must_be_for(&self.waking.stream);
        let Submit { request, ask, answer: caller, .. } = submit;
        let (at, fresh) = (self.shared.now(), shared::fresh_request());
        AtomicResponse::new(self.step(Input::Asked { ask, request, caller, at, fresh }, ctx))
    }
}

impl<D: Domain> Handler<Trained> for UserActor<D> {
    type Result = AtomicResponse<Self, ()>;

    fn handle(&mut self, trained: Trained, ctx: &mut Context<Self>) -> Self::Result {
        let Trained { recipe, outcome, attention } = trained;
        let (at, fresh) = (self.shared.now(), shared::fresh_request());
        let step = self.step(Input::Trained { recipe, outcome, at, fresh }, ctx);
        // The person stays awake until the training is recorded.
        AtomicResponse::new(Box::pin(step.map(move |(), _, _| drop(attention))))
    }
}

impl<D: Domain> Handler<Sleep> for UserActor<D> {
    type Result = AtomicResponse<Self, ()>;

    fn handle(&mut self, _: Sleep, ctx: &mut Context<Self>) -> Self::Result {
        AtomicResponse::new(self.step(Input::Sleep, ctx))
    }
}
