use super::facts::facts;
use super::refusal::preposition;
use super::scene::{Index, Scene, State};
use crate::language::Step;
use crate::world::{Thing, View};

/// What a person sees: everything, even behind closed doors, because the robot has no primitive for
/// looking inside.
pub(super) fn look(scene: &Scene) -> View {
    let mut summary = vec![format!("this is a {}", scene.room().said())];
    summary.push(match scene.robot.at {
        Some(at) => format!("the robot stands at the {}", scene.name(at)),
        None => "the robot stands in the room".to_owned(),
    });
    summary.push(match scene.robot.holds {
        Some(held) => format!("it holds the {}", scene.name(held)),
        None => "its hand is empty".to_owned(),
    });
    let things = (0..scene.objects.len() as Index).map(|index| thing(scene, index)).collect();
    View { summary, things }
}

fn thing(scene: &Scene, index: Index) -> Thing {
    let object = scene.object(index);
    let (x, y) = scene.place(index);
    let mut states: Vec<&str> =
        State::ALL.into_iter().filter(|state| object.is(*state)).map(State::word).collect();
    if object.shut() {
        states.push("closed");
    }
    if scene.is_held(index) {
        states.push("held");
    } else if scene.in_reach(index) {
        states.push("here");
    }
    Thing {
        name: scene.name(index),
        kind: object.kind.symbol().clone(),
        place: object.parent.map(|parent| scene.name(parent)),
        at: (i32::from(x), i32::from(y)),
        states: states.into_iter().map(str::to_owned).collect(),
    }
}

/// A step that was carried out, as a short sentence.
pub(super) fn narrate(step: &Step, binding: &[String]) -> String {
    let the = |index: usize| match binding.get(index) {
        Some(name) => format!("the {}", said(name)),
        None => "something".to_owned(),
    };
    let place = step.args.get(1).and_then(|name| facts().kind(name.as_str()));
    match step.operator.as_str() {
        "GOTO" => format!("goes to {}", the(0)),
        "PICKUP" => format!("picks up {}", the(0)),
        "PUT" => format!("puts {} {} {}", the(0), place.map_or("on", preposition), the(1)),
        "OPEN" => format!("opens {}", the(0)),
        "CLOSE" => format!("closes {}", the(0)),
        "TOGGLE" => format!("toggles {}", the(0)),
        other => format!("does {other} with {}", the(0)),
    }
}

/// `CounterTop 2` → `counter top 2`.
pub(super) fn said(name: &str) -> String {
    let (kind, number) = match name.split_once(' ') {
        Some((kind, number)) => (kind, format!(" {number}")),
        None => (name, String::new()),
    };
    match facts().kind(kind) {
        Some(kind) => format!("{}{number}", kind.said()),
        None => name.to_owned(),
    }
}
