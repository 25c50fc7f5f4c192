//! Two processes over one faulty log, in an order that dice choose. Both run the shipped seats,
//! directory and tenants' writer; the second is the one that should not be there.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use apprentice::actors::NewSession;
use apprentice::client::{PersonAsk, Phase, Query, Response};
use apprentice::ids::{RequestId, StreamId, TenantId, Timestamp, UserId};
use apprentice::invariants::Invariant;
use apprentice::learning::{self, Recipe};
use apprentice::replay::mind_origin;
use apprentice::session::Session;
use apprentice::store::{EventLog, FaultPlan, FaultyLog, Keys, MemoryLog, SeededEntropy, Store};
use apprentice::tenancy::Clock;

use crate::counts::Counts;
use crate::defects::Defect;
use crate::disturbed::Disturbed;
use crate::oracle::{Broken, Truth, broken};
use crate::orders::Given;
use crate::people::{Heard, Person};
use crate::process::{Asked, Job, Parcel, Process, Ticket, ToDirectory};
use apprentice_testkit::dice::Dice;
use apprentice_testkit::toy::Bells;

pub struct System {
    pub dice: Dice,
    /// What the wall clock of every machine reads.
    time: Arc<AtomicU64>,
    pub defect: Defect,
    pub domain: Arc<Bells>,
    pub inner: Arc<MemoryLog>,
    faulty: Arc<FaultyLog>,
    pub disturbed: Arc<Disturbed>,
    pub store: Store,
    pub processes: [Process; 2],
    pub people: Vec<Person>,
    /// What operators ordered, oldest first.
    pub orders: Vec<Given>,
    pub jobs: Vec<Job>,
    tickets: u64,
    /// The most people of one lab who may be awake.
    pub awake_limit: Option<u32>,
    /// The most people in one process who may be awake.
    pub awake_max: usize,
    /// In the last part nothing fails any more.
    pub quiet: bool,
    pub counts: Counts,
    trace: Option<Vec<String>>,
}

#[derive(Debug, Clone, Copy)]
enum Move {
    Ask,
    Deliver,
    Question,
    Directory,
    Act,
    Timer,
    Release,
    Train,
    Registrar,
    Order,
    Sign,
    Erase,
    CrashAll,
    CrashOne,
    ActorDies,
    Stop,
    LoseSnapshots,
    LoseMinds,
    JumpInTime,
    Look,
}

const MOVES: [(usize, Move); 20] = [
    (24, Move::Ask),
    (30, Move::Deliver),
    (4, Move::Question),
    (50, Move::Directory),
    (100, Move::Act),
    (5, Move::Timer),
    (8, Move::Release),
    (18, Move::Train),
    (30, Move::Registrar),
    (4, Move::Order),
    (1, Move::Sign),
    (1, Move::Erase),
    (1, Move::CrashAll),
    (1, Move::CrashOne),
    (2, Move::ActorDies),
    (1, Move::Stop),
    (2, Move::LoseSnapshots),
    (2, Move::LoseMinds),
    (3, Move::JumpInTime),
    (2, Move::Look),
];

/// The world, the recipe and the base mind: the same for all seeds.
pub fn beginning() -> &'static (Arc<Bells>, Arc<NewSession>) {
    static BEGINNING: OnceLock<(Arc<Bells>, Arc<NewSession>)> = OnceLock::new();
    BEGINNING.get_or_init(|| {
        let domain = Arc::new(Bells::sturdy());
        let recipe_text = Recipe::builtin("tiny").expect("the recipe `tiny` ships").to_owned();
        let recipe = Recipe::parse(&recipe_text).unwrap();
        let base = Arc::new(learning::train(&*domain, &recipe, &[]).unwrap());
        (domain, Arc::new(NewSession { recipe, recipe_text, base }))
    })
}

/// The clock that every machine reads.
fn clock(time: &Arc<AtomicU64>) -> Clock {
    let time = time.clone();
    Clock::new(move || Timestamp(time.load(Ordering::Relaxed)))
}

