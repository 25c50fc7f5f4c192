//! The service in small: two processes over one faulty log, each with a seat for each person. It
//! does what actors, trainers and clients do, one step at a time, in an order that dice choose.

use std::pin::Pin;
use std::sync::{Arc, OnceLock};
use std::task::{Context, Poll, Waker};

use apprentice::events::{Durable, Head, Report};
use apprentice::ids::{Digest, RequestId, TenantId, Timestamp, UserId};
use apprentice::invariants::Invariant;
use apprentice::learning::{self, Lesson, Mind, Recipe};
use apprentice::replay::{Minds, keep_mind, keep_snapshot, mind_origin, rebuild};
use apprentice::session::{Command, Outstanding, Phase, Proposed, Reply, Session, Told};
use apprentice::store::{
    AppendError, EventLog, FaultPlan, FaultyLog, Keys, MemoryLog, Pending, SeededEntropy, Store,
};
use apprentice::world::Domain;

use crate::dice::Dice;
use crate::disturbed::Disturbed;
use crate::oracle::{Broken, Truth, broken};
use crate::people::{Heard, Person};
use crate::support::toy::Bells;

/// A defect built in on purpose, to see that the oracle sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Defect {
    None,
    /// Answers before the log has said that the batch is durable.
    AnswersEarly,
    /// Gives a repeated request a new id.
    ForgetsRequests,
    /// Does not ask again for a training that was under way when it died.
    ForgetsTrainings,
    /// Takes a snapshot that holds an append of which it does not know whether it is durable.
    SnapshotsAhead,
}

/// What happened, for the report and for the test that everything does happen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    pub steps: u64,
    pub acknowledged: u64,
    pub repeated: u64,
    pub rejected: u64,
    pub failed_appends: u64,
    pub conflicts: u64,
    pub crashes: u64,
    pub interrupted_wakings: u64,
    pub trainings: u64,
    pub lost_caches: u64,
    pub records: u64,
}

impl Counts {
    pub fn add(&mut self, other: &Counts) {
        self.steps += other.steps;
        self.acknowledged += other.acknowledged;
        self.repeated += other.repeated;
        self.rejected += other.rejected;
        self.failed_appends += other.failed_appends;
        self.conflicts += other.conflicts;
        self.crashes += other.crashes;
        self.interrupted_wakings += other.interrupted_wakings;
        self.trainings += other.trainings;
        self.lost_caches += other.lost_caches;
        self.records += other.records;
    }
}

pub struct House {
    dice: Dice,
    clock: u64,
    defect: Defect,
    domain: Arc<Bells>,
    inner: Arc<MemoryLog>,
    faulty: Arc<FaultyLog>,
    disturbed: Arc<Disturbed>,
    store: Store,
    processes: [Process; 2],
    people: Vec<Person>,
    jobs: Vec<Job>,
    lives: u64,
    counts: Counts,
    trace: Option<Vec<String>>,
}

/// What one process holds in memory, lost when it dies.
#[derive(Default)]
struct Process {
    minds: Minds,
    seats: Vec<Option<Seat>>,
}

/// An actor in small: a session, and the turn that waits for the log.
struct Seat {
    life: u64,
    session: Session<Bells>,
    waiting: Option<Waiting>,
    training: bool,
}

struct Waiting {
    pending: Pending,
    after: Head,
    /// Which of the person's requests it answers; none for what the service itself asked.
    asked: Option<usize>,
}

struct Job {
    process: usize,
    person: usize,
    life: u64,
    recipe: Arc<Recipe>,
    lessons: Vec<Lesson<<Bells as Domain>::Scene, <Bells as Domain>::Task>>,
}

#[derive(Debug, Clone, Copy)]
enum Move {
    Ask,
    Deliver,
    Poll,
    Release,
    Train,
    CrashAll,
    CrashOne,
    Sleep,
    LoseSnapshots,
    LoseMinds,
    JumpInTime,
    Look,
}

const MOVES: [(usize, Move); 12] = [
    (30, Move::Ask),
    (45, Move::Deliver),
    (40, Move::Poll),
    (8, Move::Release),
    (14, Move::Train),
    (1, Move::CrashAll),
    (1, Move::CrashOne),
    (3, Move::Sleep),
    (2, Move::LoseSnapshots),
    (2, Move::LoseMinds),
    (3, Move::JumpInTime),
    (2, Move::Look),
];

