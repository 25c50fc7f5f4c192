//! One person who does anything.

use std::sync::Arc;

use apprentice::client::{Command, OnClash, Phase, RejectionCode, Reply};
use apprentice::events::{Ending, Event, Record};
use apprentice::ids::{Digest, RequestId, Seq, Timestamp, UserId};
use apprentice::language::{Outcome, Step};
use apprentice::learning::{Mind, train};
use apprentice::session::{self, Outstanding, Proposed, Rejection, Session, reply_of};
use apprentice::store::SeededEntropy;
use apprentice::world::household::{Household, Kind};
use apprentice::world::{StageError, World};

use super::scenes::{pick, said, stage};
use apprentice_testkit::chance::below;
use apprentice_testkit::recorded::recorded;

/// The state at which every person begins.
pub struct House {
    pub domain: Arc<Household>,
    pub recipe_text: String,
    pub base: Arc<Mind>,
}

macro_rules! counts {
    ($($name:ident),*) => {
        /// What happened, so that a test in which it never happened fails.
        #[derive(Debug, Default)]
        pub struct Counts {
            pub people: u64,
            pub records: u64,
            $(pub $name: u64,)*
        }

        impl Counts {
            pub fn plus(self, other: Counts) -> Counts {
                Counts {
                    people: self.people + other.people,
                    records: self.records + other.records,
                    $($name: self.$name + other.$name,)*
                }
            }

            pub fn assert_that_all_was_met(&self) {
                $(assert!(self.$name > 0, "{} in {} people", stringify!($name), self.people);)*
            }
        }
    };
}

counts!(
    refused,
    goal_held_already,
    understood,
    impossible,
    not_sure,
    achieved,
    abandoned,
    taught,
    declined,
    replaced,
    forgotten,
    trained,
    not_trained,
    closed,
    repeated,
    reused_ids
);

pub struct Person<'a> {
    house: &'a House,
    dice: SeededEntropy,
    session: Session<Household>,
    records: Vec<Record>,
    /// What was accepted, with its request id.
    asked: Vec<(RequestId, session::Command)>,
    requests: u128,
    kinds: Vec<Kind>,
    /// The mind that the last training gave.
    trained: Option<Arc<Mind>>,
}

/// A whole history.
pub fn live(house: &House, seed: u64, counts: &mut Counts) {
    let mut person = Person::new(house, seed, counts);
    for _ in 0..12 + below(&person.dice, 24) {
        let command = person.wish();
        let _ = person.give(&command, counts);
        person.ask_again(counts);
    }
    counts.people += 1;
    counts.records += person.records.len() as u64;
    person.fold_again();
}

