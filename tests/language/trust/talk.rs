//! One person and their robot in a scene, without threads, a log or a service.
//!
//! Everything is said to a session, as in a service. Each utterance is recorded, encoded, decoded
//! and applied. So the memory of what was handled last, and of which things were chosen, works as
//! in a service.

use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

use apprentice::client::{Command, Told};
use apprentice::events::{Event, Record};
use apprentice::ids::{RequestId, Timestamp, UserId};
use apprentice::language::{Answer, Outcome, Program, Step, Utterance};
use apprentice::learning::{Lesson, Mind, Recipe, train};
use apprentice::session::{self, Proposed, Rejection, Session, Turn, reply_of};
use apprentice::world::household::{Household, Scene, Task};
use apprentice::world::{Show, Stage, View, World};

use apprentice_testkit::recorded::recorded;

/// The recipe under test.
pub const RECIPE: &str = "default-2";

/// What washing is, taught with the mug next to the robot.
pub const WASH_MUG: (&str, &str) = (
    "wash the mug",
    "GOTO Mug; PICKUP Mug; GOTO SinkBasin; PUT Mug SinkBasin; TOGGLE Faucet; TOGGLE Faucet; \
     PICKUP Mug",
);

/// An utterance, and the program that was taught for it.
pub type Taught<'a> = (&'a str, &'a str);

struct House {
    domain: Arc<Household>,
    recipe_text: &'static str,
    recipe: Recipe,
}

static HOUSE: LazyLock<House> = LazyLock::new(|| {
    let text = Recipe::builtin(RECIPE);
    let recipe_text = text.unwrap_or_else(|| panic!("there is no recipe {RECIPE}"));
    let recipe = Recipe::parse(recipe_text).unwrap();
    House { domain: Arc::new(Household::new()), recipe_text, recipe }
});

/// Minds by their lessons. Tests with the same lessons use the same mind.
static MINDS: Mutex<BTreeMap<String, Arc<Mind>>> = Mutex::new(BTreeMap::new());

fn stage(setting: &Setting) -> (Scene, Task) {
    let stage = Stage::Scene { scene: setting.text(), task: "free".to_owned() };
    HOUSE.domain.stage(&stage).unwrap_or_else(|error| panic!("{error}\n{}", setting.text()))
}

fn mind(setting: &Setting, lessons: &[Taught<'_>]) -> Arc<Mind> {
    let (scene, task) = stage(setting);
    let (scene, task) = (Arc::new(scene), Arc::new(task));
    let key = format!("{lessons:?} in {}", HOUSE.domain.digest(&scene));
    let mut minds = MINDS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = minds.get(&key) {
        return known.clone();
    }
    let lesson = |(said, program): &Taught<'_>| {
        let program: Program = program.parse().unwrap();
        let mut after = (*scene).clone();
        for step in &program.steps {
            let done = HOUSE.domain.step(&mut after, &task, step);
            done.unwrap_or_else(|error| panic!("the lesson {said:?} cannot be shown: {error}"));
        }
        let utterance = Utterance::new(said).unwrap();
        let (scene, task) = (scene.clone(), task.clone());
        Lesson { utterance, program, scene, task, mentioned: None }
    };
    let lessons: Vec<Lesson<Scene, Task>> = lessons.iter().map(lesson).collect();
    let mind = Arc::new(train(&*HOUSE.domain, &HOUSE.recipe, &lessons).unwrap());
    minds.insert(key, mind.clone());
    mind
}

pub struct Talk {
    session: Session<Household>,
    records: Vec<Record>,
    requests: u128,
}

/// A session is not copied. It is folded again, as when its user wakes.
impl Clone for Talk {
    fn clone(&self) -> Talk {
        let mut session = Session::new(HOUSE.domain.clone());
        for record in &self.records {
            session.apply(record).unwrap_or_else(|error| panic!("{:?}: {error}", record.event));
        }
        session.install(self.session.mind().expect("it was installed").clone());
        Talk { session, records: self.records.clone(), requests: self.requests }
    }
}

