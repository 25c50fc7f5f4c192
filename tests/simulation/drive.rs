//! What actix and trainers do in the service: carry out what seats and directory say, and tell them
//! what came of it.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, Waker};

use apprentice::actors::{
    DirectoryEffect, DirectoryInput, Effect, Input, Letter, NotDelivered, Undelivered,
};
use apprentice::client::{ErrorCode, PersonAsk, Reply, Response};
use apprentice::events::Head;
use apprentice::ids::{StreamId, Timestamp};
use apprentice::invariants::Invariant;
use apprentice::learning;
use apprentice::replay::{keep_mind, keep_snapshot, read_back, rebuild};
use apprentice::session::Session;
use apprentice::store::Pending;

use crate::defects::Defect;
use crate::oracle::{Broken, broken};
use crate::process::{Actor, Job, MAILBOX_MAX, Mail, Parcel, Ticket, ToDirectory};
use crate::system::{System, beginning};
use apprentice_testkit::toy::Bells;

type ToSeat = Input<Bells, Ticket>;

impl System {
    /// The directory takes its next message.
    pub fn step_directory(&mut self, process: usize) -> Result<(), Broken> {
        let delayed = self.dice.chance(90);
        let Some(message) = self.processes[process].next_to_directory(delayed) else {
            return Ok(());
        };
        let input = match message {
            ToDirectory::Asked { stream, user, parcel } => {
                let awake_limit = self.awake_limit;
                DirectoryInput::Asked(Letter { stream, user, awake_limit, content: parcel })
            }
            ToDirectory::Other(DirectoryInput::Leaving { stream, generation }) => {
                let present = self.processes[process].directory.generation_of(&stream);
                let stale = present.is_some_and(|present| present != generation);
                if stale {
                    self.counts.one("stale messages of seats");
                }
                let forgets = self.defect == Defect::ForgetsGenerations;
                let generation = present.filter(|_| forgets).unwrap_or(generation);
                DirectoryInput::Leaving { stream, generation }
            }
            ToDirectory::Other(DirectoryInput::Erase { stream, .. })
                if self.defect == Defect::ErasesAtOnce =>
            {
                return self.erase(process, stream);
            }
            ToDirectory::Other(input) => input,
        };
        self.directory(process, input)
    }

    fn directory(
        &mut self,
        process: usize,
        input: DirectoryInput<Parcel, usize>,
    ) -> Result<(), Broken> {
        for effect in self.processes[process].directory.step(input) {
            self.carry_out_directory(process, effect)?;
        }
        Ok(())
    }

