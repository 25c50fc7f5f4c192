//! How a scene is written in records and documents: with names, so that a person can read it, and
//! checked when it is read back.

use std::collections::BTreeMap;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use super::facts::{Kind, Room, facts};
use super::refusal::does_not_go;
use super::scene::{Index, Object, Robot, Scene, State};
use super::words::a;
use crate::limits::SCENE_OBJECTS_MAX;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneText {
    room: String,
    robot: RobotText,
    things: Vec<ThingText>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RobotText {
    at: (i16, i16),
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stands_at: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    holds: Option<String>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ThingText {
    #[serde(rename = "type")]
    kind: String,
    at: (i16, i16),
    /// The name of what it is in or on.
    #[serde(default, rename = "in", skip_serializing_if = "Option::is_none")]
    parent: Option<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    states: Vec<String>,
}

impl Serialize for Scene {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let name = |index: Option<Index>| index.map(|index| self.name(index));
        let thing = |object: &Object| ThingText {
            kind: object.kind.name().to_owned(),
            at: (object.x, object.y),
            parent: name(object.parent),
            states: State::ALL
                .into_iter()
                .filter(|state| object.is(*state))
                .map(|state| state.word().to_owned())
                .collect(),
        };
        let text = SceneText {
            room: self.room.key().to_owned(),
            robot: RobotText {
                at: (self.robot.x, self.robot.y),
                stands_at: name(self.robot.at),
                holds: name(self.robot.holds),
            },
            things: self.objects.iter().map(thing).collect(),
        };
        text.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Scene {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Scene, D::Error> {
        let text = SceneText::deserialize(deserializer)?;
        read(text).map_err(de::Error::custom)
    }
}

fn read(text: SceneText) -> Result<Scene, String> {
    let room = Room::read(&text.room)
        .ok_or_else(|| format!("{:?} is not a room of a household", text.room))?;
    if text.things.len() > SCENE_OBJECTS_MAX {
        return Err(format!(
            "the scene has {} things; at most {SCENE_OBJECTS_MAX} are allowed",
            text.things.len()
        ));
    }
    let mut objects = Vec::with_capacity(text.things.len());
    for thing in &text.things {
        let kind = facts().find(&thing.kind)?;
        let mut object = Object { kind, states: 0, x: thing.at.0, y: thing.at.1, parent: None };
        for word in &thing.states {
            let state = State::ALL.into_iter().find(|state| state.word() == word);
            match state.filter(|state| state.fits(kind)) {
                Some(state) => object.set(state, true),
                None => return Err(format!("{} cannot be {word:?}", a(kind.name()))),
            }
        }
        objects.push(object);
    }
    let (x, y) = text.robot.at;
    let robot = Robot { x, y, at: None, holds: None };
    let mut scene = Scene { room, robot, objects };
    let names = names(&scene);
    let find = |name: &Option<String>| match name {
        None => Ok(None),
        Some(name) => names
            .get(name)
            .map(|index| Some(*index))
            .ok_or_else(|| format!("the scene has no thing called {name:?}")),
    };
    for (index, thing) in text.things.iter().enumerate() {
        scene.objects[index].parent = find(&thing.parent)?;
    }
    scene.robot.at = find(&text.robot.stands_at)?;
    scene.robot.holds = find(&text.robot.holds)?;
    scene.check()?;
    Ok(scene)
}

/// The [`Scene::name`] of every thing, in one pass over the scene.
fn names(scene: &Scene) -> BTreeMap<String, Index> {
    let mut of_kind = BTreeMap::<Kind, u16>::new();
    scene.objects.iter().for_each(|object| *of_kind.entry(object.kind).or_default() += 1);
    let mut seen = BTreeMap::<Kind, u16>::new();
    let numbered = (0..).zip(&scene.objects).map(|(index, object)| {
        let number = seen.entry(object.kind).or_default();
        *number += 1;
        match of_kind[&object.kind] {
            1 => (object.kind.name().to_owned(), index),
            _ => (format!("{} {number}", object.kind), index),
        }
    });
    numbered.collect()
}

impl Scene {
    /// Whether the parts of the scene fit together: no thing is inside itself, everything is on or
    /// in something that may hold it, and the robot holds and stands at what it can.
    ///
    /// - errors: a sentence that names the thing.
    pub(super) fn check(&self) -> Result<(), String> {
        for index in 0..self.objects.len() as Index {
            let Some(parent) = self.object(index).parent else { continue };
            // There are more steps up than things, so the chain is a circle.
            let steps = self.ancestors(index).take(self.objects.len() + 1).count();
            if steps > self.objects.len() {
                return Err(format!("the {} is inside itself", self.name(index)));
            }
            let (thing, place) = (self.object(index).kind, self.object(parent).kind);
            if !place.may_hold(thing) && !thing.may_stand_on(place) {
                return Err(does_not_go(thing, place));
            }
        }
        if let Some(held) = self.robot.holds {
            let object = self.object(held);
            if !object.kind.pickupable() || object.parent.is_some() {
                return Err(format!("the robot cannot hold the {}", self.name(held)));
            }
        }
        match self.robot.at {
            Some(at) if self.object(at).parent.is_some() || self.is_held(at) => {
                Err(format!("the robot cannot stand at the {}", self.name(at)))
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Household;
    use crate::world::{Stage, World};

    #[test]
    fn names_counted_once_are_those_counted_one_by_one() {
        for seed in 1..20 {
            let (scene, _) = Household::new().stage(&Stage::Seed { seed }).unwrap();
            let one_by_one: BTreeMap<String, Index> =
                (0..scene.objects.len() as Index).map(|index| (scene.name(index), index)).collect();
            assert_eq!(names(&scene), one_by_one, "seed {seed}");
        }
    }
}