/// The recipe and the mind that everybody begins with: the same for all seeds.
fn beginning() -> &'static (Arc<Bells>, String, Arc<Mind>) {
    static BEGINNING: OnceLock<(Arc<Bells>, String, Arc<Mind>)> = OnceLock::new();
    BEGINNING.get_or_init(|| {
        let domain = Arc::new(Bells::sturdy());
        let text = Recipe::builtin("tiny").expect("the recipe `tiny` ships").to_owned();
        let recipe = Recipe::parse(&text).unwrap();
        let base = learning::train(&*domain, &recipe, &[]).unwrap();
        (domain, text, Arc::new(base))
    })
}

impl House {
    pub fn new(seed: u64, defect: Defect, traced: bool) -> House {
        let mut dice = Dice::new(seed);
        let keys = Arc::new(Keys::in_memory(Arc::new(SeededEntropy::new(seed))));
        let inner = Arc::new(MemoryLog::new(keys.clone()));
        // Some seeds have a calm log, some a wild one.
        let mut share = |most: usize| dice.below(most + 1) as u32;
        let plan = FaultPlan {
            seed,
            refused: share(80),
            unacknowledged: share(80),
            held_answers: share(150),
            held_appends: share(150),
            crashes_before: share(12),
            crashes_after: share(12),
            ..FaultPlan::default()
        };
        let faulty = Arc::new(FaultyLog::new(inner.clone(), plan));
        let disturbed = Arc::new(Disturbed::new(faulty.clone()));
        let store = Store::around(disturbed.clone(), keys);
        let person = |name: &str| {
            let user = UserId::new(name).unwrap();
            let stream = store.keys.stream_id(&TenantId::local(), &user).unwrap();
            Person { user, stream, asked: Vec::new() }
        };
        let people: Vec<Person> = ["ada", "grace"].map(person).into();
        let process =
            || Process { minds: Minds::default(), seats: people.iter().map(|_| None).collect() };
        let processes = [process(), process()];
        House {
            dice,
            clock: 1_000_000,
            defect,
            domain: beginning().0.clone(),
            inner,
            faulty,
            disturbed,
            store,
            processes,
            people,
            jobs: Vec::new(),
            lives: 0,
            counts: Counts::default(),
            trace: traced.then(Vec::new),
        }
    }

    /// Lives through `moves` random moves, then through a quiet time in which everything that is
    /// due is done, and checks the laws all along.
    pub fn run(mut self, moves: usize) -> (Result<Counts, Broken>, Vec<String>) {
        let lived = self.live(moves);
        (lived.map(|()| self.counts), self.trace.unwrap_or_default())
    }

    fn live(&mut self, moves: usize) -> Result<(), Broken> {
        for _ in 0..moves {
            self.counts.steps += 1;
            self.clock += self.dice.below(5_000) as u64;
            let step = self.dice.weighted(&MOVES);
            self.note(|| format!("{step:?}"));
            self.make(step)?;
            if self.faulty.crashed() {
                self.crash_all()?;
            }
        }
        self.settle_down()
    }

    fn make(&mut self, step: Move) -> Result<(), Broken> {
        let person = self.dice.below(self.people.len());
        // The second process is the one that should not be there.
        let process = usize::from(self.dice.chance(15));
        match step {
            Move::Ask => {
                let seat = self.processes[process].seats[person].as_ref();
                let session = seat.map(|seat| &seat.session).filter(|session| session.is_open());
                self.people[person].ask(&mut self.dice, session);
            }
            Move::Deliver => {
                if let Some(asked) = self.which(person) {
                    self.deliver(process, person, asked)?;
                }
            }
            Move::Poll => self.poll(process, person)?,
            Move::Release => self.faulty.release(),
            Move::Train => {
                if !self.jobs.is_empty() {
                    let job = self.jobs.swap_remove(self.dice.below(self.jobs.len()));
                    self.train(job)?;
                }
            }
            Move::CrashAll => self.crash_all()?,
            Move::CrashOne => self.crash(process),
            Move::Sleep => {
                if let Some(seat) = self.processes[process].seats[person].take() {
                    self.keep_snapshot(person, &seat);
                }
            }
            Move::LoseSnapshots => {
                self.counts.lost_caches += 1;
                self.store.snapshots.forget(&self.people[person].stream).unwrap();
            }
            Move::LoseMinds => self.lose_minds(person),
            // Clocks of machines go backwards, too.
            Move::JumpInTime => self.clock = self.clock / 2 + self.dice.below(1_000_000) as u64,
            Move::Look => self.look(person)?,
        }
        Ok(())
    }

    /// Mostly a request without an answer; sometimes an old one again, as a network may have it.
    fn which(&mut self, person: usize) -> Option<usize> {
        let person = &self.people[person];
        let unanswered = person.unanswered();
        if person.asked.is_empty() {
            None
        } else if unanswered.is_empty() || self.dice.chance(10) {
            Some(self.dice.below(person.asked.len()))
        } else {
            Some(*self.dice.of(&unanswered))
        }
    }

