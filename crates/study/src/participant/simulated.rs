//! The simulated teacher: asks for much where it trusts the robot, breaks into smaller requests what
//! is not understood, puts right what went wrong, and afterwards teaches.

use std::collections::{BTreeMap, BTreeSet};

use apprentice::language::{Program, Step, Symbol};
use apprentice::numerics::Rng;
use apprentice::world::household::{Household, Kind};
use apprentice::world::{Show, Stage, Thing, World};
use serde::{Deserialize, Serialize};

use super::parts::{Unit, joined, parts, primitives, whole};
use super::talk::{Heard, Talk, TalkError, Turn, Wire};
use super::teacher::{Manner, Share, Size, Teacher};
use super::wording::{Apart, Names, Shunned, Words, chance, say, say_plainly};
use crate::draw;
use crate::transcript::Request;

/// Plans made in one episode before it is given up.
const PLANS_MAX: usize = 60;

/// What a simulated teacher takes from one episode to the next.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Person {
    /// In parts of ten thousand.
    trust: u32,
    /// The robot was too far away for something: walks are said from now on.
    walks: bool,
    /// From a kind of request to the wording that worked, or was taught.
    habits: BTreeMap<String, String>,
}

/// Of each type, the thing that is meant, by its name.
type About = BTreeMap<Symbol, String>;

/// What is remembered with something said: the habit that teaching it makes.
struct Note {
    size: Size,
    habit: String,
    wording: String,
    /// Two requests at once, which nobody teaches.
    joined: bool,
}

/// How a request ended.
enum Asked {
    /// It is done, at once or in parts.
    Settled,
    /// Something else was done: the rest is to be planned anew.
    Wrong,
    /// There is no way on.
    Lost,
}

/// One episode of a teacher.
pub struct Episode<'a> {
    pub seed: u64,
    /// The same in every condition.
    pub user: &'a str,
    pub number: u32,
    /// In the domain's words.
    pub task: &'a str,
    pub stage: &'a Stage,
    pub household: &'a Household,
    pub teacher: &'a Teacher,
}

impl Person {
    pub fn new(teacher: &Teacher) -> Person {
        Person { trust: teacher.trust.0, walks: false, habits: BTreeMap::new() }
    }

    fn gain(&mut self, share: Share) {
        let missing = Share(Share::ONE.0 - self.trust);
        self.trust += share.of(missing).0;
    }

    fn lose(&mut self, share: Share) {
        self.trust -= share.of(Share(self.trust)).0;
    }
}

/// Goes through one episode and teaches after it.
///
/// - `place`: names condition, person and episode for request ids.
pub fn teach(
    person: &mut Person,
    wire: &Wire<'_>,
    episode: &Episode<'_>,
    place: String,
) -> Result<Vec<Turn>, TalkError> {
    let number = episode.number.to_string();
    let rng = |what: &str| draw::rng(episode.seed, &[what, episode.user, &number]);
    let said_max = episode.teacher.utterances_max;
    let talk = Talk::begin(wire, episode.household, place, episode.stage, said_max)?;
    let names = Names::of(episode.household);
    let mut speaker = Speaker {
        person,
        episode,
        names,
        talk,
        rng: rng("speaking"),
        shunned: Shunned::new(),
        failed: BTreeSet::new(),
        handled: BTreeMap::new(),
    };
    speaker.pursue()?;
    let talk = speaker.talk;
    let (teacher, mut rng) = (episode.teacher, rng("teaching"));
    let (taught, turns) = talk.end(|note: &Note| {
        if note.joined {
            return false;
        }
        let effort = match note.size {
            Size::Primitive => teacher.effort_primitives,
            Size::Part | Size::Whole => teacher.effort,
        };
        !chance(&mut rng, teacher.forgetfulness) && chance(&mut rng, effort)
    })?;
    for note in taught {
        person.habits.insert(note.habit, note.wording);
    }
    Ok(turns)
}

struct Speaker<'a> {
    person: &'a mut Person,
    episode: &'a Episode<'a>,
    names: Names<'a>,
    talk: Talk<'a, Note>,
    rng: Rng,
    /// Names that led elsewhere in this episode.
    shunned: Shunned,
    /// Habits with wordings that did not work in this episode.
    failed: BTreeSet<(String, String)>,
    /// Of each type, the thing that a request was last about.
    handled: BTreeMap<Symbol, String>,
}

