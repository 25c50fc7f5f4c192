//! A person who speaks with recorded sentences: for each step of a task first their own sentence,
//! then primitives where that was not understood, and afterwards they teach their own words.

use apprentice::language::{Program, Step, Symbol, Utterance};
use apprentice::world::household::{Household, Scene};
use apprentice::world::{Show, Stage, Thing};

use super::parts::{Unit, primitive};
use super::talk::{Heard, Talk, TalkError, Turn, Wire};
use super::teacher::{Size, Teacher};
use super::wording::{Names, Shunned, Words, say_plainly};
use crate::draw;

/// Rounds of putting right what went wrong in one step, before the episode is given up.
const REPAIRS_MAX: usize = 3;
/// Utterances of one episode before it is given up.
const UTTERANCES_MAX: usize = 300;

/// One step of a recorded task.
#[derive(Debug, Clone, PartialEq)]
pub struct Said {
    /// In their own words; none for a walk described by left and right, which nobody types to a map.
    pub sentence: Option<Utterance>,
    pub program: Program,
}

/// One episode of a recorded person.
pub struct Episode<'a> {
    pub seed: u64,
    pub user: &'a str,
    pub number: u32,
    pub stage: &'a Stage,
    pub script: &'a [Said],
    pub household: &'a Household,
    /// Its words for primitives and its patience; nothing else of it.
    pub teacher: &'a Teacher,
}

/// Goes through one episode and teaches after it.
pub fn speak(
    wire: &Wire<'_>,
    episode: &Episode<'_>,
    place: String,
) -> Result<Vec<Turn>, TalkError> {
    let talk = Talk::begin(wire, episode.household, place, episode.stage, UTTERANCES_MAX)?;
    let names = Names::of(episode.household);
    let mut speaker = Speaker { episode, names, talk, shunned: Shunned::new() };
    for said in episode.script {
        if speaker.talk.over() || !speaker.step(said)? {
            break;
        }
    }
    let (_, turns) = speaker.talk.end(|()| true)?;
    Ok(turns)
}

struct Speaker<'a> {
    episode: &'a Episode<'a>,
    names: Names<'a>,
    talk: Talk<'a, ()>,
    /// Names that led elsewhere in this episode.
    shunned: Shunned,
}

