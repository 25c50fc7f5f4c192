use std::collections::HashMap;
use std::sync::Arc;

use actix::dev::SendError;
use actix::{Actor, AsyncContext, Context, Handler, Message, Recipient};

use super::{Directory, DirectoryEffect, DirectoryInput, Letter, NotDelivered, Undelivered};
use crate::actors::awake::{Awake, AwakeCount};
use crate::actors::meters::Meters;
use crate::actors::presence::{Attention, Presence};
use crate::actors::submit::{AnswerTo, Submit};
use crate::actors::{Erased, OrderError, Registrar};
use crate::client::{ErrorCode, Hello, Response};
use crate::ids::{StreamId, TenantId, UserId};
use crate::limits::DIRECTORY_QUEUE_MAX;
use crate::sabotage;
use crate::store::KeyError;

/// Carries out the effects of the [`Directory`].
pub(in crate::actors) struct DirectoryActor {
    directory: Directory<Submit, ErasureAnswer>,
    people: Box<dyn People>,
    /// The actors of the seats that the directory knows.
    addresses: HashMap<StreamId, Address>,
    hello: Hello,
    count: Arc<AwakeCount>,
    meters: Arc<Meters>,
    registrar: Registrar,
}

/// Starts people's actors. It hides the domain from the directory and from the frontends.
pub(in crate::actors) trait People: Send + Unpin + 'static {
    /// The stream of a person.
    ///
    /// - errors: the tenant's key cannot be read.
    fn stream_of(&self, tenant: &TenantId, user: &UserId) -> Result<StreamId, KeyError>;
    /// Starts an actor.
    fn wake(&self, waking: Waking) -> Address;
}

/// What a new actor gets.
pub(in crate::actors) struct Waking {
    pub stream: StreamId,
    pub user: UserId,
    /// Differs from that of earlier actors of the same person.
    pub generation: u64,
    pub presence: Presence,
    pub _awake: Awake,
    pub leaving: Recipient<Leaving>,
}

/// The address of one person's actor.
pub(in crate::actors) struct Address {
    pub submit: Recipient<Submit>,
    pub sleep: Recipient<Sleep>,
}

/// The last message to a person's actor, after the directory has removed it.
#[derive(Debug, Message)]
#[rtype(result = "()")]
pub(in crate::actors) struct Sleep;

/// An actor asks to be removed from the directory, because it cannot continue. The next request
/// starts a new one.
#[derive(Debug, Message)]
#[rtype(result = "()")]
pub(in crate::actors) struct Leaving {
    pub stream: StreamId,
    pub generation: u64,
}

/// Put everybody to sleep, and wake no person again.
#[derive(Debug, Message)]
#[rtype(result = "()")]
pub(in crate::actors) struct SleepAll;

/// Say which service this is.
#[derive(Message)]
#[rtype(result = "()")]
pub(in crate::actors) struct Greeting {
    pub answer: AnswerTo,
}

/// Erase a person.
#[derive(Message)]
#[rtype(result = "()")]
pub(in crate::actors) struct ErasePerson {
    pub tenant: TenantId,
    pub user: UserId,
    pub answer: ErasureAnswer,
}

/// How an erasure is answered: called once.
pub(in crate::actors) type ErasureAnswer = Box<dyn FnOnce(Erased) + Send>;

/// The erasure is over, or has failed. Requests in the person's name are accepted again.
#[derive(Message)]
#[rtype(result = "()")]
struct ErasureOver {
    stream: StreamId,
}

impl DirectoryActor {
    pub fn new(
        people: Box<dyn People>,
        awake_max: usize,
        hello: Hello,
        count: Arc<AwakeCount>,
        meters: Arc<Meters>,
        registrar: Registrar,
    ) -> DirectoryActor {
        let directory = Directory::new(awake_max);
        let addresses = HashMap::new();
        DirectoryActor { directory, people, addresses, hello, count, meters, registrar }
    }

    fn step(&mut self, input: DirectoryInput<Submit, ErasureAnswer>, ctx: &mut Context<Self>) {
        let mut inputs = vec![input];
        while let Some(input) = inputs.pop() {
            for effect in self.directory.step(input) {
                inputs.extend(self.carry_out(effect, ctx));
            }
        }
    }