impl Speaker<'_> {
    /// Until the goal holds or there is no way on.
    fn pursue(&mut self) -> Result<(), TalkError> {
        let form = self.episode.task.split(' ').next().unwrap_or_default();
        let mut rest: Vec<Step> = Vec::new();
        let (mut careful, mut plans) = (false, 0);
        while !self.talk.over() {
            if rest.is_empty() {
                plans += 1;
                let household = self.episode.household;
                let plan = household.plan(self.talk.scene(), self.talk.task());
                match plan.filter(|_| plans <= PLANS_MAX) {
                    Some(plan) => rest = plan.steps,
                    None => return Ok(()),
                }
            }
            let (unit, again) = self.choose(form, &rest, careful);
            let unit = match careful {
                true => unit,
                false => self.perhaps_two(form, unit, &rest),
            };
            let (count, expected) = (unit.steps.len(), self.talk.aim(&unit.steps));
            let first = !careful;
            careful = match self.request(&unit, first)? {
                // A whole part in primitives, then the teacher is itself again.
                Asked::Settled => careful && again,
                Asked::Wrong => true,
                Asked::Lost => return Ok(()),
            };
            let as_planned = expected.is_some_and(|aim| aim.after == *self.talk.scene());
            match as_planned {
                true => drop(rest.drain(..count)),
                false => rest.clear(),
            }
        }
        Ok(())
    }

    /// What to ask for next, and whether more of the same part is left after it.
    fn choose(&mut self, form: &str, rest: &[Step], careful: bool) -> (Unit, bool) {
        let (teacher, trust) = (self.episode.teacher, Share(self.person.trust));
        let drawn = self.rng.below(Share::ONE.0 as usize) as u32;
        let whole_task = teacher.whole.of(trust).0;
        let part_too = whole_task + teacher.part.of(trust).0;
        if !careful && self.talk.said() == 0 {
            let habit = self.remembers(&habit_of(Size::Whole, form), trust);
            let unit = whole(self.episode.task, rest);
            if let Some(unit) = unit.filter(|_| habit || drawn < whole_task) {
                return (unit, false);
            }
        }
        let part = parts(form, rest).swap_remove(0);
        if let Some(key) = part.key.filter(|_| !careful) {
            let habit = self.remembers(&habit_of(Size::Part, key), trust);
            if habit || drawn < part_too {
                return (part, false);
            }
        }
        let leave_out = match self.person.walks {
            true => Share(0),
            false => teacher.walks_left_out,
        };
        let mut units = primitives(&part.steps, || chance(&mut self.rng, leave_out));
        let more = units.len() > 1;
        (units.swap_remove(0), more)
    }

    /// The request, perhaps with the next one of the plan.
    fn perhaps_two(&mut self, form: &str, unit: Unit, rest: &[Step]) -> Unit {
        let Some(manner) = &self.episode.teacher.manner else { return unit };
        match chance(&mut self.rng, manner.two_at_once) {
            true => joined(form, &unit, &rest[unit.steps.len()..]).unwrap_or(unit),
            false => unit,
        }
    }

    /// Whether a wording that worked before comes to mind and is trusted.
    fn remembers(&mut self, habit: &str, trust: Share) -> bool {
        let forgotten = chance(&mut self.rng, self.episode.teacher.forgetfulness);
        let trusted = chance(&mut self.rng, trust);
        self.person.habits.contains_key(habit) && !forgotten && trusted
    }

    /// Asks for something; what is not understood, in smaller requests.
    fn request(&mut self, unit: &Unit, first: bool) -> Result<Asked, TalkError> {
        let tries = match unit.parts.is_empty() {
            true => self.episode.teacher.attempts,
            false => usize::from(unit.key.is_some() || unit.joined),
        };
        for attempt in 0..tries {
            let Some(aim) = self.talk.aim(&unit.steps) else { return Ok(Asked::Wrong) };
            if aim.program.steps.is_empty() {
                return Ok(Asked::Settled);
            }
            if self.talk.over() {
                return Ok(Asked::Lost);
            }
            let last = tries > 1 && attempt + 1 == tries;
            let about = self.about(&aim.program);
            let (words, note) = self.words(unit, &about, attempt, last);
            let (habit, wording) = (note.habit.clone(), note.wording.clone());
            let heard = self.talk.say(&words.text, &aim.program, first && attempt == 0, note)?;
            let teacher = self.episode.teacher;
            match heard {
                Heard::Right => {
                    if unit.size != Size::Primitive {
                        self.person.gain(teacher.trust_gain);
                    }
                    if !unit.joined {
                        self.person.habits.insert(habit, wording);
                    }
                    self.handled.extend(about);
                    return Ok(Asked::Settled);
                }
                Heard::Wrong => {
                    self.person.lose(teacher.trust_loss_wrong);
                    if !self.misnamed(&aim.program, &words) {
                        self.person.habits.remove(&habit);
                        self.failed.insert((habit, wording));
                    }
                    return Ok(Asked::Wrong);
                }
                Heard::Impossible | Heard::NotSure => {
                    self.person.lose(teacher.trust_loss_not_understood);
                    self.person.habits.remove(&habit);
                    self.failed.insert((habit, wording));
                    // Said without the walk: the robot does not come by itself.
                    if unit.size == Size::Primitive && unit.steps.len() > 1 {
                        self.person.walks |= heard == Heard::Impossible;
                    }
                }
                Heard::Refused => return Ok(Asked::Lost),
            }
        }
        if unit.parts.is_empty() {
            return Ok(Asked::Lost);
        }
        for part in &unit.parts {
            match self.request(part, false)? {
                Asked::Settled => {}
                other => return Ok(other),
            }
        }
        Ok(Asked::Settled)
    }

    /// Whether something else was meant by a name than the teacher means; it then looks for another
    /// name.
    fn misnamed(&mut self, meant: &Program, words: &Words) -> bool {
        let names = |steps: &[Step], kind: &Symbol| steps.iter().any(|s| s.args.contains(kind));
        let did = self.talk.did();
        let wrong = words.names.iter().filter(|(kind, _)| {
            names(&meant.steps, kind) && !names(did, kind) && did.len() >= meant.steps.len()
        });
        let before = self.shunned.len();
        self.shunned.extend(wrong.cloned());
        self.shunned.len() > before
    }

    /// The words for a request as this teacher puts them; the plainest ones stand alone.
    ///
    /// - `about`: the things that are meant.
    fn words(&mut self, unit: &Unit, about: &About, attempt: usize, last: bool) -> (Words, Note) {
        let Some(manner) = &self.episode.teacher.manner else {
            return self.bare_words(unit, &Apart::new(), attempt, last);
        };
        let (mut words, note) = match (unit.joined, &unit.parts[..]) {
            (true, [first, second]) => self.two_at_once(manner, about, [first, second]),
            _ => {
                let apart = self.told_apart(manner, unit, about);
                self.bare_words(unit, &apart, attempt, last)
            }
        };
        if !last && chance(&mut self.rng, manner.framed) {
            let frame = &manner.frames[self.rng.below(manner.frames.len())];
            words.text = frame.replace("{request}", &words.text);
        }
        (words, note)
    }

    fn two_at_once(&mut self, manner: &Manner, about: &About, units: [&Unit; 2]) -> (Words, Note) {
        let [first, second] = units.map(|unit| {
            let apart = self.told_apart(manner, unit, about);
            self.bare_words(unit, &apart, 0, false).0
        });
        let join = &manner.joins[self.rng.below(manner.joins.len())];
        let text = join.replace("{first}", &first.text).replace("{second}", &second.text);
        let names = [first.names, second.names].concat();
        let (habit, wording) = ("two at once".to_owned(), join.clone());
        (Words { text, names }, Note { size: Size::Part, habit, wording, joined: true })
    }

    /// The thing of each type that a program is about: the first where it is about several.
    fn about(&self, program: &Program) -> About {
        let mut scene = self.talk.scene().clone();
        let mut about = About::new();
        for step in &program.steps {
            let done = self.episode.household.step(&mut scene, self.talk.task(), step);
            let Ok(names) = done else { break };
            for (kind, name) in step.args.iter().zip(names) {
                about.entry(kind.clone()).or_insert(name);
            }
        }
        about
    }

    /// Words for those things of a request that are one of several: by number, as the other of two,
    /// or by where they are.
    fn told_apart(&mut self, manner: &Manner, unit: &Unit, about: &About) -> Apart {
        let mut apart = Apart::new();
        // The whole task is about any of its things.
        if unit.size == Size::Whole {
            return apart;
        }
        let view = self.episode.household.look(self.talk.scene());
        for kind in [Some(&unit.thing), unit.place.as_ref()].into_iter().flatten() {
            let alike: Vec<&Thing> = view.things.iter().filter(|t| t.kind == *kind).collect();
            let Some(name) = about.get(kind).filter(|_| alike.len() > 1) else { continue };
            if !chance(&mut self.rng, manner.told_apart) {
                continue;
            }
            let number = name.rsplit(' ').next().unwrap_or_default();
            let mut forms: Vec<String> =
                manner.numbered.iter().map(|form| form.replace("{number}", number)).collect();
            if alike.len() == 2 && self.handled.get(kind).is_some_and(|last| last != name) {
                forms.extend(manner.other.iter().cloned());
            }
            // "The mug on the table on the shelf" would say two places.
            let place = if unit.place.is_none() { own_place(&alike, name) } else { None };
            if let Some(place) = place {
                let inside = Kind::named(place.as_str()).is_some_and(Kind::inside);
                let said = self.names.plain(&place, &self.shunned);
                let prep = if inside { "in" } else { "on" };
                let placed = |form: &String| form.replace("{prep}", prep).replace("{place}", &said);
                forms.extend(manner.placed.iter().map(placed));
            }
            let form = forms.swap_remove(self.rng.below(forms.len()));
            apart.insert(kind.clone(), form);
        }
        apart
    }

    fn bare_words(
        &mut self,
        unit: &Unit,
        apart: &Apart,
        attempt: usize,
        last: bool,
    ) -> (Words, Note) {
        let key = match unit.key {
            Some("on") => self.switch(unit),
            Some(key) => key,
            None => unreachable!("only what has words is said"),
        };
        let teacher = self.episode.teacher;
        let wordings = teacher.wordings(unit.size, key);
        let habit = habit_of(unit.size, key);
        let forgotten = chance(&mut self.rng, teacher.forgetfulness);
        let any = chance(&mut self.rng, teacher.variety);
        let drawn = self.rng.below(wordings.len());
        let mut favourite = draw::rng(self.episode.seed, &["favourite", self.episode.user, &habit]);
        let favourite = favourite.below(wordings.len());
        let known = self.person.habits.get(&habit).filter(|_| !forgotten);
        let wording = match (attempt, known) {
            _ if last => wordings[0].clone(),
            (0, Some(known)) => known.clone(),
            (0, None) if !any => wordings[favourite].clone(),
            _ => wordings[drawn].clone(),
        };
        // What did not work a moment ago is not tried again while there is anything else to say.
        let works = |wording: &&String| !self.failed.contains(&(habit.clone(), (*wording).clone()));
        let others = || wordings.iter().cycle().skip(drawn).take(wordings.len()).find(works);
        let wording = match last || works(&&wording) {
            true => wording,
            false => others().cloned().unwrap_or(wording),
        };
        let words = match last {
            true => say_plainly(&self.names, &self.shunned, &wording, unit),
            false => say(&self.names, &self.shunned, teacher, &wording, unit, apart, &mut self.rng),
        };
        (words, Note { size: unit.size, habit, wording, joined: false })
    }

    /// Whether what is to be switched is off now.
    fn switch(&self, unit: &Unit) -> &'static str {
        let view = self.episode.household.look(self.talk.scene());
        let on = |thing: &Thing| thing.states.iter().any(|state| state == "on");
        let is_on = view.things.iter().any(|thing| thing.kind == unit.thing && on(thing));
        if is_on { "off" } else { "on" }
    }
}

/// The type of the place that only one of some things of a type is in or on.
fn own_place(alike: &[&Thing], name: &str) -> Option<Symbol> {
    let place = |thing: &Thing| thing.place.as_deref().map(Request::kind).map(Symbol::new);
    let (own, others): (Vec<&Thing>, Vec<&Thing>) = alike.iter().partition(|t| t.name == name);
    let own = own.first().and_then(|thing| place(thing))?;
    others.iter().all(|other| place(other).as_ref() != Some(&own)).then_some(own)
}

fn habit_of(size: Size, key: &str) -> String {
    let size = match size {
        Size::Primitive => "primitive",
        Size::Part => "part",
        Size::Whole => "whole",
    };
    format!("{size} {key}")
}
