//! Draws scenes and tasks from a seed. They are like the recorded ones.

use super::builder::{BuildError, ObjectId, SceneBuilder};
use super::facts::{Kind, Room, facts};
use super::planner::plan;
use super::random::Random;
use super::scene::{Index, Scene, State};
use super::task::{Goal, Task};
use super::task_goal::achieved;
use crate::limits::PROGRAM_STEPS_MAX;
use crate::world::StageError;

/// Scenes drawn before a task is given up as unsolvable.
const DRAWS_MAX: u64 = 24;
/// These may stand on something, but in a drawn room they have a place of their own.
const STAND_FREE: [&str; 4] = ["Microwave", "SinkBasin", "StoveBurner", "HousePlant"];

/// Any task in any room.
pub(super) fn draw_any(seed: u64) -> Result<(Scene, Task), StageError> {
    let mut random = Random::new(seed);
    let mut last = None;
    for _ in 0..DRAWS_MAX {
        let task = draw_task(&mut random);
        match draw_for(&task, random.next()) {
            Ok(scene) => return Ok((scene, task)),
            Err(error) => last = Some(error),
        }
    }
    Err(last.expect("at least one scene was drawn"))
}

/// A form first, then one of the recorded combinations, so that the seven forms are about equally
/// frequent, as in the recordings.
fn draw_task(random: &mut Random) -> Task {
    let form = Task::KINDS[random.below(Task::KINDS.len())];
    let all: Vec<&str> = Room::ALL
        .iter()
        .flat_map(|room| facts().room(*room).tasks.get(form).into_iter().flatten())
        .map(String::as_str)
        .collect();
    let text = random.pick(&all).expect("every form was recorded in some room");
    text.parse().expect("tasks.toml holds tasks that make sense; the tests read all of them")
}

/// A scene that makes the task possible and not yet done.
///
/// - errors: [`StageError::Unsolvable`] when none of [`DRAWS_MAX`] scenes does.
pub(super) fn draw_for(task: &Task, seed: u64) -> Result<Scene, StageError> {
    let mut random = Random::new(seed);
    let unsolvable =
        |reason: String| StageError::Unsolvable { task: task.to_string(), seed, reason };
    let room = match task.goal {
        Goal::Free(Some(room)) => room,
        _ => draw_room(task, &mut random),
    };
    let mut reason = String::new();
    for _ in 0..DRAWS_MAX {
        let scene =
            draw_scene(room, task, &mut random).map_err(|error| unsolvable(error.to_string()))?;
        if matches!(task.goal, Goal::Free(_)) {
            return Ok(scene);
        }
        if achieved(&scene, task) {
            reason = "it is done from the start".to_owned();
        } else if plan(&scene, task).is_none() {
            reason = format!("no program of at most {PROGRAM_STEPS_MAX} primitives achieves it");
        } else {
            return Ok(scene);
        }
    }
    Err(unsolvable(reason))
}

/// A room where the things that the task needs are found together; when there is none, the room
/// with most of them, and the rest is brought there.
fn draw_room(task: &Task, random: &mut Random) -> Room {
    let needs = task.needs();
    let found = |room: Room, kind: Kind| {
        let things = &facts().room(room).things;
        things.iter().find(|thing| thing.kind == kind).map_or(0, |thing| thing.in_scenes)
    };
    let rooms = Room::ALL.map(|room| {
        let rarest = needs.iter().map(|kind| found(room, *kind)).min().unwrap_or(1);
        (room, rarest)
    });
    let most = |room: &Room| needs.iter().filter(|kind| found(*room, **kind) > 0).count();
    match random.weighted(&rooms) {
        Some(room) => *room,
        // The first of equals, so that the choice does not depend on how the iterator breaks ties.
        None => Room::ALL.into_iter().rev().max_by_key(most).expect("there are four rooms"),
    }
}

fn draw_scene(room: Room, task: &Task, random: &mut Random) -> Result<Scene, BuildError> {
    let mut counts = draw_counts(room, task, random);
    random.shuffle(&mut counts);
    let mut builder = SceneBuilder::new(room);
    let free = |kind: Kind| STAND_FREE.contains(&kind.name());

    let fixed = |kind: Kind| !kind.pickupable();
    for (kind, count) in counts.iter().filter(|(kind, _)| fixed(*kind)) {
        let attached = !free(*kind) && facts().all().any(|on| kind.may_stand_on(on));
        for _ in 0..if attached { 0 } else { *count } {
            builder.stand_kind(*kind)?;
        }
    }
    for (kind, count) in counts.iter().filter(|(kind, _)| fixed(*kind) && !free(*kind)) {
        let bases = spots(&builder, |place| kind.may_stand_on(place));
        let attached = facts().all().any(|on| kind.may_stand_on(on));
        for _ in 0..if attached { *count } else { 0 } {
            match random.pick(&bases) {
                Some(base) => builder.put_kind(*kind, *base)?,
                None => builder.stand_kind(*kind)?,
            };
        }
    }
    for (kind, count) in counts.iter().filter(|(kind, _)| kind.pickupable()) {
        for _ in 0..*count {
            let id = place(&mut builder, room, task, *kind, random)?;
            draw_states(&mut builder, task, id, random)?;
        }
    }
    Ok(builder.build())
}