impl Talk {
    pub fn new(setting: &Setting) -> Talk {
        Talk::taught(setting, &[])
    }

    /// The lessons were taught in the present setting.
    pub fn taught(setting: &Setting, lessons: &[Taught<'_>]) -> Talk {
        Talk::taught_in(setting, lessons, setting)
    }

    /// The lessons were taught in one setting. The talk is in another.
    pub fn taught_in(taught: &Setting, lessons: &[Taught<'_>], setting: &Setting) -> Talk {
        let mind = mind(taught, lessons);
        let session = Session::new(HOUSE.domain.clone());
        let mut talk = Talk { session, records: Vec::new(), requests: 0 };
        let user = UserId::new("ada").unwrap();
        let recipe_text = HOUSE.recipe_text.to_owned();
        talk.give(session::Command::Open { user, recipe_text, mind: mind.digest() }).unwrap();
        talk.session.install(mind);
        let stage = Stage::Scene { scene: setting.text(), task: "free".to_owned() };
        talk.give(Command::StartEpisode { stage })
            .unwrap_or_else(|refused| panic!("{refused}\n{}", setting.text()));
        talk
    }

    /// Continues after these sentences, which must be understood.
    pub fn after(mut self, said: &[&str]) -> Talk {
        for text in said {
            let answer = self.says(text);
            assert!(acted(&answer), "{text:?} only sets the scene, but: {}", shown(&answer));
        }
        self
    }

    /// The answer that would be given now. Nothing changes.
    pub fn asks(&self, text: &str) -> Answer {
        let command = Command::Say { utterance: text.to_owned() }.into();
        let turn = self.proposes(&command, self.requests + 1);
        let turn = turn.unwrap_or_else(|refused| panic!("{text:?} is refused: {refused}"));
        let answers = turn.batch.events.into_iter().filter_map(|event| match event {
            Event::Interpreted(event) => Some(event.answer),
            _ => None,
        });
        answers.last().unwrap_or_else(|| panic!("{text:?} has no answer"))
    }

    /// Says it. If it is understood, it is carried out.
    pub fn says(&mut self, text: &str) -> Answer {
        self.tries(text).unwrap_or_else(|refused| panic!("{text:?} is refused: {refused}"))
    }

    /// - errors: the sentence of the refusal, if the text is no utterance.
    pub fn tries(&mut self, text: &str) -> Result<Answer, Rejection> {
        let first = self.records.len();
        self.give(Command::Say { utterance: text.to_owned() })?;
        let told = reply_of(&self.records[first..]).told;
        let answers = told.into_iter().filter_map(|told| match told {
            Told::Answered { answer, .. } => Some(answer),
            _ => None,
        });
        Ok(answers.last().unwrap_or_else(|| panic!("{text:?} has no answer")))
    }

    fn proposes(&self, command: &session::Command, request: u128) -> Result<Turn, Rejection> {
        let at = self.session.next_at(Timestamp(1_000));
        match self.session.propose(command, RequestId(request.to_be_bytes()), at)? {
            Proposed::Turn(turn) => Ok(turn),
            other => panic!("{command:?} leads to {other:?}"),
        }
    }

    /// Proposes and applies, as an actor and a log do.
    fn give(&mut self, command: impl Into<session::Command>) -> Result<(), Rejection> {
        let command = command.into();
        self.requests += 1;
        let turn = self.proposes(&command, self.requests)?;
        let (request, at) = (turn.batch.request, turn.batch.at);
        for event in turn.batch.events {
            let record = recorded(self.session.head(), &event, request, at);
            let applied = self.session.apply(&record);
            applied.unwrap_or_else(|error| panic!("{command:?}: {error}"));
            self.records.push(record);
        }
        Ok(())
    }

    /// Folds the records again, from the first.
    pub fn fold_again(&self) {
        let mut again = Session::new(HOUSE.domain.clone());
        for record in &self.records {
            again.apply(record).unwrap_or_else(|error| panic!("{:?}: {error}", record.event));
        }
        assert_eq!(again.state_digest(), self.session.state_digest());
    }

    pub fn sees(&self) -> View {
        let episode = self.session.state().episode.as_ref().expect("it was started");
        HOUSE.domain.look(&episode.scene)
    }

    /// How many primitives were carried out.
    pub fn actions(&self) -> usize {
        self.session.state().episode.as_ref().map_or(0, |episode| episode.actions.len())
    }

    /// Nothing is carried out, whatever the reason.
    pub fn declines<S: AsRef<str>>(&self, what: &str, said: &[S]) {
        let mut report = Report::new(what);
        for text in said {
            let answer = self.asks(text.as_ref());
            report.check(!acted(&answer), || line(text.as_ref(), "nothing", &answer));
        }
        report.finish();
    }

    /// Not understood, rather than understood and impossible.
    pub fn is_unsure<S: AsRef<str>>(&self, what: &str, said: &[S]) {
        let mut report = Report::new(what);
        for text in said {
            let answer = self.asks(text.as_ref());
            let unsure = answer.outcome == Outcome::NotSure;
            report.check(unsure, || line(text.as_ref(), "?", &answer));
        }
        report.finish();
    }

    /// Understood, but the world forbids it. The reason contains `part`.
    pub fn is_impossible(&self, what: &str, said: &[(&str, &str)]) {
        let mut report = Report::new(what);
        for (text, part) in said {
            let answer = self.asks(text);
            let right = reason(&answer).is_some_and(|reason| reason.contains(&part.to_lowercase()));
            report.check(right, || line(text, &format!("! {part}"), &answer));
        }
        report.finish();
    }

    /// Carried out, with exactly this program.
    pub fn does<S: AsRef<str>>(&self, what: &str, said: &[(S, &str)]) {
        let mut report = Report::new(what);
        for (text, program) in said {
            let answer = self.asks(text.as_ref());
            report.check(shown(&answer) == *program, || line(text.as_ref(), program, &answer));
        }
        report.finish();
    }

    /// Carried out, with this program. Walks do not count.
    pub fn acts<S: AsRef<str>>(&self, what: &str, said: &[(S, &str)]) {
        let mut report = Report::new(what);
        for (text, program) in said {
            let answer = self.asks(text.as_ref());
            let right = done(&answer).is_some_and(|found| without_walks(found) == *program);
            report.check(right, || line(text.as_ref(), program, &answer));
        }
        report.finish();
    }
}

/// What was carried out.
pub fn done(answer: &Answer) -> Option<&Program> {
    match &answer.outcome {
        Outcome::Understood { program, .. } => Some(program),
        _ => None,
    }
}

pub fn acted(answer: &Answer) -> bool {
    done(answer).is_some()
}

/// Why it is impossible, in small letters.
pub fn reason(answer: &Answer) -> Option<String> {
    match &answer.outcome {
        Outcome::Impossible { reason, .. } => Some(reason.to_lowercase()),
        _ => None,
    }
}

/// A program, `! ` and a reason, or `?`.
pub fn shown(answer: &Answer) -> String {
    match &answer.outcome {
        Outcome::Understood { program, .. } => program.to_string(),
        Outcome::Impossible { reason, .. } => format!("! {reason}"),
        Outcome::Asked { question } => format!("~ {}", question.text),
        Outcome::Told { text } => format!("i {text}"),
        Outcome::NotSure => "?".to_owned(),
    }
}

/// One line of a report.
pub fn line(text: &str, expected: &str, answer: &Answer) -> String {
    format!("{text:?}: expected {expected}, found {}", shown(answer))
}

/// The steps with the things they acted on: `PUT Apple 2 > Fridge`. None when nothing was done.
pub fn bound(answer: &Answer) -> Option<Vec<String>> {
    match &answer.outcome {
        Outcome::Understood { program, bindings } => {
            let steps = program.steps.iter().zip(bindings);
            Some(steps.map(|(step, things)| with_things(step, things)).collect())
        }
        _ => None,
    }
}

fn with_things(step: &Step, things: &[String]) -> String {
    format!("{} {}", step.operator.as_str(), things.join(" > "))
}

/// The steps but the walks.
pub fn without_walks(program: &Program) -> String {
    let steps = program.steps.iter().filter(|step| step.operator.as_str() != "GOTO");
    steps.map(ToString::to_string).collect::<Vec<_>>().join("; ")
}

/// The results of a table. It collects every failure, so that one run shows all of them.
pub struct Report {
    what: String,
    tried: usize,
    wrong: Vec<String>,
}

impl Report {
    pub fn new(what: &str) -> Report {
        Report { what: what.to_owned(), tried: 0, wrong: Vec::new() }
    }

    pub fn check(&mut self, right: bool, line: impl FnOnce() -> String) {
        self.tried += 1;
        if !right {
            self.wrong.push(line());
        }
    }

    /// - panics: if anything is wrong.
    pub fn finish(self) {
        self.finish_with(0);
    }

    /// - panics: if more than `allowed` are wrong, or nothing was tried.
    pub fn finish_with(self, allowed: usize) {
        let Report { what, tried, wrong } = self;
        assert!(tried > 0, "{what}: nothing was tried");
        let lines = wrong.join("\n  ");
        let count = wrong.len();
        assert!(count <= allowed, "{what}: {count} of {tried} are wrong:\n  {lines}");
    }
}

/// A scene file that a test changes before it is played.
#[derive(Clone)]
pub struct Setting(toml::Table);

impl Setting {
    /// A kitchen with one of each thing.
    pub fn kitchen() -> Setting {
        Setting::read(include_str!("scenes/kitchen.toml"))
    }

    /// A living room with two of some things.
    pub fn lounge() -> Setting {
        Setting::read(include_str!("scenes/lounge.toml"))
    }

    /// A kitchen with two or three of most things.
    pub fn pairs() -> Setting {
        Setting::read(include_str!("scenes/pairs.toml"))
    }

    pub fn read(text: &str) -> Setting {
        Setting(text.parse().unwrap())
    }

    /// `Mug 2` is the second mug of the file, `Mug` the first.
    fn thing(&mut self, name: &str) -> &mut toml::Table {
        let (kind, number) = match name.split_once(' ') {
            Some((kind, number)) => (kind, number.parse().unwrap()),
            None => (name, 1),
        };
        let things = self.0["thing"].as_array_mut().unwrap().iter_mut();
        let mut of_kind = things
            .map(|thing| thing.as_table_mut().unwrap())
            .filter(|thing| thing["type"].as_str() == Some(kind));
        of_kind.nth(number - 1).unwrap_or_else(|| panic!("the setting has no {name}"))
    }

    pub fn standing_at(mut self, place: &str) -> Setting {
        self.0.insert("stands_at".to_owned(), place.into());
        self
    }

    pub fn holding(mut self, name: &str) -> Setting {
        let thing = self.thing(name);
        thing.remove("in");
        thing.remove("on");
        self.0.insert("holds".to_owned(), name.into());
        self
    }

    /// The single state of the thing.
    pub fn with(mut self, name: &str, state: &str) -> Setting {
        let states = toml::Value::Array(vec![state.into()]);
        self.thing(name).insert("states".to_owned(), states);
        self
    }

    pub fn placed(mut self, name: &str, place: &str) -> Setting {
        let thing = self.thing(name);
        thing.remove("on");
        thing.insert("in".to_owned(), place.into());
        self
    }

    fn text(&self) -> String {
        self.0.to_string()
    }
}