    fn carry_out_directory(
        &mut self,
        process: usize,
        effect: DirectoryEffect<Parcel, usize>,
    ) -> Result<(), Broken> {
        let holder = &mut self.processes[process];
        match effect {
            DirectoryEffect::Wake { stream, user, generation, presence } => {
                self.note(|| format!("directory {process} wakes {stream} as {generation}"));
                let holder = &mut self.processes[process];
                let actor = Actor::new(stream, user, generation, presence, beginning().1.clone());
                holder.actors.insert(generation, actor);
            }
            DirectoryEffect::Deliver { mut letter, generation, attention, again } => {
                letter.content.ticket.attention = Some(attention);
                if self.defect == Defect::EvictsBusy {
                    letter.content.ticket.attention = None;
                }
                let reason = match holder.actors.get_mut(&generation) {
                    Some(actor) if actor.waiting() < MAILBOX_MAX => {
                        actor.mailbox.push_back(Mail::Asked(letter.content));
                        return Ok(());
                    }
                    Some(_) => {
                        self.counts.one("mailboxes full");
                        NotDelivered::Full
                    }
                    None => NotDelivered::Closed,
                };
                let undelivered = Undelivered { letter, generation, reason, again };
                return self.directory(process, DirectoryInput::Undelivered(undelivered));
            }
            DirectoryEffect::Answer { content, response } => {
                return self.answer(process, content.ticket, response);
            }
            DirectoryEffect::RefuseWaking { content, .. }
            | DirectoryEffect::RefuseCrowd { content, .. } => {
                self.counts.one("no room for one more awake");
                return self.answer(process, content.ticket, Response::busy("a crowd", 1));
            }
            DirectoryEffect::NoteAwake { .. } => {}
            DirectoryEffect::Sleep { generation, .. } => {
                self.note(|| format!("directory {process} sends {generation} to sleep"));
                let holder = &mut self.processes[process];
                if let Some(actor) = holder.actors.get_mut(&generation) {
                    // Another seat could be woken while this one still works.
                    if actor.speaks() && !holder.stops {
                        let how = format!("seat {generation} is busy and sent to sleep");
                        return Err(broken(Invariant::SingleWriter, how));
                    }
                    match self.defect {
                        Defect::SleepOvertakes => actor.mailbox.push_front(Mail::Sleep),
                        _ => actor.mailbox.push_back(Mail::Sleep),
                    }
                }
            }
            DirectoryEffect::Erase { stream, .. } => return self.erase(process, stream),
            DirectoryEffect::StillBusy { .. } => {}
            DirectoryEffect::LookAgain { stream, .. } => {
                self.note(|| format!("{stream} is too busy to be erased"));
                self.counts.one("busy people not erased yet");
                let look = ToDirectory::Other(DirectoryInput::Look { stream });
                self.processes[process].to_directory.push_back(look);
            }
        }
        Ok(())
    }

    /// Lets one of the seats that have something to do take a step.
    pub fn act_one(&mut self, process: usize) -> Result<(), Broken> {
        let actors = &self.processes[process].actors;
        let able: Vec<u64> =
            actors.values().filter(|it| it.can_act()).map(|it| it.generation).collect();
        if able.is_empty() {
            return Ok(());
        }
        let generation = *self.dice.of(&able);
        self.act(process, generation)
    }

    fn act(&mut self, process: usize, generation: u64) -> Result<(), Broken> {
        let Some(actor) = self.processes[process].actors.get_mut(&generation) else {
            return Ok(());
        };
        if !actor.woken {
            actor.woken = true;
            return self.wake(process, generation);
        }
        if let Some(pending) = actor.pending.take() {
            return self.poll(process, generation, pending);
        }
        let (at, fresh) = (Timestamp(self.now()), self.fresh_request());
        let defect = self.defect;
        let Some(actor) = self.processes[process].actors.get_mut(&generation) else {
            return Ok(());
        };
        let input = match actor.mailbox.pop_front() {
            None => return Ok(()),
            Some(Mail::Asked(Parcel { ticket, ask, request })) => {
                actor.current = Some((ticket.number, ticket.asked));
                let known = defect == Defect::ForgetsRequests
                    && actor
                        .seat
                        .session()
                        .is_some_and(|it| it.state().requests.find(request).is_some());
                let request = if known { fresh } else { request };
                if let PersonAsk::Wait { .. } = ask {
                    self.counts.one("waits");
                }
                Input::Asked { ask, request, caller: ticket, at, fresh }
            }
            Some(Mail::Trained { recipe, outcome, attention }) => {
                actor.attention = Some(attention);
                Input::Trained { recipe, outcome, at, fresh }
            }
            Some(Mail::Sleep) => Input::Sleep,
        };
        self.seat(process, generation, input)
    }

    /// Gives an input to a seat and carries out its effects.
    fn seat(&mut self, process: usize, generation: u64, input: ToSeat) -> Result<(), Broken> {
        let mut inputs = vec![input];
        while let Some(input) = inputs.pop() {
            let Some(actor) = self.processes[process].actors.get_mut(&generation) else {
                return Ok(());
            };
            for effect in actor.seat.step(input) {
                inputs.extend(self.carry_out(process, generation, effect)?);
            }
        }
        if let Some(actor) = self.processes[process].actors.get_mut(&generation)
            && actor.pending.is_none()
        {
            actor.attention = None;
        }
        Ok(())
    }