/// How many of each kind the room gets; what the task needs is always there.
fn draw_counts(room: Room, task: &Task, random: &mut Random) -> Vec<(Kind, u32)> {
    let facts = facts().room(room);
    let mut counts: Vec<(Kind, u32)> = Vec::new();
    for thing in &facts.things {
        let (low, high) = thing.count;
        let count = low + random.below((high - low + 1) as usize) as u32;
        if random.chance(thing.in_scenes, facts.scenes) {
            counts.push((thing.kind, count));
        }
    }
    let two = matches!(task.goal, Goal::Two { .. });
    for (index, need) in task.needs().into_iter().enumerate() {
        let least = if two && index == 0 { 2 } else { 1 };
        match counts.iter_mut().find(|(kind, _)| *kind == need) {
            Some((_, count)) => *count = (*count).max(least),
            None => counts.push((need, least)),
        }
    }
    counts
}

/// Puts a thing where such things were recorded, but not where the task wants it.
fn place(
    builder: &mut SceneBuilder,
    room: Room,
    task: &Task,
    kind: Kind,
    random: &mut Random,
) -> Result<ObjectId, BuildError> {
    let recorded = facts().room(room).things.iter().find(|thing| thing.kind == kind);
    let recorded = recorded.map_or(&[][..], |thing| &thing.places);
    let places: Vec<(ObjectId, u32)> = recorded
        .iter()
        .filter(|(place, _)| !spoils(task, kind, *place))
        .filter_map(|(place, weight)| {
            let there = spots(builder, |found| found == *place);
            random.pick(&there).map(|id| (*id, *weight))
        })
        .collect();
    if let Some(id) = random.weighted(&places) {
        return builder.put_kind(kind, *id);
    }
    let usual = |place: Kind| place.may_hold(kind) && !place.pickupable();
    let anywhere = spots(builder, |place| usual(place) && !spoils(task, kind, place));
    match random.pick(&anywhere) {
        Some(id) => builder.put_kind(kind, *id),
        None => builder.stand_kind(kind),
    }
}

/// Whether a thing at this place would make the task shorter than it is meant to be.
fn spoils(task: &Task, thing: Kind, at: Kind) -> bool {
    let facts = facts();
    match task.goal {
        Goal::Free(_) | Goal::Look { .. } => false,
        Goal::Place { thing: wanted, place } | Goal::Two { thing: wanted, place } => {
            thing == wanted && at == place
        }
        Goal::Nested { thing: wanted, carrier, place } => {
            (thing == wanted && (at == carrier || at == place)) || (thing == carrier && at == place)
        }
        Goal::Clean { thing: wanted, place } => {
            thing == wanted && (at == place || at == facts.sink)
        }
        Goal::Heat { thing: wanted, place } => {
            thing == wanted && (at == place || at == facts.microwave)
        }
        Goal::Cool { thing: wanted, place } => {
            thing == wanted && (at == place || at == facts.fridge)
        }
    }
}

fn draw_states(
    builder: &mut SceneBuilder,
    task: &Task,
    id: ObjectId,
    random: &mut Random,
) -> Result<(), BuildError> {
    let kind = builder.scene().object(id.0).kind;
    let to_wash = matches!(task.goal, Goal::Clean { thing, .. } if thing == kind);
    if kind.cleanable() && (random.chance(1, 3) || to_wash) {
        builder.soil(id)?;
    }
    if kind.usually_open() && kind.openable() && !kind.receptacle() && random.chance(1, 2) {
        builder.set(id, State::Open, false)?;
    }
    Ok(())
}

fn spots(builder: &SceneBuilder, fits: impl Fn(Kind) -> bool) -> Vec<ObjectId> {
    let objects = builder.scene().objects.iter().enumerate();
    objects.filter(|(_, o)| fits(o.kind)).map(|(index, _)| ObjectId(index as Index)).collect()
}