    /// - returns: the result, if the directory must know it.
    fn carry_out(
        &mut self,
        effect: DirectoryEffect<Submit, ErasureAnswer>,
        ctx: &mut Context<Self>,
    ) -> Option<DirectoryInput<Submit, ErasureAnswer>> {
        match effect {
            DirectoryEffect::Wake { stream, user, generation, presence } => {
                let leaving = ctx.address().recipient();
                let _awake = self.count.enter();
                let waking =
                    Waking { stream: stream.clone(), user, generation, presence, _awake, leaving };
                self.addresses.insert(stream, self.people.wake(waking));
            }
            DirectoryEffect::Deliver { letter, generation, attention, again } => {
                return self.deliver(letter, generation, attention, again);
            }
            DirectoryEffect::Answer { content, response } => content.answer.send(response),
            DirectoryEffect::RefuseWaking { content, tenant, awake, limit } => {
                content.answer.send(*self.meters.refuse_waking(&tenant, awake, limit));
            }
            DirectoryEffect::RefuseCrowd { content, tenant } => {
                content.answer.send(self.meters.refuse_crowd(&tenant));
            }
            DirectoryEffect::NoteAwake { tenant, awake } => self.meters.note_awake(&tenant, awake),
            DirectoryEffect::Sleep { stream, .. } => {
                if let Some(address) = self.addresses.remove(&stream) {
                    address.sleep.do_send(Sleep);
                }
            }
            DirectoryEffect::Erase { stream, caller } => {
                let (to, over) = (ctx.address(), ErasureOver { stream: stream.clone() });
                self.registrar.erase(stream, move |erased| {
                    to.do_send(over);
                    caller(erased);
                });
            }
            DirectoryEffect::StillBusy { caller } => caller(Err(OrderError::StillBusy)),
            DirectoryEffect::LookAgain { stream, after } => {
                ctx.run_later(after, move |actor, ctx| {
                    actor.step(DirectoryInput::Look { stream }, ctx);
                });
            }
        }
        None
    }

    fn deliver(
        &self,
        letter: Letter<Submit>,
        generation: u64,
        attention: Attention,
        again: bool,
    ) -> Option<DirectoryInput<Submit, ErasureAnswer>> {
        let Letter { stream, user, awake_limit, mut content } = letter;
        content.answer.hold(attention);
        let (content, reason) = match self.addresses.get(&stream) {
            Some(address) => match address.submit.try_send(content) {
                Ok(()) => return None,
                Err(SendError::Full(content)) => (content, NotDelivered::Full),
                Err(SendError::Closed(content)) => (content, NotDelivered::Closed),
            },
            None => (content, NotDelivered::Closed),
        };
        let letter = Letter { stream, user, awake_limit, content };
        let undelivered = Undelivered { letter, generation, reason, again };
        Some(DirectoryInput::Undelivered(undelivered))
    }
}

impl Actor for DirectoryActor {
    type Context = Context<Self>;

    fn started(&mut self, ctx: &mut Context<Self>) {
        ctx.set_mailbox_capacity(DIRECTORY_QUEUE_MAX);
    }
}

impl Handler<Submit> for DirectoryActor {
    type Result = ();

    fn handle(&mut self, submit: Submit, ctx: &mut Context<Self>) {
        sabotage::point("directory");
        match self.people.stream_of(&submit.tenant, &submit.user) {
            Ok(stream) => {
                let awake_limit = self.meters.quotas(&submit.tenant).awake_users;
                let user = submit.user.clone();
                let letter = Letter { stream, user, awake_limit, content: submit };
                self.step(DirectoryInput::Asked(letter), ctx);
            }
            Err(error) => {
                // Only the operator is told where the key is.
                tracing::error!(tenant = %submit.tenant, %error, "a tenant's key cannot be used");
                let sentence = "this lab's key cannot be used now; an operator must look";
                submit.answer.send(Response::error(ErrorCode::Unavailable, sentence));
            }
        }
    }
}

impl Handler<Greeting> for DirectoryActor {
    type Result = ();

    fn handle(&mut self, greeting: Greeting, _: &mut Context<Self>) {
        greeting.answer.send(Response::Hello(self.hello.clone()));
    }
}

impl Handler<Leaving> for DirectoryActor {
    type Result = ();

    fn handle(&mut self, Leaving { stream, generation }: Leaving, ctx: &mut Context<Self>) {
        self.step(DirectoryInput::Leaving { stream, generation }, ctx);
    }
}

impl Handler<ErasePerson> for DirectoryActor {
    type Result = ();

    fn handle(&mut self, erase: ErasePerson, ctx: &mut Context<Self>) {
        let ErasePerson { tenant, user, answer: caller } = erase;
        match self.people.stream_of(&tenant, &user) {
            Ok(stream) => self.step(DirectoryInput::Erase { stream, caller }, ctx),
            Err(error) => caller(Err(OrderError::Key { tenant, error })),
        }
    }
}

impl Handler<ErasureOver> for DirectoryActor {
    type Result = ();

    fn handle(&mut self, ErasureOver { stream }: ErasureOver, ctx: &mut Context<Self>) {
        self.step(DirectoryInput::Erased { stream }, ctx);
    }
}

impl Handler<SleepAll> for DirectoryActor {
    type Result = ();

    fn handle(&mut self, _: SleepAll, ctx: &mut Context<Self>) {
        self.step(DirectoryInput::SleepAll, ctx);
    }
}