    fn deliver(&mut self, process: usize, person: usize, asked: usize) -> Result<(), Broken> {
        if !self.wake(process, person)? {
            return Ok(());
        }
        let (command, request) = {
            let asked = &self.people[person].asked[asked];
            (asked.command.clone(), asked.request)
        };
        self.perform(process, person, &command, request, Some(asked))
    }

    /// Whether the seat can take a message now. As in the service, somebody new is opened first.
    fn wake(&mut self, process: usize, person: usize) -> Result<bool, Broken> {
        if let Some(seat) = &self.processes[process].seats[person] {
            return Ok(seat.waiting.is_none());
        }
        let (domain, recipe_text, base) = beginning();
        let stream = self.people[person].stream.clone();
        self.processes[process].minds.put(&stream.tenant, base.clone());
        let dies = self.dice.chance(10).then(|| self.dice.below(12));
        self.disturbed.die_after(dies);
        let woken = rebuild(domain, &self.store, &stream, &self.processes[process].minds);
        self.disturbed.die_after(None);
        let session = match woken {
            Ok(session) => session,
            Err(_) if dies.is_some() => {
                self.counts.interrupted_wakings += 1;
                self.note(|| format!("waking {person} in {process} is cut short"));
                return Ok(false);
            }
            Err(error) => return Err(broken(Invariant::FoldAgrees, error.to_string())),
        };
        self.lives += 1;
        let open = session.is_open();
        self.note(|| format!("wakes {person} in {process} at {}", session.head().seq));
        let seat = Seat { life: self.lives, session, waiting: None, training: false };
        self.processes[process].seats[person] = Some(seat);
        if !open {
            let (user, recipe_text) = (self.people[person].user.clone(), recipe_text.clone());
            let command = Command::Open { user, recipe_text, mind: base.digest() };
            let request = self.fresh_request();
            self.perform(process, person, &command, request, None)?;
            return Ok(false);
        }
        if self.defect != Defect::ForgetsTrainings {
            self.ask_for_training(process, person);
        }
        Ok(true)
    }

    fn perform(
        &mut self,
        process: usize,
        person: usize,
        command: &Command,
        request: RequestId,
        asked: Option<usize>,
    ) -> Result<(), Broken> {
        let clock = Timestamp(self.clock);
        let again = self.fresh_request();
        let Some(seat) = &mut self.processes[process].seats[person] else { return Ok(()) };
        let mut proposed = seat.session.propose(command, request, seat.session.next_at(clock));
        if self.defect == Defect::ForgetsRequests && matches!(proposed, Ok(Proposed::Repeat { .. }))
        {
            proposed = seat.session.propose(command, again, seat.session.next_at(clock));
        }
        match proposed {
            Err(rejection) => {
                let head = seat.session.head().seq;
                self.note(|| format!("{person} in {process} at {head}: {rejection}"));
                self.counts.rejected += 1;
                if let Some(asked) = asked {
                    let heard = &mut self.people[person].asked[asked].heard;
                    if *heard == Heard::Nothing {
                        *heard = Heard::Rejected;
                    }
                }
            }
            Ok(Proposed::Repeat { first, last }) => {
                self.counts.repeated += 1;
                let stream = &self.people[person].stream;
                let wanted = (last.get() - first.get() + 1) as usize;
                let Ok(records) = self.store.log.read(stream, first) else { return Ok(()) };
                let records: Vec<_> = records.take(wanted).filter_map(Result::ok).collect();
                if records.len() == wanted {
                    let reply = seat.session.repeat(command, &records);
                    let reply =
                        reply.map_err(|error| broken(Invariant::ExactlyOnce, error.to_string()))?;
                    self.hear(person, asked, reply)?;
                }
            }
            Ok(Proposed::Defect(divergence)) => {
                return Err(broken(Invariant::FoldAgrees, divergence.to_string()));
            }
            Ok(Proposed::Turn(turn)) => {
                let after = turn.after;
                let kinds: Vec<_> = turn.batch.events.iter().map(|event| event.kind()).collect();
                let stream = self.people[person].stream.clone();
                let pending = self.store.log.append(&stream, turn.after, turn.batch);
                seat.waiting = Some(Waiting { pending, after, asked });
                self.note(|| {
                    format!("{person} in {process} appends {kinds:?} after {}", after.seq)
                });
                if self.dice.chance(70) {
                    self.poll(process, person)?;
                }
            }
        }
        Ok(())
    }

