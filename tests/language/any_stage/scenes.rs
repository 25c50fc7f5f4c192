//! Random stages, good ones and bad ones.

use apprentice::store::SeededEntropy;
use apprentice::world::Stage;
use apprentice::world::household::{Kind, Room, Task};

use apprentice_testkit::chance::below;

/// A type in the words of people: `CounterTop` is a counter top.
pub fn said(kind: &str) -> String {
    let mut out = String::new();
    for c in kind.chars() {
        if c.is_uppercase() && !out.is_empty() {
            out.push(' ');
        }
        out.extend(c.to_lowercase());
    }
    out
}

pub fn pick<T: Copy>(dice: &SeededEntropy, from: &[T]) -> Option<T> {
    (!from.is_empty()).then(|| from[below(dice, from.len())])
}

fn chance(dice: &SeededEntropy, percent: usize) -> bool {
    below(dice, 100) < percent
}

/// A stage, mostly a scene as a person may write it, and the types in it.
pub fn stage(dice: &SeededEntropy) -> (Stage, Vec<Kind>) {
    let room = Room::ALL[below(dice, 4)];
    let mut kinds: Vec<Kind> = room.kinds().collect();
    let seed = below(dice, 1 << 20) as u64;
    match below(dice, 40) {
        0 => return (Stage::Seed { seed }, kinds),
        1 => return (Stage::Task { task: task(dice, &kinds, &[]), seed }, kinds),
        2 => return (Stage::Task { task: format!("free {}", room.key()), seed }, kinds),
        _ => {}
    }
    let fixed: Vec<Kind> = kinds.iter().copied().filter(|kind| !kind.pickupable()).collect();
    let carried: Vec<Kind> = kinds.iter().copied().filter(|kind| kind.pickupable()).collect();
    let mut text = format!("room = \"{}\"\n", room.key());
    let standing: Vec<Kind> = (0..2 + below(dice, 4)).filter_map(|_| pick(dice, &fixed)).collect();
    if let Some(kind) = pick(dice, &standing).filter(|_| chance(dice, 40)) {
        text += &format!("stands_at = \"{kind}\"\n");
    }
    let mut things: Vec<(Kind, Option<Kind>)> = Vec::new();
    for _ in 0..1 + below(dice, 5) {
        let Some(thing) = pick(dice, &carried) else { break };
        let places: Vec<Kind> =
            standing.iter().copied().filter(|place| place.may_hold(thing)).collect();
        let carriers: Vec<Kind> = things.iter().map(|(kind, _)| *kind).collect();
        let carriers: Vec<Kind> =
            carriers.into_iter().filter(|place| place.may_hold(thing)).collect();
        let place = match chance(dice, 15) {
            true => pick(dice, &carriers),
            false => pick(dice, &places),
        };
        things.push((thing, place));
        // The task `two` needs several things of a type.
        if chance(dice, 25) {
            things.push((thing, place));
        }
    }
    if let Some((kind, _)) = pick(dice, &things).filter(|_| chance(dice, 10)) {
        text += &format!("holds = \"{kind}\"\n");
    }
    for kind in &standing {
        // A faucet is at a basin, a lamp on a desk. The first such place is good enough.
        let on = standing.iter().find(|other| *other != kind && kind.may_stand_on(**other));
        text += &thing(dice, *kind, on.copied());
    }
    for (kind, place) in &things {
        text += &thing(dice, *kind, *place);
    }
    kinds.retain(|kind| standing.contains(kind) || things.iter().any(|(other, _)| other == kind));
    let task = task(dice, &kinds, &things);
    (Stage::Scene { scene: text, task }, kinds)
}

fn thing(dice: &SeededEntropy, kind: Kind, place: Option<Kind>) -> String {
    let mut text = format!("[[thing]]\ntype = \"{kind}\"\n");
    if let Some(place) = place {
        text += &format!("in = \"{place}\"\n");
    }
    let fitting = [
        (kind.openable(), "open"),
        (kind.openable(), "closed"),
        (kind.toggleable(), "on"),
        (kind.toggleable(), "off"),
        (kind.cleanable(), "dirty"),
        (kind.cleanable(), "clean"),
        (kind.heatable(), "hot"),
        (kind.coolable(), "cold"),
    ];
    let fitting: Vec<&str> =
        fitting.iter().filter(|(fits, _)| *fits).map(|(_, state)| *state).collect();
    match pick(dice, &fitting).filter(|_| chance(dice, 40)) {
        Some(state) => text + &format!("states = [\"{state}\"]\n"),
        None => text,
    }
}

/// A task about these types, if there is one. Sometimes its goal is already true.
fn task(dice: &SeededEntropy, kinds: &[Kind], things: &[(Kind, Option<Kind>)]) -> String {
    let mut text = "free".to_owned();
    for _ in 0..12 {
        let kind = |dice| pick(dice, kinds).map_or_else(String::new, |kind| kind.to_string());
        let form = ["place", "two", "nested", "clean", "heat", "cool", "look", "free"];
        let form = form[below(dice, form.len())];
        let placed = pick(dice, things).filter(|_| chance(dice, 40));
        text = match (form, placed) {
            ("free", _) => "free".to_owned(),
            ("nested", Some((thing, Some(place)))) => {
                format!("nested {thing} {place} {}", kind(dice))
            }
            ("nested", _) => format!("nested {} {} {}", kind(dice), kind(dice), kind(dice)),
            (form, Some((thing, Some(place)))) => format!("{form} {thing} {place}"),
            (form, Some((thing, None))) => format!("{form} {thing} {}", kind(dice)),
            (form, None) => format!("{form} {} {}", kind(dice), kind(dice)),
        };
        if form != "free" && chance(dice, 15) {
            text += " closed";
        }
        if Task::read(&text).is_ok() || chance(dice, 3) {
            return text;
        }
    }
    text
}
