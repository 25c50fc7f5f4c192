//! People whose service is killed while they use it. They play episodes in small and large rooms,
//! teach and forget. After each restart they check that what they had been told is still true.

use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use apprentice::client::{
    Ask, Command, ErrorCode, OnClash, PersonAsk, Phase, Query, Response, Status,
};
use apprentice::ids::RequestId;
use apprentice::limits::REQUEST_RING;
use apprentice::world::Stage;

use crate::ledger::{Entry, Ledger, Outcome};
use crate::line::Line;
use apprentice_testkit::dice::Dice;

/// What the judge and the people tell each other.
#[derive(Default)]
pub struct Signals {
    /// The service is dead or about to die: disconnect.
    pub hang_up: AtomicBool,
    /// How many people have found everything again that they had been told.
    pub satisfied: AtomicUsize,
    /// Acknowledgements that scheduled a training.
    pub learning: AtomicUsize,
    /// Answers that said that the service has a defect.
    pub defects: AtomicUsize,
    /// What the service said when it could not carry something out.
    pub errors: Mutex<Vec<String>>,
}

pub struct Person<'a> {
    ledger: &'a Ledger,
    line: Line<'a>,
    dice: Dice,
    signals: &'a Signals,
}

/// What the repeated requests showed.
#[derive(Debug, Default, Clone, Copy)]
pub struct Insisted {
    /// Replies that came again, byte for byte.
    pub again: usize,
    /// Requests that were pending at the kill and are answered now.
    pub late: usize,
}

/// How many old requests are repeated after each restart, besides the latest.
const OLD_ONES: usize = 6;
const LATEST: usize = 6;

const SAYINGS: [&str; 10] = [
    "go to the mug",
    "pick up the mug",
    "go to the mug and pick it up",
    "open the fridge",
    "close the fridge",
    "go to the sink",
    "put the mug in the sink",
    "turn on the faucet",
    "go to the counter",
    "go to the apple and pick it up",
];