/// Two labs; both have an ada.
const PEOPLE: [(&str, &str); 3] = [("bells", "ada"), ("bells", "grace"), ("chimes", "ada")];

impl System {
    pub fn new(seed: u64, defect: Defect, traced: bool) -> System {
        let mut dice = Dice::new(seed);
        let keys = Arc::new(Keys::in_memory(Arc::new(SeededEntropy::new(seed))));
        let inner = Arc::new(MemoryLog::new(keys.clone()));
        // Some seeds have a calm log, others one with many faults.
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
        let person = |(tenant, user): (&str, &str)| {
            let (tenant, user) = (TenantId::new(tenant).unwrap(), UserId::new(user).unwrap());
            store.keys.make_tenant(&tenant).unwrap();
            let stream = store.keys.stream_id(&tenant, &user).unwrap();
            Person { tenant, user, stream, era: 0, asked: Vec::new() }
        };
        let awake_max = 2 + dice.below(2);
        let awake_limit = dice.chance(30).then_some(1);
        let time = Arc::new(AtomicU64::new(1_000_000));
        let process = || Process::new(awake_max, &clock(&time));
        System {
            dice,
            defect,
            domain: beginning().0.clone(),
            inner,
            faulty,
            disturbed,
            people: PEOPLE.map(person).into(),
            store,
            processes: [process(), process()],
            time,
            orders: Vec::new(),
            jobs: Vec::new(),
            tickets: 0,
            awake_limit,
            awake_max,
            quiet: false,
            counts: Counts::default(),
            trace: traced.then(Vec::new),
        }
    }

    /// Makes `moves` random moves, and checks the laws after them. Then nothing fails any more, all
    /// outstanding work is done, and the laws are checked again.
    pub fn run(mut self, moves: usize) -> (Result<Counts, Broken>, Vec<String>) {
        let lived = self.live(moves);
        (lived.map(|()| self.counts), self.trace.unwrap_or_default())
    }

