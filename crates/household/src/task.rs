use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::facts::{Kind, Room, facts};
use super::refusal::{does_not_go, preposition};
use super::words::{a, nearest_word};
use crate::world::StageError;

/// What an episode is about: one of ALFRED's seven kinds of task, or nothing in particular.
/// Stored and printed in the words of [`Task::FORMS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Task {
    pub(super) goal: Goal,
    /// The doors must be closed in the end.
    pub(super) closed: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Goal {
    /// No goal; never achieved.
    Free(Option<Room>),
    Place {
        thing: Kind,
        place: Kind,
    },
    Two {
        thing: Kind,
        place: Kind,
    },
    Nested {
        thing: Kind,
        carrier: Kind,
        place: Kind,
    },
    Clean {
        thing: Kind,
        place: Kind,
    },
    Heat {
        thing: Kind,
        place: Kind,
    },
    Cool {
        thing: Kind,
        place: Kind,
    },
    Look {
        thing: Kind,
        light: Kind,
    },
}

impl Task {
    /// The known forms, for messages.
    pub const FORMS: &'static str = "known forms: place THING PLACE, two THING PLACE, \
        nested THING CARRIER PLACE, clean THING PLACE, heat THING PLACE, cool THING PLACE, \
        look THING LAMP, free [ROOM]; all but free may end in: closed";

    /// The forms of tasks that have a goal: ALFRED's seven.
    pub const KINDS: [&'static str; 7] =
        ["look", "place", "nested", "two", "clean", "heat", "cool"];

    /// A task without a goal.
    pub fn free() -> Task {
        Task { goal: Goal::Free(None), closed: false }
    }

    /// Reads a task in the world's words: `clean Tomato CounterTop`. Names of kinds in any case.
    ///
    /// - errors: [`StageError::Task`]: an unknown form or kind, a wrong number of words, or a task
    ///   that makes no sense ("heat Book Sofa").
    pub fn read(text: &str) -> Result<Task, StageError> {
        text.parse().map_err(|reason| StageError::Task {
            task: text.chars().take(200).collect(),
            reason,
            known: Task::FORMS.to_owned(),
        })
    }

    /// The kinds that the task needs, with appliances; the main thing first.
    pub(super) fn needs(&self) -> Vec<Kind> {
        let facts = facts();
        match self.goal {
            Goal::Free(_) => vec![],
            Goal::Place { thing, place } | Goal::Two { thing, place } => vec![thing, place],
            Goal::Nested { thing, carrier, place } => vec![thing, carrier, place],
            Goal::Clean { thing, place } => vec![thing, place, facts.sink, facts.faucet],
            Goal::Heat { thing, place } => vec![thing, place, facts.microwave],
            Goal::Cool { thing, place } => vec![thing, place, facts.fridge],
            Goal::Look { thing, light } => vec![thing, light],
        }
    }

    fn check(&self) -> Result<(), String> {
        let goes = |thing: Kind, place: Kind| match place.may_hold(thing) {
            true => Ok(()),
            false if !place.receptacle() => {
                Err(format!("nothing can be put in or on {}", a(place.name())))
            }
            false => Err(does_not_go(thing, place)),
        };
        let carried = |thing: Kind| match thing.pickupable() {
            true => Ok(()),
            false => Err(format!("{} cannot be picked up", a(thing.name()))),
        };
        let stays = |place: Kind| match place.pickupable() {
            true => {
                let place = place.name();
                Err(format!(
                    "{} can be carried, so it is not a place; use nested THING {place} PLACE",
                    a(place)
                ))
            }
            false => Ok(()),
        };
        let can = |holds: bool, thing: Kind, what: &str| match holds {
            true => Ok(()),
            false => Err(format!("{} cannot be {what}", a(thing.name()))),
        };
        let elsewhere = |place: Kind, appliance: Kind| match place == appliance {
            true => {
                Err(format!("this task already puts the thing in the {place}; name another place"))
            }
            false => Ok(()),
        };
        let facts = facts();
        match self.goal {
            Goal::Free(_) => Ok(()),
            Goal::Place { thing, place } | Goal::Two { thing, place } => {
                carried(thing)?;
                goes(thing, place)?;
                stays(place)
            }
            Goal::Nested { thing, carrier, place } => {
                carried(thing)?;
                carried(carrier)?;
                goes(thing, carrier)?;
                goes(carrier, place)?;
                stays(place)
            }
            Goal::Clean { thing, place } => {
                can(thing.cleanable(), thing, "washed")?;
                goes(thing, facts.sink)?;
                goes(thing, place)?;
                elsewhere(place, facts.sink)?;
                stays(place)
            }
            Goal::Heat { thing, place } => {
                can(thing.heatable(), thing, "heated")?;
                goes(thing, facts.microwave)?;
                goes(thing, place)?;
                elsewhere(place, facts.microwave)?;
                stays(place)
            }
            Goal::Cool { thing, place } => {
                can(thing.coolable(), thing, "cooled")?;
                goes(thing, facts.fridge)?;
                goes(thing, place)?;
                elsewhere(place, facts.fridge)?;
                stays(place)
            }
            Goal::Look { thing, light } => {
                carried(thing)?;
                match light.light() {
                    true => Ok(()),
                    false => Err(format!("{} is not a lamp", a(light.name()))),
                }
            }
        }
    }

    /// The task as one sentence in the imperative.
    pub(super) fn sentence(&self) -> String {
        let a = |kind: Kind| a(kind.said());
        let put = |place: Kind| format!("{} the {}", preposition(place), place.said());
        let sentence = match self.goal {
            Goal::Free(None) => "do as you like".to_owned(),
            Goal::Free(Some(room)) => format!("do as you like in the {}", room.said()),
            Goal::Place { thing, place } => format!("put {} {}", a(thing), put(place)),
            Goal::Two { thing, place } => {
                format!("put two {} {}", plural(thing.said()), put(place))
            }
            Goal::Nested { thing, carrier, place } => {
                let carrier_said = carrier.said();
                let within = preposition(carrier);
                format!(
                    "put {} {within} {} and put the {carrier_said} {}",
                    a(thing),
                    a(carrier),
                    put(place)
                )
            }
            Goal::Clean { thing, place } => {
                format!("wash {} and put it {}", a(thing), put(place))
            }
            Goal::Heat { thing, place } => format!("heat {} and put it {}", a(thing), put(place)),
            Goal::Cool { thing, place } => format!("cool {} and put it {}", a(thing), put(place)),
            Goal::Look { thing, light } => {
                format!("look at {} in the light of the {}", a(thing), light.said())
            }
        };
        match self.closed {
            true => format!("{sentence}, and leave every door closed"),
            false => sentence,
        }
    }
}

/// The plural of a kind's spoken name.
fn plural(said: &str) -> String {
    let stem = |end: usize| &said[..said.len() - end];
    match said {
        _ if said.ends_with("knife") => format!("{}ves", stem(2)),
        _ if said.ends_with("shelf") => format!("{}ves", stem(1)),
        _ if said.ends_with("lettuce") => format!("heads of {said}"),
        _ if said.ends_with("bread") => format!("loaves of {said}"),
        _ if said.ends_with("toilet paper") => format!("rolls of {said}"),
        _ if said.ends_with("ch") || said.ends_with('x') || said.ends_with("ss") => {
            format!("{said}es")
        }
        "tomato" | "potato" => format!("{said}es"),
        _ => format!("{said}s"),
    }
}

impl FromStr for Task {
    type Err = String;