impl<'a> Person<'a> {
    pub fn new(ledger: &'a Ledger, socket: &Path, seed: u64, signals: &'a Signals) -> Person<'a> {
        let line = Line::new(socket, &ledger.user, &signals.hang_up);
        Person { ledger, line, dice: Dice::new(seed), signals }
    }

    /// Repeats requests: the latest and some old ones, acknowledged or not, and waits for a
    /// training that was under way. Panics if an acknowledgement has changed.
    ///
    /// - returns: none if the client was disconnected.
    pub fn insist(&mut self) -> Option<Insisted> {
        let mut insisted = Insisted::default();
        let count = self.ledger.entries().len();
        // A service remembers only this many requests of a person.
        let oldest = count.saturating_sub(REQUEST_RING - 64);
        let latest = count.saturating_sub(LATEST).max(oldest);
        let mut again: Vec<usize> = (latest..count).collect();
        if latest > oldest {
            again.extend((0..OLD_ONES).map(|_| oldest + self.dice.below(latest - oldest)));
        }
        for index in again {
            let Entry { id, command, heard } = self.ledger.entries()[index].clone();
            if matches!(heard, Outcome::Rejected) {
                continue;
            }
            let now = self.command(id, &command)?;
            match (heard, now) {
                (Outcome::Reply { bytes: first, reply }, Outcome::Reply { bytes, .. }) => {
                    assert_eq!(
                        first, bytes,
                        "{:?}: another answer than {reply:?}",
                        self.ledger.user
                    );
                    insisted.again += 1;
                }
                (Outcome::Reply { reply, .. }, _) => {
                    panic!("{:?}: {reply:?} was acknowledged and is unknown", self.ledger.user)
                }
                (_, now) => {
                    self.ledger.entries()[index].heard = now;
                    insisted.late += 1;
                }
            }
        }
        self.wait_until_learned()?;
        self.signals.satisfied.fetch_add(1, Ordering::SeqCst);
        Some(insisted)
    }

    /// A training that was under way when the service died ends (`NoLostWork`).
    fn wait_until_learned(&self) -> Option<Status> {
        loop {
            match self
                .line
                .ask(self.fresh(), &Ask::Person(PersonAsk::Wait { seconds: 5 }))?
                .response
            {
                Response::Waited(waited) if waited.status.phase != Phase::Learning => {
                    return Some(waited.status);
                }
                Response::Waited(_) => {}
                // The service says that it cannot continue.
                Response::Error(_) => return None,
                other => panic!("{:?}: waiting brought {other:?}", self.ledger.user),
            }
        }
    }

    /// Plays until the client is disconnected.
    pub fn live(&mut self) {
        while self.step().is_some() {}
    }

    /// One command that fits the phase.
    ///
    /// - returns: none if the client was disconnected, or the service said that it cannot continue.
    pub fn step(&mut self) -> Option<()> {
        let status = self.wait_until_learned()?;
        let command = self.think(&status)?;
        let id = self.fresh();
        let schedules = matches!(command, Command::FinishTeaching | Command::Forget { .. });
        let entry = Entry { id, command: command.clone(), heard: Outcome::Open };
        let index = {
            let mut entries = self.ledger.entries();
            entries.push(entry);
            entries.len() - 1
        };
        let heard = self.command(id, &command)?;
        let rejected = matches!(heard, Outcome::Rejected);
        self.ledger.entries()[index].heard = heard;
        if schedules && !rejected {
            self.signals.learning.fetch_add(1, Ordering::SeqCst);
        }
        if let (true, Command::Teach { explains, .. }) = (rejected, command) {
            // The lesson clashes with a seed, or has no run of actions. So it is declined.
            let command = Command::Teach { explains, actions: vec![], on_clash: OnClash::Ask };
            return self.record(command);
        }
        Some(())
    }

    fn record(&mut self, command: Command) -> Option<()> {
        let id = self.fresh();
        let entry = Entry { id, command: command.clone(), heard: Outcome::Open };
        self.ledger.entries().push(entry);
        let heard = self.command(id, &command)?;
        self.ledger.entries().last_mut().expect("it was just put there").heard = heard;
        Some(())
    }

    fn command(&self, id: RequestId, command: &Command) -> Option<Outcome> {
        let ask = Ask::Person(PersonAsk::Command(command.clone()));
        let mut heard = self.line.ask(id, &ask)?;
        while matches!(&heard.response, Response::Error(e) if e.code == ErrorCode::Internal) {
            self.signals.defects.fetch_add(1, Ordering::SeqCst);
            heard = self.line.ask(id, &ask)?;
        }
        match heard.response {
            Response::Reply(reply) => Some(Outcome::Reply { bytes: heard.bytes, reply }),
            Response::Rejected(_) => Some(Outcome::Rejected),
            Response::Error(error) => {
                self.signals.errors.lock().unwrap().push(error.message);
                None
            }
            other => panic!("{:?}: {command:?} brought {other:?}", self.ledger.user),
        }
    }

    fn think(&mut self, status: &Status) -> Option<Command> {
        Some(match status.phase {
            Phase::Idle if status.lessons > 5 || (status.lessons > 0 && self.dice.chance(15)) => {
                let lesson = self.oldest_lesson()?;
                Command::Forget { lesson }
            }
            Phase::Idle => Command::StartEpisode { stage: self.stage() },
            Phase::Interacting if status.utterances >= 5 && self.dice.chance(60) => Command::Done,
            Phase::Interacting => {
                let utterance = match status.utterances == 0 || self.dice.chance(15) {
                    true => format!("zorb{} the mug", self.dice.below(1_000_000)),
                    false => (*self.dice.of(&SAYINGS)).to_owned(),
                };
                Command::Say { utterance }
            }
            Phase::Teaching => match status.to_teach.first() {
                Some(said) => {
                    let have = status.actions.len() as u32;
                    let first = said.actions_before + 1;
                    let actions = (first..=have.min(first + 2)).collect();
                    Command::Teach { explains: said.seq, actions, on_clash: OnClash::Replace }
                }
                None => Command::FinishTeaching,
            },
            phase => panic!("nobody closes a session or speaks while learning: {phase:?}"),
        })
    }

    fn oldest_lesson(&self) -> Option<apprentice::ids::Seq> {
        match self.line.ask(self.fresh(), &Ask::Person(PersonAsk::Query(Query::Known)))?.response {
            Response::Known(known) => known.iter().find_map(|known| known.lesson),
            Response::Error(_) => None,
            other => panic!("{:?}: {other:?}", self.ledger.user),
        }
    }

    fn stage(&mut self) -> Stage {
        let task = "clean Mug CounterTop".to_owned();
        match self.dice.chance(25) {
            true => Stage::Scene { scene: large_room(), task },
            false => Stage::Task { task, seed: self.dice.below(40) as u64 },
        }
    }

    fn fresh(&self) -> RequestId {
        apprentice::client::fresh_id()
    }
}

/// A kitchen with so many things that its record has several chunks.
fn large_room() -> String {
    let mut text = "room = \"kitchen\"\n".to_owned();
    for kind in ["SinkBasin", "Fridge", "Microwave"] {
        text.push_str(&format!("[[thing]]\ntype = \"{kind}\"\n"));
    }
    text.push_str("[[thing]]\ntype = \"Faucet\"\non = \"SinkBasin\"\n");
    for counter in 1..=30 {
        text.push_str("[[thing]]\ntype = \"CounterTop\"\n");
        for kind in ["Mug", "Apple", "Knife", "Plate", "Tomato", "Cup", "Egg", "Bread"] {
            text.push_str(&format!(
                "[[thing]]\ntype = \"{kind}\"\non = \"CounterTop {counter}\"\n"
            ));
            if kind == "Mug" {
                text.push_str("states = [\"dirty\"]\n");
            }
        }
    }
    text
}