    /// - returns: how it ended, if the seat must know.
    fn carry_out(
        &mut self,
        process: usize,
        generation: u64,
        effect: Effect<Bells, Ticket>,
    ) -> Result<Option<ToSeat>, Broken> {
        let Some(actor) = self.processes[process].actors.get(&generation) else {
            return Ok(None);
        };
        let stream = actor.stream.clone();
        match effect {
            Effect::Append { after, batch } => {
                self.check_it_speaks(process, generation, &stream)?;
                let kinds: Vec<_> = batch.events.iter().map(|event| event.kind()).collect();
                self.note(|| {
                    format!("{generation} in {process} appends {kinds:?} after {}", after.seq)
                });
                let pending = self.store.log.append(&stream, after, batch);
                if let Some(actor) = self.processes[process].actors.get_mut(&generation) {
                    actor.pending = Some(pending);
                }
                self.misbehave(process, generation, after)?;
            }
            Effect::ReadBack { request, first, last } => {
                self.counts.one("repeated");
                let records = read_back(&*self.store.log, &stream, request, (first, last));
                return Ok(Some(Input::ReadBack(records)));
            }
            Effect::FindMind(digest) => {
                let mind = self.processes[process].minds.get(&stream.tenant, digest);
                return Ok(Some(Input::Found(mind)));
            }
            Effect::Remember(mind) => self.processes[process].minds.put(&stream.tenant, mind),
            Effect::Train { recipe, lessons } => {
                if self.defect == Defect::ForgetsTrainings {
                    return Ok(None);
                }
                if !self.quiet && self.dice.chance(10) {
                    self.counts.one("trainings refused");
                    return Ok(Some(Input::TrainingRefused));
                }
                let attention = actor.presence.attend();
                let job = Job { process, generation, stream, recipe, lessons, attention };
                self.jobs.push(job);
            }
            Effect::KeepSnapshot => {
                let session = self.processes[process].actors[&generation].seat.session();
                // A cache: a snapshot that cannot be kept is computed again.
                session.inspect(|it| drop(keep_snapshot(&self.store, &stream, it)));
            }
            Effect::ForgetOldMinds => {
                let session = actor.seat.session();
                let mind = session.and_then(Session::mind).map(|mind| mind.digest());
                let _ = self.store.models.keep_only(&stream, mind.as_slice());
            }
            Effect::CloseSegments => self.close_segments(process, stream)?,
            Effect::Publish(_) => {}
            Effect::SetTimer(timer, _) => {
                if let Some(actor) = self.processes[process].actors.get_mut(&generation) {
                    actor.timers.push(timer);
                }
            }
            Effect::Answer { caller, response } => self.answer(process, caller, response)?,
            Effect::Leave => self.leave(process, generation, stream)?,
            // The service ends; now, or after a few more moves.
            Effect::Fatal(_) if self.dice.chance(30) => self.crash(process),
            Effect::Fatal(_) => {}
            Effect::Stop => self.remove(process, generation)?,
        }
        Ok(None)
    }

    /// Only the seat that speaks for the person in this process appends.
    fn check_it_speaks(
        &self,
        process: usize,
        generation: u64,
        stream: &StreamId,
    ) -> Result<(), Broken> {
        match self.processes[process].directory.generation_of(stream) {
            Some(other) if other != generation => {
                let how = format!("seat {generation} appends, but seat {other} speaks for them");
                Err(broken(Invariant::SingleWriter, how))
            }
            _ => Ok(()),
        }
    }

