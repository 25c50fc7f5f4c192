//! What the registrar's thread does in the service: carries out what the tenants' writer says, one
//! part at a time, and tells it later what came of it.

use std::pin::Pin;
use std::task::{Context, Poll, Waker};

use apprentice::actors::{
    DirectoryInput, Done, Moment, OrderError, TenantWork, TenantWriter, WriterEffect, WriterInput,
    fold_tenant, fold_tenants,
};
use apprentice::events::{Event, TenantEvent};
use apprentice::ids::{PublicKey, StreamId, TenantId, Timestamp};
use apprentice::invariants::Invariant;
use apprentice::replay::{
    CheckpointsError, Through, due_segments, keep_checkpoint, sign_statement,
};
use apprentice::store::{AppendError, Durable};
use apprentice::tenancy::Order;

use crate::defects::Defect;
use crate::oracle::{Broken, Lab, broken};
use crate::orders::{self, labs};
use crate::process::{Caller, ToDirectory, WORK_MAX, Whom};
use crate::system::System;

type ToWriter = WriterInput<Caller>;

impl System {
    /// Hands work in to a process's registrar. A full queue is an honest busy.
    pub fn hand_in_work(
        &mut self,
        process: usize,
        work: TenantWork,
        whom: Whom,
    ) -> Result<(), Broken> {
        let caller = Caller { number: self.next_ticket(), whom };
        let holder = &mut self.processes[process];
        holder.unanswered.insert(caller.number);
        if holder.registrar.queue.len() < WORK_MAX {
            holder.registrar.queue.push_back((work, caller));
            return Ok(());
        }
        self.counts.one("registrars too busy");
        self.answer_work(process, caller, Err(OrderError::Busy))
    }

    /// An operator gives an order, or one without an answer again.
    pub fn order(&mut self, process: usize) -> Result<(), Broken> {
        orders::give(&mut self.dice, &mut self.orders);
        let open = orders::unanswered(&self.orders);
        let index = match open.is_empty() || self.dice.chance(10) {
            // A network may have an old one again.
            true => self.dice.below(self.orders.len()),
            false => *self.dice.of(&open),
        };
        self.hand_in_order(process, index)
    }

    fn hand_in_order(&mut self, process: usize, index: usize) -> Result<(), Broken> {
        let (tenant, order) = (self.orders[index].tenant.clone(), self.orders[index].order.clone());
        // Whether its key is gone is looked up when it is begun.
        let work = TenantWork::Obey { tenant, order, gone: false };
        self.hand_in_work(process, work, Whom::Operator(index))
    }

    /// An auditor wants a checkpoint.
    pub fn ask_to_sign(&mut self, process: usize) -> Result<(), Broken> {
        let tenant = self.dice.of(&labs()).clone();
        let through = *self.dice.of(&[Through::Episodes, Through::Head]);
        // Nobody signs for a lab that was never opened: it has no secret.
        if self.store.keys.check_tenant(&tenant).is_err() {
            return Ok(());
        }
        self.hand_in_work(process, TenantWork::Sign { tenant, through }, Whom::Auditor)
    }

    pub fn close_segments(&mut self, process: usize, stream: StreamId) -> Result<(), Broken> {
        if self.defect == Defect::ForgetsSegments {
            return Ok(());
        }
        let work = TenantWork::Close { stream, through: Through::Episodes };
        self.hand_in_work(process, work, Whom::Seat)
    }

    pub fn erase(&mut self, process: usize, stream: StreamId) -> Result<(), Broken> {
        let work = TenantWork::Erase { stream: stream.clone() };
        self.hand_in_work(process, work, Whom::Directory(stream))
    }

    /// The registrar does its next piece of work.
    pub fn step_registrar(&mut self, process: usize) -> Result<(), Broken> {
        let registrar = &mut self.processes[process].registrar;
        if !registrar.can_act() {
            return Ok(());
        }
        if registrar.writer.is_none() {
            return self.open_registrar(process);
        }
        let Some(input) = self.next_to_writer(process) else { return Ok(()) };
        let moment = Moment { at: Timestamp(self.now()), fresh: self.fresh_request() };
        let Some(writer) = &mut self.processes[process].registrar.writer else { return Ok(()) };
        for effect in writer.step(input, moment) {
            self.carry_out_for_writer(process, effect)?;
        }
        Ok(())
    }