    fn live(&mut self, moves: usize) -> Result<(), Broken> {
        for _ in 0..moves {
            self.counts.one("steps");
            let pause = self.dice.below(5_000) as u64;
            self.set_clock(self.now() + pause);
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
        let process = usize::from(self.dice.chance(15));
        match step {
            Move::Ask => {
                let session = self.processes[process].session_of(&self.people[person].stream);
                // If the person is asleep, their phase can only be guessed.
                if session.is_some() || self.dice.chance(25) {
                    self.people[person].ask(&mut self.dice, session);
                }
            }
            Move::Deliver => {
                if let Some(index) = self.which(person) {
                    self.deliver(process, person, index);
                }
            }
            Move::Question => self.question(process, person),
            Move::Directory => self.step_directory(process)?,
            Move::Act => self.act_one(process)?,
            Move::Timer => self.fire_timer(process)?,
            Move::Release => self.faulty.release(),
            Move::Train => {
                if !self.jobs.is_empty() {
                    let job = self.jobs.swap_remove(self.dice.below(self.jobs.len()));
                    self.train(job);
                }
            }
            Move::Registrar => self.step_registrar(process)?,
            Move::Order => self.order(process)?,
            Move::Sign => self.ask_to_sign(process)?,
            // The rightful process alone erases people.
            Move::Erase if self.dice.chance(60) => self.ask_to_erase(person),
            Move::Erase => {}
            Move::CrashAll if self.dice.chance(40) => self.crash_all()?,
            Move::CrashAll => {}
            Move::CrashOne => self.crash(process),
            Move::ActorDies => self.actor_dies(process),
            Move::Stop if self.dice.chance(30) => self.stop(process),
            Move::Stop => {}
            Move::LoseSnapshots => {
                self.counts.one("caches lost");
                self.store.snapshots.forget(&self.people[person].stream).unwrap();
            }
            Move::LoseMinds => self.lose_minds(person),
            // Clocks of machines go backwards, too.
            Move::JumpInTime => {
                let back = self.now() / 2 + self.dice.below(1_000_000) as u64;
                self.set_clock(back);
            }
            Move::Look => {
                self.look(person)?;
                self.look_at_labs()?;
            }
        }
        Ok(())
    }

    /// Mostly a request without an answer. Sometimes an old one again, as a network may deliver it.
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

    fn deliver(&mut self, process: usize, person: usize, index: usize) {
        let (command, request) = {
            let asked = &self.people[person].asked[index];
            (asked.command.clone(), asked.request)
        };
        let asked = Asked { person, era: self.people[person].era, index };
        self.hand_in(process, person, PersonAsk::Command(command), request, Some(asked));
    }

    /// Asks a query, which changes nothing.
    fn question(&mut self, process: usize, person: usize) {
        let ask = match self.dice.below(4) {
            0 => PersonAsk::Query(Query::Look),
            1 => PersonAsk::Query(Query::Status),
            2 => PersonAsk::Query(Query::Known),
            _ => PersonAsk::Wait { seconds: 5 },
        };
        let request = self.fresh_request();
        self.hand_in(process, person, ask, request, None);
    }

    fn hand_in(
        &mut self,
        process: usize,
        person: usize,
        ask: PersonAsk,
        request: RequestId,
        asked: Option<Asked>,
    ) {
        let ticket = Ticket { number: self.next_ticket(), asked, attention: None };
        let Person { user, stream, .. } = &self.people[person];
        let (user, mut stream) = (user.clone(), stream.clone());
        if self.defect == Defect::MixesTenants {
            let other = self.people.iter().find(|other| other.user == user);
            stream = other.expect("it is there itself").stream.clone();
        }
        self.processes[process].unanswered.insert(ticket.number);
        let parcel = Parcel { ticket, ask, request };
        self.processes[process].to_directory.push_back(ToDirectory::Asked { stream, user, parcel });
    }

    /// What a person gets as an answer.
    pub fn hear(&mut self, asked: Asked, response: Response) -> Result<(), Broken> {
        let person = &mut self.people[asked.person];
        if person.era != asked.era {
            // The person was erased meanwhile.
            return Ok(());
        }
        let asked = &mut person.asked[asked.index];
        match (response, &asked.heard) {
            (Response::Reply(reply), Heard::Reply(first)) if *first != reply => {
                let how = format!("{:?} got another reply the second time", asked.command);
                return Err(broken(Invariant::ExactlyOnce, how));
            }
            (Response::Reply(reply), _) => {
                self.counts.one("acknowledged");
                asked.heard = Heard::Reply(reply);
            }
            (Response::Rejected(_), heard) => {
                self.counts.one("rejected");
                if *heard == Heard::Nothing {
                    asked.heard = Heard::Rejected;
                }
            }
            // The client asks again.
            _ => {}
        }
        Ok(())
    }

    fn crash_all(&mut self) -> Result<(), Broken> {
        self.counts.one("crashes");
        self.crash(0);
        self.crash(1);
        self.faulty.restart();
        for person in 0..self.people.len() {
            self.look(person)?;
        }
        self.look_at_labs()
    }

    pub fn crash(&mut self, process: usize) {
        self.note(|| format!("process {process} dies"));
        self.jobs.retain(|job| job.process != process);
        self.processes[process] = Process::new(self.awake_max, &clock(&self.time));
    }

    fn lose_minds(&mut self, person: usize) {
        self.counts.one("caches lost");
        let stream = self.people[person].stream.clone();
        self.store.models.keep_only(&stream, &[]).unwrap();
        let named: Vec<_> = self.sessions_of(&stream).filter_map(|it| it.state().mind).collect();
        if self.dice.chance(50) {
            for digest in named {
                let origin = mind_origin(digest);
                let _ = self.store.models.put(&stream, &origin, digest, b"not a mind's bytes");
            }
        }
    }

    fn sessions_of(&self, stream: &StreamId) -> impl Iterator<Item = &Session<Bells>> {
        self.processes.iter().filter_map(|process| process.session_of(stream))
    }

    /// Compares everything with the fold of the log.
    fn look(&mut self, person: usize) -> Result<(), Broken> {
        let truth = Truth::read(&*self.inner, &self.domain, &self.people[person].stream)?;
        truth.honours(&self.people[person])?;
        for session in self.sessions_of(&self.people[person].stream) {
            truth.knows(session)?;
        }
        Ok(())
    }

    /// The network and the disk work again. All outstanding work is done, and then every law must
    /// hold.
    fn settle_down(&mut self) -> Result<(), Broken> {
        self.note(|| "quiet".to_owned());
        self.quiet = true;
        self.work_off(1)?;
        self.work_off(0)?;
        self.crash_all()?;
        self.store = self.store.clone().with_log(self.inner.clone());
        for person in 0..self.people.len() {
            for index in self.people[person].unanswered() {
                while self.people[person].asked[index].heard == Heard::Nothing {
                    self.deliver(0, person, index);
                    self.work_off(0)?;
                }
            }
            // Waking a user starts a training that is still due.
            self.question(0, person);
            self.work_off(0)?;
            while let Some(job) = self.jobs.pop() {
                self.train(job);
                self.work_off(0)?;
            }
            self.check_at_the_end(person)?;
        }
        self.settle_labs()
    }

    /// Works off all that came in, to the last answer, and sees that nobody was forgotten.
    pub fn work_off(&mut self, process: usize) -> Result<(), Broken> {
        while !self.processes[process].is_quiet() && !self.faulty.crashed() {
            self.faulty.release();
            self.step_directory(process)?;
            self.act_one(process)?;
            self.step_registrar(process)?;
            self.set_clock(self.now() + 1);
        }
        if self.faulty.crashed() {
            return Ok(());
        }
        // Clients that wait for a training are answered at its end, or by a timer.
        let waiting: Vec<u64> = self.processes[process].actors.keys().copied().collect();
        for generation in waiting {
            self.fire_timers_of(process, generation)?;
        }
        match self.processes[process].unanswered.first() {
            Some(number) => {
                let how = format!("request {number} was taken and never answered");
                Err(broken(Invariant::AnsweredOnce, how))
            }
            None => Ok(()),
        }
    }

    fn check_at_the_end(&mut self, person: usize) -> Result<(), Broken> {
        self.look(person)?;
        let stream = self.people[person].stream.clone();
        let truth = Truth::read(&*self.inner, &self.domain, &stream)?;
        if truth.phase() == Phase::Learning {
            return Err(broken(Invariant::NoLostWork, "a training was forgotten"));
        }
        truth.wakes_alike(&self.domain, &self.store, &stream)?;
        let bare = Store::around(self.inner.clone(), self.store.keys.clone());
        truth.wakes_alike(&self.domain, &bare, &stream)?;
        let records = self.inner.head(&stream).expect("it is in memory").seq;
        self.counts.many("records", records);
        Ok(())
    }

    /// Microseconds.
    pub fn now(&self) -> u64 {
        self.time.load(Ordering::Relaxed)
    }

    fn set_clock(&self, time: u64) {
        self.time.store(time, Ordering::Relaxed);
    }

    pub fn next_ticket(&mut self) -> u64 {
        self.tickets += 1;
        self.tickets
    }

    pub fn fresh_request(&mut self) -> RequestId {
        let mut request = [0xff; 16];
        request[..8].copy_from_slice(&self.dice.number().to_be_bytes());
        RequestId(request)
    }

    pub fn note(&mut self, line: impl FnOnce() -> String) {
        if let Some(trace) = &mut self.trace {
            trace.push(line());
        }
    }
}
