//! A scene as the scene file that makes it: what a client can send.

use std::collections::BTreeMap;
use std::fmt::Write;

use apprentice::language::Document;
use apprentice::world::household::{Kind, Scene};
use serde::Deserialize;

#[derive(Deserialize)]
struct Written {
    room: String,
    robot: Robot,
    things: Vec<Thing>,
}

#[derive(Deserialize)]
struct Robot {
    stands_at: Option<String>,
    holds: Option<String>,
}

#[derive(Deserialize)]
struct Thing {
    #[serde(rename = "type")]
    kind: String,
    at: (i16, i16),
    #[serde(rename = "in")]
    parent: Option<String>,
    #[serde(default)]
    states: Vec<String>,
}

/// The text of a scene file (TOML). Things come in an order in which each is in or on one further
/// up, so a scene that is read from it may number equal things otherwise.
///
/// - `dirty`: a kind of which every thing is made dirty.
pub fn scene_file(scene: &Scene, dirty: Option<Kind>) -> Result<String, String> {
    let written: Written = Document::of(scene).decode()?;
    let kinds: Vec<&str> = written.things.iter().map(|thing| thing.kind.as_str()).collect();
    let old = numbered(&kinds, true);
    let place = |name: &String| {
        let found = old.iter().position(|other| other == name);
        found.ok_or_else(|| format!("the scene has no {name}"))
    };
    let parent = |thing: &Thing| thing.parent.as_ref().map(place).transpose();
    let parents: Vec<Option<usize>> =
        written.things.iter().map(parent).collect::<Result<_, _>>()?;
    let mut order: Vec<usize> = Vec::new();
    while order.len() < parents.len() {
        let before = order.len();
        for (index, parent) in parents.iter().enumerate() {
            let ready = parent.is_none_or(|parent| order.contains(&parent));
            if ready && !order.contains(&index) {
                order.push(index);
            }
        }
        if order.len() == before {
            return Err("a thing of the scene is inside itself".to_owned());
        }
    }
    let in_order: Vec<&str> = order.iter().map(|index| kinds[*index]).collect();
    let mut names = vec![String::new(); kinds.len()];
    for (index, name) in order.iter().zip(numbered(&in_order, false)) {
        names[*index] = name;
    }
    let mut text = format!("room = {:?}\n", written.room);
    let held = written.robot.holds.as_ref().map(place).transpose()?;
    for (key, thing) in
        [("stands_at", written.robot.stands_at.as_ref().map(place).transpose()?), ("holds", held)]
    {
        if let Some(thing) = thing {
            let _ = writeln!(text, "{key} = {:?}", names[thing]);
        }
    }
    for index in order {
        let thing = &written.things[index];
        let _ = writeln!(text, "\n[[thing]]\ntype = {:?}", thing.kind);
        match parents[index] {
            Some(parent) => {
                let _ = writeln!(text, "in = {:?}", names[parent]);
            }
            None if held == Some(index) => {}
            None => {
                let _ = writeln!(text, "at = [{}, {}]", thing.at.0, thing.at.1);
            }
        }
        let kind = Kind::named(&thing.kind).ok_or_else(|| format!("no kind {}", thing.kind))?;
        let mut states = thing.states.clone();
        if kind.openable() && !states.iter().any(|state| state == "open") {
            states.push("closed".to_owned());
        }
        if dirty == Some(kind) && kind.cleanable() && !states.iter().any(|s| s == "dirty") {
            states.push("dirty".to_owned());
        }
        if !states.is_empty() {
            let _ = writeln!(text, "states = {states:?}");
        }
    }
    Ok(text)
}

/// `Mug 1`, `Mug 2`, `Egg 1`; with `short`, `Egg` where there is only one.
fn numbered(kinds: &[&str], short: bool) -> Vec<String> {
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    let names = kinds.iter().map(|kind| {
        let number = seen.entry(kind).or_default();
        *number += 1;
        let alone = short && kinds.iter().filter(|other| *other == kind).count() == 1;
        if alone { (*kind).to_owned() } else { format!("{kind} {number}") }
    });
    names.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use apprentice::world::household::Household;
    use apprentice::world::{Show, Stage, World};

    #[test]
    fn a_scene_is_read_back_as_it_was() {
        let household = Household::new();
        for seed in 1..40 {
            let (scene, _) = household.stage(&Stage::Seed { seed }).unwrap();
            let text = scene_file(&scene, None).unwrap();
            let stage = Stage::Scene { scene: text.clone(), task: "free".to_owned() };
            let (read, _) = household.stage(&stage).unwrap_or_else(|e| panic!("{e}\n{text}"));
            let sorted = |scene: &Scene| {
                let things = household.look(scene).things.into_iter().map(|thing| {
                    let place = thing.place.map(|p| p.split(' ').next().unwrap().to_owned());
                    (thing.kind, place, thing.states)
                });
                let mut things: Vec<_> = things.collect();
                things.sort();
                things
            };
            assert_eq!(sorted(&read), sorted(&scene), "seed {seed}");
            assert_eq!(household.look(&read).summary[1..], household.look(&scene).summary[1..]);
        }
    }
}