    /// Folds what there is, as a service does when it starts; now and then that is cut short.
    pub fn open_registrar(&mut self, process: usize) -> Result<(), Broken> {
        let dies = self.dice.chance(10).then(|| self.dice.below(12));
        self.disturbed.die_after(dies);
        let folded = fold_tenants(&self.store);
        self.disturbed.die_after(None);
        let registries = match folded {
            Ok(registries) => registries,
            Err(OrderError::Read { .. }) if dies.is_some() || self.disturbed.is_down() => {
                self.counts.one("registrars' starts interrupted");
                return Ok(());
            }
            Err(error) => return Err(broken(Invariant::FoldAgrees, error.to_string())),
        };
        let registrar = &mut self.processes[process].registrar;
        for (tenant, registry) in &registries {
            registrar.doors.update(tenant, registry.standing());
        }
        let writer = TenantWriter::new(registries);
        let destroyed = labs()
            .into_iter()
            .flat_map(|tenant| self.store.keys.erased(&tenant).expect("they are in memory"));
        let unfinished = writer.unfinished(destroyed.collect());
        self.processes[process].registrar.writer = Some(writer);
        for stream in unfinished {
            self.counts.one("erasures finished later");
            let caller = Caller { number: self.next_ticket(), whom: Whom::Start };
            let holder = &mut self.processes[process];
            holder.unanswered.insert(caller.number);
            holder.registrar.queue.push_front((TenantWork::Erase { stream }, caller));
        }
        Ok(())
    }

    /// What happened to the writer; none when its append is still under way.
    fn next_to_writer(&mut self, process: usize) -> Option<ToWriter> {
        let registrar = &mut self.processes[process].registrar;
        if let Some(mut pending) = registrar.pending.take() {
            let mut context = Context::from_waker(Waker::noop());
            let Poll::Ready(result) = Pin::new(&mut pending).poll(&mut context) else {
                registrar.pending = Some(pending);
                return None;
            };
            if let Err(error) = &result {
                self.counts.one("appends of labs failed");
                if let AppendError::Conflict { .. } = error {
                    self.counts.one("appends of labs in conflict");
                }
                self.note(|| format!("registrar {process}: {error}"));
            }
            return Some(WriterInput::Appended(result));
        }
        if let Some(end) = registrar.end.take() {
            return Some(end);
        }
        let (mut work, caller) = registrar.queue.pop_front()?;
        if let TenantWork::Obey { tenant, order, gone } = &mut work {
            *gone = order.key().is_some_and(|key| registrar.doors.is_gone(tenant, key));
        }
        registrar.current = Some(caller.clone());
        self.note(|| format!("registrar {process} begins {work:?}"));
        Some(WriterInput::Asked { work, caller })
    }

    fn carry_out_for_writer(
        &mut self,
        process: usize,
        effect: WriterEffect<Caller>,
    ) -> Result<(), Broken> {
        // It died of what it did before.
        if self.processes[process].registrar.writer.is_none() {
            return Ok(());
        }
        let dies = (!self.quiet && self.dice.chance(5)).then(|| self.dice.below(12));
        let end = match effect {
            WriterEffect::Append { stream, after, batch } => {
                let events = batch.events.clone();
                self.note(|| {
                    let kinds: Vec<_> = events.iter().map(|event| event.kind()).collect();
                    format!("registrar {process} appends {kinds:?} after {}", after.seq)
                });
                let pending = self.store.log.append(&stream, after, batch);
                self.processes[process].registrar.pending = Some(pending);
                return self.answer_early(process, events);
            }
            WriterEffect::Fold { tenant } => {
                self.counts.one("labs read again");
                self.disturbed.die_after(dies);
                let folded = fold_tenant(&self.store, &tenant);
                self.disturbed.die_after(None);
                WriterInput::Folded(folded)
            }
            WriterEffect::MakeSecret { tenant } => {
                WriterInput::SecretMade(self.store.keys.make_tenant(&tenant).map(|_| ()))
            }
            WriterEffect::ListStreams { tenant } => {
                WriterInput::Streams(self.store.log.streams(&tenant))
            }
            WriterEffect::FindDue { stream, from, through } => {
                self.disturbed.die_after(dies);
                let due = due_segments(&*self.store.log, &stream, from, through);
                self.disturbed.die_after(None);
                WriterInput::Due(due)
            }
            WriterEffect::FindEnd { stream } => WriterInput::End(self.store.log.walk(&stream)),
            WriterEffect::DestroyKey { stream } => {
                match self.defect {
                    Defect::NotesFirst => self.processes[process].registrar.spared = Some(stream),
                    _ => self.destroy_key(process, &stream)?,
                }
                WriterInput::KeyDestroyed(Ok(()))
            }
            WriterEffect::SignStatement { tenant, statement } => {
                let signed = sign_statement(&self.store.keys, &tenant, &statement);
                WriterInput::StatementSigned(signed)
            }
            WriterEffect::KeepCheckpoint { tenant } => {
                let writer = self.processes[process].registrar.writer.as_ref();
                let registry = writer.and_then(|writer| writer.registry(&tenant)).cloned();
                let registry = registry.unwrap_or_default();
                WriterInput::CheckpointKept(keep_checkpoint(&self.store, &tenant, &registry))
            }
            WriterEffect::TellDoors { tenant } => {
                let registrar = &self.processes[process].registrar;
                let registry = registrar.writer.as_ref().and_then(|it| it.registry(&tenant));
                if let Some(registry) = registry.filter(|_| self.defect != Defect::ForgetsDoors) {
                    registrar.doors.update(&tenant, registry.standing());
                }
                return Ok(());
            }
            WriterEffect::Publish { stream, durable } => {
                return self.check_erasures_noted(&stream.tenant, &durable);
            }
            WriterEffect::Answer { caller, outcome } => {
                if let Some(stream) = self.processes[process].registrar.spared.take() {
                    self.destroy_key(process, &stream)?;
                }
                return self.answer_work(process, caller, outcome);
            }
            // The service ends; now, or after a few more moves.
            WriterEffect::Fatal(_) => {
                if self.dice.chance(30) {
                    self.crash(process);
                }
                return Ok(());
            }
        };
        self.processes[process].registrar.end = Some(end);
        Ok(())
    }