    fn poll(&mut self, process: usize, person: usize) -> Result<(), Broken> {
        let seat = self.processes[process].seats[person].as_mut();
        let Some(mut waiting) = seat.and_then(|seat| seat.waiting.take()) else { return Ok(()) };
        let mut context = Context::from_waker(Waker::noop());
        match Pin::new(&mut waiting.pending).poll(&mut context) {
            Poll::Pending => self.misbehave(process, person, waiting),
            Poll::Ready(Ok(durable)) => self.settle(process, person, waiting.asked, &durable),
            Poll::Ready(Err(error)) => {
                self.append_failed(process, person, &error);
                Ok(())
            }
        }
    }

    /// Waits on; with a defect, something forbidden happens first.
    fn misbehave(&mut self, process: usize, person: usize, waiting: Waiting) -> Result<(), Broken> {
        let (after, asked) = (waiting.after, waiting.asked);
        let seat = self.processes[process].seats[person].as_mut().expect("the caller has it");
        seat.waiting = Some(waiting);
        match self.defect {
            Defect::AnswersEarly => {
                let first = after.next();
                let early = Reply { first, last: first, told: Vec::new() };
                self.hear(person, asked, early)?;
            }
            Defect::SnapshotsAhead => {
                let mut ahead = seat.session.state().clone();
                ahead.episodes += 1;
                let ahead = Session::resume(self.domain.clone(), ahead);
                let _ = keep_snapshot(&self.store, &self.people[person].stream, &ahead);
            }
            _ => {}
        }
        Ok(())
    }

    fn append_failed(&mut self, process: usize, person: usize, error: &AppendError) {
        self.note(|| format!("{person} in {process}: {error}"));
        self.counts.failed_appends += 1;
        self.counts.conflicts += u64::from(matches!(error, AppendError::Conflict { .. }));
        // As the actor does: it goes on only when nothing can have been appended.
        let certain = matches!(error, AppendError::Busy { .. } | AppendError::TooLarge { .. });
        let seat = &mut self.processes[process].seats[person];
        if !certain || seat.as_ref().is_some_and(|seat| !seat.session.is_open()) {
            *seat = None;
        }
        self.ask_for_training(process, person);
    }

    fn settle(
        &mut self,
        process: usize,
        person: usize,
        asked: Option<usize>,
        durable: &Durable,
    ) -> Result<(), Broken> {
        let tenant = self.people[person].stream.tenant.clone();
        let holder = &mut self.processes[process];
        let seat = holder.seats[person].as_mut().expect("the caller has it");
        let reply = seat
            .session
            .settle(durable)
            .map_err(|error| broken(Invariant::SceneAgrees, error.to_string()))?;
        if let Some(wanted) = seat.session.mind_wanted() {
            match holder.minds.get(&tenant, wanted) {
                Some(mind) => seat.session.install(mind),
                // The next message wakes a new one, which finds it in the cache or trains it.
                None => holder.seats[person] = None,
            }
        }
        let ended = reply.told.iter().any(|told| matches!(told, Told::EpisodeEnded { .. }));
        self.note(|| format!("{person} in {process} settles {}..{}", reply.first, reply.last));
        self.hear(person, asked, reply)?;
        self.ask_for_training(process, person);
        if ended && let Some(seat) = &self.processes[process].seats[person] {
            self.keep_snapshot(person, seat);
        }
        Ok(())
    }

    fn hear(&mut self, person: usize, asked: Option<usize>, reply: Reply) -> Result<(), Broken> {
        let Some(asked) = asked else { return Ok(()) };
        let asked = &mut self.people[person].asked[asked];
        match &asked.heard {
            Heard::Reply(first) if *first != reply => {
                let how = format!("{:?} got another reply the second time", asked.command);
                Err(broken(Invariant::ExactlyOnce, how))
            }
            _ => {
                self.counts.acknowledged += 1;
                asked.heard = Heard::Reply(reply);
                Ok(())
            }
        }
    }

    fn ask_for_training(&mut self, process: usize, person: usize) {
        let Some(seat) = &mut self.processes[process].seats[person] else { return };
        if seat.training || seat.waiting.is_some() {
            return;
        }
        let Some(Outstanding::Retrain { recipe, lessons }) = seat.session.outstanding() else {
            return;
        };
        seat.training = true;
        self.jobs.push(Job { process, person, life: seat.life, recipe, lessons });
    }