    fn from_str(text: &str) -> Result<Task, String> {
        let mut words: Vec<&str> = text.split_whitespace().collect();
        let closed = words.last().is_some_and(|word| word.eq_ignore_ascii_case("closed"));
        if closed {
            words.pop();
        }
        let Some((form, rest)) = words.split_first() else {
            return Err("it is empty".to_owned());
        };
        let form = form.to_lowercase();
        let count = match form.as_str() {
            "place" | "two" | "clean" | "heat" | "cool" | "look" => 2,
            "nested" => 3,
            "free" => return read_free(rest, closed),
            other => {
                let known = ["place", "two", "nested", "clean", "heat", "cool", "look", "free"];
                let near = nearest_word(other, known.into_iter()).expect("there are forms");
                let other: String = other.chars().take(40).collect();
                return Err(format!("{other:?} is not a form of task; the nearest is {near}"));
            }
        };
        if rest.len() != count {
            return Err(format!(
                "{form} takes {count} names of things, but you gave {}",
                rest.len()
            ));
        }
        let kinds: Vec<Kind> =
            rest.iter().map(|name| facts().find(name)).collect::<Result<_, _>>()?;
        let (thing, place) = (kinds[0], kinds[count - 1]);
        let goal = match form.as_str() {
            "place" => Goal::Place { thing, place },
            "two" => Goal::Two { thing, place },
            "nested" => Goal::Nested { thing, carrier: kinds[1], place },
            "clean" => Goal::Clean { thing, place },
            "heat" => Goal::Heat { thing, place },
            "cool" => Goal::Cool { thing, place },
            _ => Goal::Look { thing, light: place },
        };
        let task = Task { goal, closed };
        task.check()?;
        Ok(task)
    }
}

fn read_free(rest: &[&str], closed: bool) -> Result<Task, String> {
    if closed {
        return Err("free has no goal, so it cannot end in closed".to_owned());
    }
    let name = rest.join(" ");
    match (name.is_empty(), Room::read(&name)) {
        (true, _) => Ok(Task::free()),
        (false, Some(room)) => Ok(Task { goal: Goal::Free(Some(room)), closed: false }),
        (false, None) => {
            let known = Room::ALL.map(Room::key).join(", ");
            let name: String = name.chars().take(40).collect();
            Err(format!("{name:?} is not a room; the rooms are {known}"))
        }
    }
}

impl TryFrom<String> for Task {
    type Error = String;
    fn try_from(text: String) -> Result<Task, String> {
        text.parse()
    }
}

impl From<Task> for String {
    fn from(task: Task) -> String {
        task.to_string()
    }
}

impl fmt::Display for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.goal {
            Goal::Free(None) => write!(f, "free"),
            Goal::Free(Some(room)) => write!(f, "free {}", room.key()),
            Goal::Place { thing, place } => write!(f, "place {thing} {place}"),
            Goal::Two { thing, place } => write!(f, "two {thing} {place}"),
            Goal::Nested { thing, carrier, place } => write!(f, "nested {thing} {carrier} {place}"),
            Goal::Clean { thing, place } => write!(f, "clean {thing} {place}"),
            Goal::Heat { thing, place } => write!(f, "heat {thing} {place}"),
            Goal::Cool { thing, place } => write!(f, "cool {thing} {place}"),
            Goal::Look { thing, light } => write!(f, "look {thing} {light}"),
        }?;
        if self.closed { write!(f, " closed") } else { Ok(()) }
    }
}
