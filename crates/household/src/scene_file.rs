//! Reads a scene that a person wrote. TOML; an example is `data/example_scene.toml`.
//!
//! ```toml
//! room = "kitchen"            # kitchen, living_room, bedroom or bathroom
//! stands_at = "CounterTop"    # where the robot stands; left out: in the middle of the room
//! holds = "Mug"               # a thing of the list without `in`; left out: nothing
//!
//! [[thing]]
//! type = "CounterTop"
//! at = [120, 40]              # centimetres east and north; left out: the next free spot
//!
//! [[thing]]
//! type = "Mug"
//! in = "CounterTop"           # `in` or `on`, both mean the same; a thing further up
//! states = ["dirty"]          # of open, closed, on, off, dirty, clean, hot, cold
//! ```
//!
//! Things have the names that the robot uses: `Mug` when there is one, `Mug 1`, `Mug 2` when there
//! are several, counted from the top (while reading, `Mug` also means the first). A fridge, a
//! cabinet and the like are closed, boxes and laptops are open, everything is off and clean unless
//! its states say otherwise; what is in a closed fridge is cold.

use serde::Deserialize;
use toml::Spanned;

use super::builder::{ObjectId, SceneBuilder};
use super::facts::{Kind, Room, facts};
use super::scene::{Index, Scene, State};
use super::words::a;
use crate::limits::SCENE_FILE_BYTES_MAX;
use crate::world::StageError;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneFile {
    room: Spanned<String>,
    stands_at: Option<Spanned<String>>,
    holds: Option<Spanned<String>>,
    #[serde(default)]
    thing: Vec<ThingEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ThingEntry {
    #[serde(rename = "type")]
    kind: Spanned<String>,
    at: Option<Spanned<(i16, i16)>>,
    #[serde(rename = "in")]
    inside: Option<Spanned<String>>,
    on: Option<Spanned<String>>,
    #[serde(default)]
    states: Vec<Spanned<String>>,
}

/// - errors: [`StageError::Scene`] with line and column (from 1) and what was expected.
pub(super) fn read(text: &str) -> Result<Scene, StageError> {
    let error = |start: usize, reason: String| {
        let (line, column) = line_and_column(text, start);
        StageError::Scene { line, column, reason }
    };
    if text.len() > SCENE_FILE_BYTES_MAX {
        let found = text.len();
        let reason = format!("it has {found} bytes; the limit is {SCENE_FILE_BYTES_MAX}");
        return Err(error(0, reason));
    }
    let file: SceneFile = toml::from_str(text).map_err(|e| {
        error(e.span().map_or(0, |span| span.start), e.message().trim().replace('\n', "; "))
    })?;
    let at = |place: &Spanned<String>, reason: String| error(place.span().start, reason);
    let room = Room::read(file.room.get_ref()).ok_or_else(|| {
        let known = Room::ALL.map(Room::key).join(", ");
        at(&file.room, format!("{:?} is not a room; expected one of {known}", file.room.get_ref()))
    })?;
    let mut builder = SceneBuilder::new(room);
    let held = match &file.holds {
        None => None,
        Some(name) => Some(held_thing(&file, name).map_err(|reason| at(name, reason))?),
    };
    for (number, thing) in file.thing.iter().enumerate() {
        let kind = facts().find(thing.kind.get_ref()).map_err(|r| at(&thing.kind, r))?;
        let id = match (&thing.inside, &thing.on) {
            (Some(_), Some(on)) => {
                return Err(at(on, "a thing has `in` or `on`, not both".to_owned()));
            }
            (Some(name), None) | (None, Some(name)) => {
                if let Some(spot) = &thing.at {
                    let reason = "a thing in or on another one has the same place; leave out `at`";
                    return Err(error(spot.span().start, reason.to_owned()));
                }
                let place = find(&builder, name.get_ref()).map_err(|r| at(name, r))?;
                builder.put_kind(kind, place).map_err(|e| at(name, e.to_string()))?
            }
            (None, None) if held == Some(number) => {
                builder.hold(kind.name()).map_err(|e| at(&thing.kind, e.to_string()))?
            }
            (None, None) => match &thing.at {
                None => builder.stand_kind(kind),
                Some(spot) if spot.get_ref().0 < 0 || spot.get_ref().1 < 0 => {
                    let reason = "centimetres are counted from the corner, from 0 on".to_owned();
                    return Err(error(spot.span().start, reason));
                }
                Some(spot) => builder.stand_kind_at(kind, *spot.get_ref()),
            }
            .map_err(|e| at(&thing.kind, e.to_string()))?,
        };
        for word in &thing.states {
            set_state(&mut builder, id, kind, word.get_ref()).map_err(|r| at(word, r))?;
        }
    }
    if let Some(name) = &file.stands_at {
        let place = find(&builder, name.get_ref()).map_err(|r| at(name, r))?;
        builder.stand_at(place);
    }
    let scene = builder.build();
    scene.check().map_err(|reason| error(0, reason))?;
    Ok(scene)
}

fn set_state(
    builder: &mut SceneBuilder,
    id: ObjectId,
    kind: Kind,
    word: &str,
) -> Result<(), String> {
    let (state, holds) = match word {
        "closed" => (State::Open, false),
        "off" => (State::On, false),
        "clean" => (State::Dirty, false),
        _ => match State::ALL.into_iter().find(|state| state.word() == word) {
            Some(state) => (state, true),
            None => {
                return Err(format!(
                    "{word:?} is not a state; expected open, closed, on, off, dirty, clean, hot or cold"
                ));
            }
        },
    };
    if !state.fits(kind) {
        return Err(format!("{} cannot be {word}", a(kind.name())));
    }
    builder.set(id, state, holds).map(|_| ()).map_err(|e| e.to_string())
}

/// The thing with this name among those built so far.
fn find(builder: &SceneBuilder, name: &str) -> Result<ObjectId, String> {
    let scene = builder.scene();
    let (kind, number) = split_name(name)?;
    match scene.of(kind).nth(number - 1) {
        Some(index) => Ok(ObjectId(index)),
        None => Err(format!("there is no {name:?} among the things above it")),
    }
}

/// Which entry of the list, from 0, the robot holds.
fn held_thing(file: &SceneFile, name: &Spanned<String>) -> Result<usize, String> {
    let (kind, number) = split_name(name.get_ref())?;
    let of_kind = |thing: &ThingEntry| facts().find(thing.kind.get_ref()) == Ok(kind);
    let mut entries = file.thing.iter().enumerate().filter(|(_, thing)| of_kind(thing));
    match entries.nth(number - 1) {
        Some((_, thing)) if thing.inside.is_some() || thing.on.is_some() => Err(format!(
            "the {:?} that the robot holds cannot be in or on something",
            name.get_ref()
        )),
        Some((index, _)) => Ok(index),
        None => Err(format!("there is no thing called {:?}", name.get_ref())),
    }
}

/// `Mug 2` → (Mug, 2); `Mug` → (Mug, 1).
fn split_name(name: &str) -> Result<(Kind, usize), String> {
    let (kind, number) = match name.trim().rsplit_once(' ') {
        None => (name.trim(), 1),
        Some((kind, number)) => match number.parse::<Index>() {
            Ok(number) if number >= 1 => (kind, usize::from(number)),
            _ => {
                return Err(format!(
                    "{name:?} is not the name of a thing, such as Mug or \"Mug 2\""
                ));
            }
        },
    };
    Ok((facts().find(kind)?, number))
}

fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let within = (0..=offset.min(text.len())).rev().find(|&at| text.is_char_boundary(at));
    let before = &text[..within.unwrap_or(0)];
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().map_or(0, |last| last.chars().count()) + 1;
    (line, column)
}