    /// With a defect, an operator hears of an order while its append is under way.
    fn answer_early(&mut self, process: usize, events: Vec<Event>) -> Result<(), Broken> {
        let current = self.processes[process].registrar.current.clone();
        match current {
            Some(caller @ Caller { whom: Whom::Operator(_), .. })
                if self.defect == Defect::ObeysEarly =>
            {
                self.answer_work(process, caller, Ok(Done::Obeyed(events)))
            }
            _ => Ok(()),
        }
    }

    /// A person's key is destroyed. Nobody may speak for them then. Doing it again is harmless: a
    /// start finishes what another process has begun.
    fn destroy_key(&mut self, process: usize, stream: &StreamId) -> Result<(), Broken> {
        if self.store.keys.erased(&stream.tenant).expect("they are in memory").contains(stream) {
            return Ok(());
        }
        let mut actors = self.processes[process].actors.values();
        let speaks = actors.find(|actor| actor.stream == *stream && actor.speaks());
        if let Some(actor) = speaks {
            let how = format!("seat {} speaks for somebody who is erased", actor.generation);
            return Err(broken(Invariant::SingleWriter, how));
        }
        self.note(|| format!("registrar {process} destroys the key of {stream}"));
        self.store.erase(stream).expect("it is in memory");
        if let Some(person) = self.people.iter_mut().find(|person| person.stream == *stream) {
            self.counts.one("people erased");
            let keys = &self.store.keys;
            person.start_over(keys.stream_id(&person.tenant, &person.user).unwrap());
        }
        Ok(())
    }

    /// What says that a key was destroyed is said after that.
    fn check_erasures_noted(&self, tenant: &TenantId, durable: &Durable) -> Result<(), Broken> {
        let destroyed = self.store.keys.erased(tenant).expect("they are in memory");
        for record in durable.records() {
            if let Event::Tenant(TenantEvent::PersonErased(noted)) = &record.event
                && destroyed.iter().all(|stream| stream.key != noted.stream)
            {
                let how =
                    format!("the erasure of {} is on record, and the key is there", noted.stream);
                return Err(broken(Invariant::NoLostWork, how));
            }
        }
        Ok(())
    }

    fn answer_work(
        &mut self,
        process: usize,
        caller: Caller,
        outcome: Result<Done, OrderError>,
    ) -> Result<(), Broken> {
        if !self.processes[process].unanswered.remove(&caller.number) {
            let how = format!("work {} was answered twice", caller.number);
            return Err(broken(Invariant::AnsweredOnce, how));
        }
        self.note(|| format!("registrar {process}: {:?}: {outcome:?}", caller.whom));
        self.check_excuse(process, &outcome)?;
        match (caller.whom, outcome) {
            (Whom::Operator(index), Ok(Done::Obeyed(events))) => {
                self.obeyed(process, index, events)
            }
            (Whom::Operator(index), Err(OrderError::Refused { .. } | OrderError::KeyOfOther)) => {
                self.counts.one("orders refused");
                self.orders[index].heard.get_or_insert_default();
                Ok(())
            }
            (Whom::Seat, Ok(Done::Closed(count))) => {
                self.counts.many("segments closed", count as u64);
                Ok(())
            }
            (Whom::Auditor, Ok(Done::Signed(_))) => {
                self.counts.one("checkpoints");
                Ok(())
            }
            (Whom::Directory(stream), _) => {
                let over = ToDirectory::Other(DirectoryInput::Erased { stream });
                self.processes[process].to_directory.push_back(over);
                Ok(())
            }
            // To be asked again; a start makes up for erasures, a waking for segments.
            _ => Ok(()),
        }
    }