    /// With a defect, something forbidden happens while an append is under way.
    fn misbehave(&mut self, process: usize, generation: u64, after: Head) -> Result<(), Broken> {
        let actor = &self.processes[process].actors[&generation];
        match self.defect {
            Defect::AnswersEarly => {
                let first = after.next();
                let early = Reply { first, last: first, told: Vec::new() };
                let Some((number, asked)) = actor.current else { return Ok(()) };
                let ticket = Ticket { number, asked, attention: None };
                self.answer(process, ticket, Response::Reply(early))
            }
            Defect::SnapshotsAhead => {
                let Some(session) = actor.seat.session() else { return Ok(()) };
                let mut ahead = session.state().clone();
                ahead.episodes += 1;
                let ahead = Session::resume(self.domain.clone(), ahead);
                let _ = keep_snapshot(&self.store, &actor.stream, &ahead);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Reads a session from the log. Sometimes the reading is interrupted.
    fn wake(&mut self, process: usize, generation: u64) -> Result<(), Broken> {
        let stream = self.processes[process].actors[&generation].stream.clone();
        let (domain, new) = beginning();
        self.processes[process].minds.put(&stream.tenant, new.base.clone());
        let dies = self.dice.chance(10).then(|| self.dice.below(12));
        self.disturbed.die_after(dies);
        let woken = rebuild(domain, &self.store, &stream, &self.processes[process].minds);
        self.disturbed.die_after(None);
        let is_erased = self.store.keys.erased(&stream.tenant).unwrap().contains(&stream);
        let woken = match woken {
            Ok(session) => Ok(Box::new(session)),
            Err(error) if dies.is_some() || is_erased || self.disturbed.is_down() => {
                self.counts.one("wakings interrupted");
                let unavailable = Response::error(ErrorCode::Unavailable, error.to_string());
                Err(Box::new(unavailable))
            }
            Err(error) => return Err(broken(Invariant::FoldAgrees, error.to_string())),
        };
        self.note(|| format!("{generation} in {process} is awake: {}", woken.is_ok()));
        self.seat(process, generation, Input::Woken(woken))
    }

    fn poll(
        &mut self,
        process: usize,
        generation: u64,
        mut pending: Pending,
    ) -> Result<(), Broken> {
        let mut context = Context::from_waker(Waker::noop());
        let result = match Pin::new(&mut pending).poll(&mut context) {
            Poll::Ready(result) => result,
            Poll::Pending => {
                if let Some(actor) = self.processes[process].actors.get_mut(&generation) {
                    actor.pending = Some(pending);
                }
                return Ok(());
            }
        };
        if let Err(error) = &result {
            self.note(|| format!("{generation} in {process}: {error}"));
            self.counts.one("appends failed");
            if let apprentice::store::AppendError::Conflict { .. } = error {
                self.counts.one("appends in conflict");
            }
        }
        self.seat(process, generation, Input::Appended(result))
    }

    fn leave(&mut self, process: usize, generation: u64, stream: StreamId) -> Result<(), Broken> {
        self.counts.one("seats that left");
        if self.defect == Defect::LeavesByItself {
            return self.remove(process, generation);
        }
        let leaving = ToDirectory::Other(DirectoryInput::Leaving { stream, generation });
        self.processes[process].to_directory.push_back(leaving);
        Ok(())
    }

    /// Removes a seat that stopped, with everything that still waited for it.
    fn remove(&mut self, process: usize, generation: u64) -> Result<(), Broken> {
        if let Some(actor) = self.processes[process].actors.remove(&generation)
            && actor.waiting() > 0
        {
            let how = format!("seat {generation} stopped while {} waited", actor.waiting());
            return Err(broken(Invariant::AnsweredOnce, how));
        }
        self.counts.one("evictions");
        let holder = &mut self.processes[process];
        if holder.stops && holder.actors.is_empty() && holder.to_directory.is_empty() {
            self.crash(process);
        }
        Ok(())
    }

    fn answer(&mut self, process: usize, ticket: Ticket, response: Response) -> Result<(), Broken> {
        let Ticket { number, asked, .. } = ticket;
        if !self.processes[process].unanswered.remove(&number) {
            let how = format!("request {number} was answered twice");
            return Err(broken(Invariant::AnsweredOnce, how));
        }
        if let Response::Error(failed) = &response
            && failed.code == ErrorCode::Internal
        {
            return Err(broken(Invariant::SceneAgrees, failed.message.clone()));
        }
        asked.map_or(Ok(()), |asked| self.hear(asked, response))
    }

    /// The time of a timer is over.
    pub fn fire_timer(&mut self, process: usize) -> Result<(), Broken> {
        let actors = self.processes[process].actors.values();
        let due: Vec<u64> =
            actors.filter(|it| !it.timers.is_empty()).map(|it| it.generation).collect();
        if due.is_empty() {
            return Ok(());
        }
        let generation = *self.dice.of(&due);
        self.fire_timers_of(process, generation)
    }

    pub fn fire_timers_of(&mut self, process: usize, generation: u64) -> Result<(), Broken> {
        let Some(actor) = self.processes[process].actors.get_mut(&generation) else {
            return Ok(());
        };
        if !actor.seat.is_ready() {
            return Ok(());
        }
        for timer in std::mem::take(&mut actor.timers) {
            self.seat(process, generation, Input::Due(timer))?;
        }
        Ok(())
    }

    /// A trainer does its work and tells the seat, if it is still there.
    pub fn train(&mut self, job: Job) {
        let Job { process, generation, stream, recipe, lessons, attention } = job;
        self.counts.one("trainings");
        let outcome = match self.dice.chance(5) {
            true => Err("the trainer died".to_owned()),
            false => {
                learning::train(&*self.domain, &recipe, &lessons).map_err(|error| error.to_string())
            }
        };
        let outcome = outcome.map(|mind| {
            // A cache: losing the bytes of a mind costs only time.
            let _ = keep_mind(&self.store, &stream, &mind);
            Arc::new(mind)
        });
        if let Some(actor) = self.processes[process].actors.get_mut(&generation) {
            let recipe = recipe.digest();
            actor.mailbox.push_back(Mail::Trained { recipe, outcome, attention });
        }
    }

    /// An actor dies of a panic. What waited for it is answered as interrupted. The directory finds
    /// out when it next sends to it.
    pub fn actor_dies(&mut self, process: usize) {
        let actors = || self.processes[process].actors.values();
        // Mostly an actor that could not continue anyway: the directory may not know this yet.
        let leaving = actors().filter(|actor| actor.is_leaving());
        let mut generations: Vec<u64> = leaving.map(|actor| actor.generation).collect();
        if generations.is_empty() {
            generations = actors().map(|actor| actor.generation).collect();
        }
        if generations.is_empty() {
            return;
        }
        self.counts.one("deaths of an actor");
        let generation = *self.dice.of(&generations);
        let holder = &mut self.processes[process];
        let Some(mut actor) = holder.actors.remove(&generation) else { return };
        for mail in actor.mailbox.drain(..) {
            if let Mail::Asked(parcel) = mail {
                holder.unanswered.remove(&parcel.ticket.number);
            }
        }
        // The tickets inside the seat are dropped with it.
        for number in actor.seat.into_callers().into_iter().map(|ticket| ticket.number) {
            holder.unanswered.remove(&number);
        }
    }

    /// The process is told to stop in order.
    pub fn stop(&mut self, process: usize) {
        self.counts.one("stops");
        let holder = &mut self.processes[process];
        holder.stops = true;
        holder.to_directory.push_back(ToDirectory::Other(DirectoryInput::SleepAll));
    }

    pub fn ask_to_erase(&mut self, person: usize) {
        let stream = self.people[person].stream.clone();
        let erase = DirectoryInput::Erase { stream, caller: person };
        self.processes[0].to_directory.push_back(ToDirectory::Other(erase));
    }
}