impl Speaker<'_> {
    /// - returns: whether there is a way on.
    fn step(&mut self, said: &Said) -> Result<bool, TalkError> {
        let before = self.talk.scene().clone();
        let Some(aim) = self.talk.aim(&said.program.steps) else { return Ok(false) };
        if aim.program.steps.is_empty() {
            return Ok(true);
        }
        if let Some(sentence) = &said.sentence {
            match self.talk.say(sentence.as_str(), &aim.program, true, ())? {
                Heard::Right => return Ok(true),
                Heard::Refused => return Ok(false),
                Heard::Wrong => {
                    if !self.put_right(&before)? {
                        return Ok(false);
                    }
                }
                Heard::Impossible | Heard::NotSure => {}
            }
        }
        // Primitives may be taken wrongly, too: what is then left to do is looked at anew.
        for _ in 0..=REPAIRS_MAX {
            let Some(aim) = self.talk.aim(&said.program.steps) else { return Ok(false) };
            let start = self.talk.scene().clone();
            match self.primitives(&aim.program)? {
                Heard::Right => return Ok(true),
                Heard::Wrong if self.put_right(&start)? => {}
                _ => return Ok(false),
            }
        }
        Ok(false)
    }

    /// Asks for one primitive after another.
    ///
    /// - returns: what came of the first that was not done as it was meant, if there was one.
    fn primitives(&mut self, program: &Program) -> Result<Heard, TalkError> {
        for step in &program.steps {
            let heard = self.primitive(step)?;
            if heard != Heard::Right {
                return Ok(heard);
            }
        }
        Ok(Heard::Right)
    }

    /// Asks for one primitive, in other words until it is understood.
    fn primitive(&mut self, step: &Step) -> Result<Heard, TalkError> {
        let attempts = self.episode.teacher.attempts;
        let mut heard = Heard::Refused;
        for attempt in 0..attempts {
            if self.talk.over() {
                return Ok(Heard::Refused);
            }
            let meant = Program { steps: vec![step.clone()] };
            let words = self.words(&primitive(step), attempt);
            heard = self.talk.say(&words.text, &meant, false, ())?;
            if heard == Heard::Wrong {
                // A name that led elsewhere.
                let did = self.talk.did();
                let named = |kind: &Symbol| did.iter().any(|step| step.args.contains(kind));
                let wrong = words.names.into_iter().filter(|(kind, _)| !named(kind));
                self.shunned.extend(wrong);
            }
            if !matches!(heard, Heard::Impossible | Heard::NotSure) {
                break;
            }
        }
        Ok(heard)
    }

    fn words(&self, unit: &Unit, attempt: usize) -> Words {
        let on = |thing: &Thing| thing.states.iter().any(|state| state == "on");
        let things = self.episode.household.look(self.talk.scene()).things;
        let is_on = things.iter().any(|thing| thing.kind == unit.thing && on(thing));
        let key = match unit.key {
            Some("on") if is_on => "off",
            Some(key) => key,
            None => unreachable!("primitives have words"),
        };
        let wordings = self.episode.teacher.wordings(Size::Primitive, key);
        let place = match attempt {
            0 => 0,
            attempt => {
                let said = self.talk.said().to_string();
                let (user, number) = (self.episode.user, self.episode.number.to_string());
                let purpose = ["other words", user, &number, &said];
                (attempt + draw::rng(self.episode.seed, &purpose).below(2)) % wordings.len()
            }
        };
        say_plainly(&self.names, &self.shunned, &wordings[place], unit)
    }

    /// Undoes, in primitives, what can be undone: what was carried off is brought back, what was
    /// switched is switched back. What was washed stays washed.
    ///
    /// - returns: whether the person still knows what to do.
    fn put_right(&mut self, before: &Scene) -> Result<bool, TalkError> {
        for _ in 0..REPAIRS_MAX {
            let undo = undo(self.episode.household, self.talk.scene(), before);
            if undo.is_empty() {
                return Ok(true);
            }
            let Some(aim) = self.talk.aim(&undo) else { return Ok(true) };
            match self.primitives(&aim.program)? {
                Heard::Right => return Ok(true),
                Heard::Wrong => {}
                _ => return Ok(false),
            }
        }
        Ok(true)
    }
}

/// The steps that bring things back to where they were; walks and doors are added by whoever aims.
fn undo(household: &Household, now: &Scene, before: &Scene) -> Vec<Step> {
    let step = |operator: &str, args: &[&Symbol]| Step {
        operator: Symbol::new(operator),
        args: args.iter().map(|arg| (*arg).clone()).collect(),
    };
    let is = |thing: &Thing, state: &str| thing.states.iter().any(|s| s == state);
    let (now, then) = (household.look(now).things, household.look(before).things);
    let kind_of = |place: &Option<String>| {
        let place = place.as_ref()?;
        then.iter().find(|thing| thing.name == *place).map(|thing| &thing.kind)
    };
    let mut steps = Vec::new();
    // The hand first: with a full one nothing else can be picked up.
    for (thing, was) in now.iter().zip(&then) {
        let picked_up = is(thing, "held") && !is(was, "held");
        if let Some(place) = kind_of(&was.place).filter(|_| picked_up) {
            steps.push(step("PUT", &[&thing.kind, place]));
        }
    }
    for (thing, was) in now.iter().zip(&then) {
        if is(thing, "on") != is(was, "on") {
            steps.push(step("TOGGLE", &[&thing.kind]));
        }
    }
    for (thing, was) in now.iter().zip(&then) {
        let moved = thing.place != was.place && !is(thing, "held") && !is(was, "held");
        if let Some(place) = kind_of(&was.place).filter(|_| moved) {
            steps.push(step("PICKUP", &[&thing.kind]));
            steps.push(step("PUT", &[&thing.kind, place]));
        }
    }
    for (thing, was) in now.iter().zip(&then) {
        if is(was, "held") && !is(thing, "held") {
            steps.push(step("PICKUP", &[&thing.kind]));
        }
    }
    steps
}