    /// Work may fail because the log does, or because another process knows better.
    fn check_excuse(
        &self,
        process: usize,
        outcome: &Result<Done, OrderError>,
    ) -> Result<(), Broken> {
        let Err(error) = outcome else { return Ok(()) };
        match error {
            OrderError::Append { .. }
            | OrderError::Read { .. }
            | OrderError::Refused { .. }
            | OrderError::KeyOfOther
            | OrderError::NobodyThere { .. }
            | OrderError::Busy => Ok(()),
            OrderError::Evidence { tenant, error: CheckpointsError::RolledBack { .. } }
                if self.is_behind(process, tenant)? =>
            {
                Ok(())
            }
            _ => Err(broken(Invariant::FoldAgrees, error.to_string())),
        }
    }

    /// Whether another process has written to a lab's stream.
    fn is_behind(&self, process: usize, tenant: &TenantId) -> Result<bool, Broken> {
        let writer = self.processes[process].registrar.writer.as_ref();
        let head = writer.and_then(|writer| writer.registry(tenant)).map(|it| it.head().seq);
        Ok(head.unwrap_or(0) < self.lab(tenant)?.records())
    }

    /// An operator hears that an order was obeyed.
    fn obeyed(&mut self, process: usize, index: usize, events: Vec<Event>) -> Result<(), Broken> {
        let (tenant, order) = (&self.orders[index].tenant, &self.orders[index].order);
        let lab = self.lab(tenant)?;
        if !lab.has(&events) {
            let how = format!("{order:?} was acknowledged, and is not in the log");
            return Err(broken(Invariant::DurableBeforeReply, how));
        }
        if let Order::Admit { key, .. } | Order::Rotate { new: key, .. } = order
            && !events.is_empty()
            && self.is_known_as_anothers(process, tenant, key)
        {
            return Err(broken(Invariant::TenantWall, format!("{key} was admitted by two labs")));
        }
        self.counts.one("orders obeyed");
        self.orders[index].heard.get_or_insert(events);
        self.look_at_registrar(process, &lab)
    }

    fn is_known_as_anothers(&self, process: usize, tenant: &TenantId, key: &PublicKey) -> bool {
        let doors = &self.processes[process].registrar.doors;
        let mut others = doors.tenants().into_iter().filter(|other| other != tenant);
        others.any(|other| doors.standing(&other).is_some_and(|it| it.keys().contains_key(key)))
    }

    fn lab(&self, tenant: &TenantId) -> Result<Lab, Broken> {
        Lab::read(&*self.inner, tenant)
    }

    /// What was acknowledged is in the labs' streams, and what the registrars hold is a state of
    /// them.
    pub fn look_at_labs(&self) -> Result<(), Broken> {
        for tenant in labs() {
            let lab = self.lab(&tenant)?;
            for given in self.orders.iter().filter(|given| given.tenant == tenant) {
                if given.heard.as_ref().is_some_and(|events| !lab.has(events)) {
                    let how = format!("{:?} was acknowledged and is lost", given.order);
                    return Err(broken(Invariant::DurableBeforeReply, how));
                }
            }
            lab.says_who_is_erased(&self.store, &*self.inner)?;
            self.look_at_registrar(0, &lab)?;
            self.look_at_registrar(1, &lab)?;
        }
        Ok(())
    }

    fn look_at_registrar(&self, process: usize, lab: &Lab) -> Result<(), Broken> {
        let registrar = &self.processes[process].registrar;
        let registry = registrar.writer.as_ref().and_then(|it| it.registry(lab.tenant()));
        let Some(registry) = registry else { return Ok(()) };
        lab.knows(registry)?;
        Lab::is_told(registry, registrar.doors.standing(lab.tenant()))
    }

    /// After everything is quiet: every order is answered, every episode that ended is in a closed
    /// segment, and a new start finds every erasure on record.
    pub fn settle_labs(&mut self) -> Result<(), Broken> {
        for index in orders::unanswered(&self.orders) {
            self.hand_in_order(0, index)?;
            self.work_off(0)?;
            if self.orders[index].heard.is_none() {
                let how = format!("{:?} is never obeyed", self.orders[index].order);
                return Err(broken(Invariant::NoLostWork, how));
            }
        }
        self.crash(0);
        self.open_registrar(0)?;
        self.work_off(0)?;
        self.look_at_labs()?;
        for person in &self.people {
            let (stream, lab) = (&person.stream, self.lab(&person.tenant)?);
            let from = lab.registry().uncovered(stream.key);
            let left = due_segments(&*self.inner, stream, from, Through::Episodes);
            if left.map_or(true, |left| !left.is_empty()) {
                let how = format!("segments of {stream} were left open");
                return Err(broken(Invariant::NoLostWork, how));
            }
        }
        for tenant in labs() {
            self.lab(&tenant)?.has_noted_all(&self.store, &*self.inner)?;
        }
        Ok(())
    }
}
