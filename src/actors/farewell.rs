use std::time::{Duration, Instant};

use actix::{AsyncContext, Context, Handler, Message};

use super::directory::Directory;
use super::registrar::Erased;
use super::submit::Presence;
use super::{OrderError, Registrar};
use crate::ids::{StreamId, TenantId, UserId};

/// Erase a person: their actor goes to sleep for good, nobody wakes them meanwhile, and when
/// nothing of theirs is under way any more, the registrar destroys their key.
#[derive(Message)]
#[rtype(result = "()")]
pub(super) struct Farewell {
    pub tenant: TenantId,
    pub user: UserId,
    pub answer: Box<dyn FnOnce(Erased) + Send>,
}

/// The erasure is over, whichever way: requests in the person's name are taken again.
#[derive(Message)]
#[rtype(result = "()")]
struct Over {
    stream: StreamId,
}

/// How often it is looked whether the person is idle.
const LOOK: Duration = Duration::from_millis(5);
/// How long requests and trainings in hand may take.
const PATIENCE: Duration = Duration::from_secs(20);

impl Handler<Farewell> for Directory {
    type Result = ();

    fn handle(&mut self, farewell: Farewell, ctx: &mut Context<Self>) {
        let Farewell { tenant, user, answer } = farewell;
        let stream = match self.people.stream_of(&tenant, &user) {
            Ok(stream) => stream,
            Err(error) => return answer(Err(OrderError::Key { tenant, error })),
        };
        if self.leaving.contains(&stream) {
            return answer(Err(OrderError::StillBusy));
        }
        self.leaving.insert(stream.clone());
        let presence = self.presence_of(&stream);
        wait(Waiting { stream, presence, answer, since: Instant::now() }, self, ctx);
    }
}

struct Waiting {
    stream: StreamId,
    presence: Option<Presence>,
    answer: Box<dyn FnOnce(Erased) + Send>,
    since: Instant,
}

fn wait(waiting: Waiting, directory: &mut Directory, ctx: &mut Context<Directory>) {
    let Waiting { stream, presence, answer, since } = waiting;
    if presence.as_ref().is_none_or(Presence::is_idle) {
        // Struck off first: nothing in the person's name can be appended after this.
        directory.strike_off(&stream);
        let (registrar, to): (Registrar, _) = (directory.registrar.clone(), ctx.address());
        let over = Over { stream: stream.clone() };
        registrar.erase(stream, move |erased| {
            to.do_send(over);
            answer(erased);
        });
    } else if since.elapsed() > PATIENCE {
        directory.leaving.remove(&stream);
        answer(Err(OrderError::StillBusy));
    } else {
        ctx.run_later(LOOK, move |directory, ctx| {
            wait(Waiting { stream, presence, answer, since }, directory, ctx);
        });
    }
}

impl Handler<Over> for Directory {
    type Result = ();

    fn handle(&mut self, Over { stream }: Over, _: &mut Context<Self>) {
        self.leaving.remove(&stream);
    }
}