    fn train(&mut self, job: Job) -> Result<(), Broken> {
        let Job { process, person, life, recipe, lessons } = job;
        self.counts.trainings += 1;
        let stream = self.people[person].stream.clone();
        let outcome = match self.dice.chance(5) {
            true => Err("the trainer died".to_owned()),
            false => {
                learning::train(&*self.domain, &recipe, &lessons).map_err(|error| error.to_string())
            }
        };
        let outcome = outcome.map(|mind| {
            let learning::Report { exemplars, threshold, figures } = mind.report().clone();
            let digest = mind.digest();
            // Nothing hangs on it: the bytes of a mind are a cache.
            let _ = keep_mind(&self.store, &stream, &mind);
            self.processes[process].minds.put(&stream.tenant, Arc::new(mind));
            (digest, Report { exemplars, threshold, figures })
        });
        let Some(seat) = &mut self.processes[process].seats[person] else { return Ok(()) };
        if seat.life != life {
            return Ok(());
        }
        if seat.waiting.is_some() {
            // Its mailbox is worked off in order: the result waits its turn.
            self.jobs.push(Job { process, person, life, recipe, lessons });
            return Ok(());
        }
        seat.training = false;
        let command = Command::FinishRetrain { recipe: recipe.digest(), outcome };
        let request = self.fresh_request();
        self.perform(process, person, &command, request, None)
    }

    fn crash_all(&mut self) -> Result<(), Broken> {
        self.counts.crashes += 1;
        self.crash(0);
        self.crash(1);
        self.faulty.restart();
        for person in 0..self.people.len() {
            self.look(person)?;
        }
        Ok(())
    }

    fn crash(&mut self, process: usize) {
        self.note(|| format!("process {process} dies"));
        self.jobs.retain(|job| job.process != process);
        let seats = self.people.iter().map(|_| None).collect();
        self.processes[process] = Process { minds: Minds::default(), seats };
    }

    fn keep_snapshot(&self, person: usize, seat: &Seat) {
        if seat.session.is_open() {
            // A cache: what cannot be kept is folded again.
            let _ = keep_snapshot(&self.store, &self.people[person].stream, &seat.session);
        }
    }

    fn lose_minds(&mut self, person: usize) {
        self.counts.lost_caches += 1;
        let stream = self.people[person].stream.clone();
        self.store.models.keep_only(&stream, &[]).unwrap();
        let seats = self.processes.iter().filter_map(|process| process.seats[person].as_ref());
        let named: Vec<Digest> = seats.filter_map(|seat| seat.session.state().mind).collect();
        if self.dice.chance(50) {
            for digest in named {
                let origin = mind_origin(digest);
                let _ = self.store.models.put(&stream, &origin, digest, b"not a mind's bytes");
            }
        }
    }

    /// Compares everything with the fold of the log.
    fn look(&mut self, person: usize) -> Result<(), Broken> {
        let truth = Truth::read(&*self.inner, &self.domain, &self.people[person].stream)?;
        truth.honours(&self.people[person])?;
        for seat in self.processes.iter().filter_map(|process| process.seats[person].as_ref()) {
            truth.knows(&seat.session)?;
        }
        Ok(())
    }

    /// The network and the disk are well again: whatever is due gets done, and then all must be in
    /// order.
    fn settle_down(&mut self) -> Result<(), Broken> {
        self.note(|| "quiet".to_owned());
        self.crash_all()?;
        self.store = self.store.clone().with_log(self.inner.clone());
        for person in 0..self.people.len() {
            for asked in self.people[person].unanswered() {
                while self.people[person].asked[asked].heard == Heard::Nothing {
                    self.deliver(0, person, asked)?;
                    self.poll(0, person)?;
                }
            }
            while !self.wake(0, person)? {
                self.poll(0, person)?;
            }
            while let Some(job) = self.jobs.pop() {
                self.train(job)?;
                self.poll(0, person)?;
            }
            self.look(person)?;
            let stream = self.people[person].stream.clone();
            let truth = Truth::read(&*self.inner, &self.domain, &stream)?;
            if truth.phase() == Phase::Learning {
                return Err(broken(Invariant::NoLostWork, "a training was forgotten"));
            }
            truth.wakes_alike(&self.domain, &self.store, &stream)?;
            let bare = Store::around(self.inner.clone(), self.store.keys.clone());
            truth.wakes_alike(&self.domain, &bare, &stream)?;
            self.counts.records += self.inner.head(&stream).expect("it is in memory").seq;
        }
        Ok(())
    }

    fn fresh_request(&mut self) -> RequestId {
        let mut request = [0xff; 16];
        request[..8].copy_from_slice(&self.dice.next().to_be_bytes());
        RequestId(request)
    }

    fn note(&mut self, line: impl FnOnce() -> String) {
        if let Some(trace) = &mut self.trace {
            trace.push(line());
        }
    }
}