impl<'a> Person<'a> {
    pub fn new(house: &'a House, seed: u64, counts: &mut Counts) -> Person<'a> {
        let mut person = Person {
            house,
            dice: SeededEntropy::new(seed),
            session: Session::new(house.domain.clone()),
            records: Vec::new(),
            asked: Vec::new(),
            requests: 0,
            kinds: Vec::new(),
            trained: None,
        };
        let user = UserId::new("ada").unwrap();
        let (recipe_text, mind) = (house.recipe_text.clone(), house.base.digest());
        person.give(&session::Command::Open { user, recipe_text, mind }, counts).unwrap();
        person.session.install(house.base.clone());
        person
    }

    fn chance(&self, percent: usize) -> bool {
        below(&self.dice, 100) < percent
    }

    /// Proposes and applies, as an actor and a log do.
    pub fn give(
        &mut self,
        command: &session::Command,
        counts: &mut Counts,
    ) -> Result<Reply, Rejection> {
        self.requests += 1;
        let request = RequestId(self.requests.to_be_bytes());
        let at = self.session.next_at(Timestamp(1_000));
        let proposed = self.session.propose(command, request, at).inspect_err(|rejection| {
            counts.refused += 1;
            let held = matches!(rejection, Rejection::Stage(StageError::Achieved { .. }));
            assert!(!held || rejection.code() == RejectionCode::BadStage);
            counts.goal_held_already += u64::from(held);
        })?;
        let turn = match proposed {
            Proposed::Turn(turn) => turn,
            other => panic!("{command:?} leads to {other:?}"),
        };
        assert_eq!(turn.after, self.session.head());
        let first = self.records.len();
        for event in turn.batch.events {
            self.count(&event, counts);
            let record = recorded(self.session.head(), &event, request, at);
            let applied = self.session.apply(&record);
            applied.unwrap_or_else(|error| panic!("{command:?}: {error}"));
            if let Event::EpisodeEnded(ended) = &record.event {
                // The fold accepts an old record that leaves one out. No code writes such a record
                // today.
                let said = &self.session.state().episode.as_ref().expect("it ended").unexplained;
                assert!(said.iter().map(|said| said.seq).eq(ended.to_teach.iter().copied()));
            }
            self.records.push(record);
        }
        self.asked.push((request, command.clone()));
        self.after(command);
        Ok(reply_of(&self.records[first..]))
    }

    fn count(&self, event: &Event, counts: &mut Counts) {
        match event {
            Event::Interpreted(event) => match event.answer.outcome {
                Outcome::Understood { .. } => counts.understood += 1,
                Outcome::Impossible { .. } => counts.impossible += 1,
                Outcome::NotSure | Outcome::Asked { .. } | Outcome::Told { .. } => {
                    counts.not_sure += 1;
                }
            },
            Event::EpisodeEnded(event) => match event.ending {
                Ending::Achieved => counts.achieved += 1,
                Ending::Abandoned => counts.abandoned += 1,
            },
            Event::DecompositionTaught(_) => counts.taught += 1,
            Event::DecompositionDeclined(_) => counts.declined += 1,
            Event::LessonForgotten(_) if self.session.phase() == Phase::Teaching => {
                counts.replaced += 1;
            }
            Event::LessonForgotten(_) => counts.forgotten += 1,
            Event::RetrainCompleted(_) => counts.trained += 1,
            Event::RetrainFailed(_) => counts.not_trained += 1,
            Event::SessionClosed(_) => counts.closed += 1,
            _ => {}
        }
    }

    fn after(&mut self, command: &session::Command) {
        let _ = self.session.status();
        if self.session.mind_wanted().is_some()
            && let Some(mind) = self.trained.take()
        {
            self.session.install(mind);
        }
        if let session::Command::Person(Command::StartEpisode { .. }) = command {
            let episode = self.session.state().episode.as_ref().expect("it just started");
            let done = self.house.domain.achieved(&episode.scene, &episode.task);
            assert!(!done, "there is nothing to do");
        }
    }

    /// The next step of the shortest way to the goal, in words.
    fn next_step(&self) -> Option<String> {
        let episode = self.session.state().episode.as_ref()?;
        let plan = self.house.domain.plan(&episode.scene, &episode.task)?;
        plan.steps.first().map(in_words)
    }

    /// A sensible command, or any command.
    fn wish(&mut self) -> session::Command {
        if self.chance(12) {
            return self.anything();
        }
        match self.session.phase() {
            Phase::Idle if self.chance(15) => self.forget(),
            Phase::Idle => self.start(),
            Phase::Interacting if self.chance(8) => Command::Done.into(),
            Phase::Interacting => self.say(),
            Phase::Teaching if self.chance(25) => Command::FinishTeaching.into(),
            Phase::Teaching if self.chance(15) => self.forget(),
            Phase::Teaching => self.teach(),
            Phase::Learning => self.finish(),
            Phase::Closed => self.anything(),
        }
    }

    fn anything(&mut self) -> session::Command {
        match below(&self.dice, 16) {
            0 => session::Command::Open {
                user: UserId::new("eve").unwrap(),
                recipe_text: self.house.recipe_text.clone(),
                mind: Digest::ZERO,
            },
            1 | 2 => self.start(),
            3 | 4 => self.say(),
            5 | 6 => Command::Done.into(),
            7..=9 => self.teach(),
            10 | 11 => Command::FinishTeaching.into(),
            12 | 13 => self.forget(),
            14 => match self.chance(20) {
                true => Command::Close { reason: "enough of this".to_owned() }.into(),
                false => Command::Say { utterance: " \t".to_owned() }.into(),
            },
            _ => session::Command::FinishRetrain {
                recipe: Digest::ZERO,
                outcome: Err("no".to_owned()),
            },
        }
    }

    fn start(&mut self) -> session::Command {
        let (stage, kinds) = stage(&self.dice);
        self.kinds = kinds;
        Command::StartEpisode { stage }.into()
    }

    fn say(&mut self) -> session::Command {
        let kind = || pick(&self.dice, &self.kinds).map_or("mug".into(), |kind| said(kind.name()));
        let step = self.chance(60).then(|| self.next_step()).flatten();
        if let Some(utterance) = step {
            return Command::Say { utterance }.into();
        }
        let utterance = match below(&self.dice, 10) {
            0 | 1 => format!("flibber the {}", kind()),
            2 => format!("{} zork", kind()),
            3 => format!("put the {} in the {}", kind(), kind()),
            4 => format!("pick up the {} and put it on the {}", kind(), kind()),
            5 => format!("open the {} then close the {}", kind(), kind()),
            6 => format!("turn on the {}", kind()),
            7 => format!("go to the {} and pick up the {}", kind(), kind()),
            8 => kind(),
            _ => format!("go to the {}", kind()),
        };
        Command::Say { utterance }.into()
    }

    fn teach(&mut self) -> session::Command {
        let status = self.session.status();
        let explains = match pick(&self.dice, &(0..status.to_teach.len()).collect::<Vec<_>>()) {
            Some(place) if self.chance(85) => status.to_teach[place].seq,
            _ => self.any_seq(),
        };
        let before = status.to_teach.iter().find(|open| open.seq == explains);
        let before = before.map_or(0, |open| open.actions_before);
        let have = status.actions.len() as u32;
        let actions = match below(&self.dice, 8) {
            0 => Vec::new(),
            1 => (0..3).map(|_| below(&self.dice, 6) as u32).collect(),
            2 => vec![have + 1],
            3 => (1..=have).collect(),
            _ if before < have => {
                let first = before + 1 + below(&self.dice, (have - before) as usize) as u32;
                (first..=first + below(&self.dice, (have - first + 1) as usize) as u32).collect()
            }
            _ => Vec::new(),
        };
        let on_clash = [OnClash::Ask, OnClash::Replace, OnClash::Replace, OnClash::Keep];
        Command::Teach { explains, actions, on_clash: on_clash[below(&self.dice, 4)] }.into()
    }

    fn forget(&mut self) -> session::Command {
        let live: Vec<Seq> = self.session.state().lessons.iter().map(|live| live.seq).collect();
        let lesson = pick(&self.dice, &live).filter(|_| self.chance(85));
        Command::Forget { lesson: lesson.unwrap_or_else(|| self.any_seq()) }.into()
    }

    fn any_seq(&self) -> Seq {
        Seq::new(1 + below(&self.dice, self.records.len() + 3) as u64).unwrap()
    }

    /// Ends a training. Only sometimes it trains the real mind, which takes longest.
    fn finish(&mut self) -> session::Command {
        let Some(Outstanding::Retrain { recipe, lessons }) = self.session.outstanding() else {
            return Command::Done.into();
        };
        let digest = recipe.digest();
        if lessons.len() > 2 || !self.chance(15) {
            let outcome = Err("the trainer had a bad day".to_owned());
            return session::Command::FinishRetrain { recipe: digest, outcome };
        }
        let mind = Arc::new(train(&*self.house.domain, &recipe, &lessons).unwrap());
        let outcome = Ok((mind.digest(), Default::default()));
        let command = session::Command::FinishRetrain { recipe: digest, outcome };
        self.trained = Some(mind);
        command
    }

    /// An id that was answered before, with the same command and with another one.
    fn ask_again(&mut self, counts: &mut Counts) {
        if !self.chance(10) {
            return;
        }
        let (request, command) = self.asked[below(&self.dice, self.asked.len())].clone();
        let records: Vec<Record> =
            self.records.iter().filter(|record| record.request == request).cloned().collect();
        let proposed = self.session.propose(&command, request, Timestamp(9_000));
        let (first, last) = (records[0].seq, records[records.len() - 1].seq);
        assert_eq!(proposed, Ok(Proposed::Repeat { first, last }));
        assert_eq!(self.session.repeat(&command, &records), Ok(reply_of(&records)));
        counts.repeated += 1;
        let other = self.anything();
        if std::mem::discriminant(&other) != std::mem::discriminant(&command) {
            let refused = self.session.repeat(&other, &records).unwrap_err();
            assert_eq!(refused.code(), RejectionCode::RequestIdReused, "{other:?}");
            assert!(refused.to_string().contains(command.name()), "{refused}");
            counts.reused_ids += 1;
        }
    }

    fn fold_again(&self) {
        let mut again = Session::new(self.house.domain.clone());
        for record in &self.records {
            again.apply(record).unwrap_or_else(|error| panic!("{:?}: {error}", record.event));
        }
        assert_eq!(again.state_digest(), self.session.state_digest());
    }
}

/// A step in the words of a person.
fn in_words(step: &Step) -> String {
    let things: Vec<String> = step.args.iter().map(|kind| said(kind.as_str())).collect();
    match (step.operator.as_str(), &things[..]) {
        ("GOTO", [to]) => format!("go to the {to}"),
        ("PICKUP", [thing]) => format!("pick up the {thing}"),
        ("OPEN", [door]) => format!("open the {door}"),
        ("CLOSE", [door]) => format!("close the {door}"),
        ("TOGGLE", [thing]) => format!("toggle the {thing}"),
        ("PUT", [thing, place]) => format!("put the {thing} in the {place}"),
        other => panic!("no words for {other:?}"),
    }
}
