//! When a task is done, and how far it is.

use super::facts::Kind;
use super::refusal::preposition;
use super::scene::{Index, Scene, State};
use super::task::{Goal, Task};
use super::words::a;

/// Whether the task's goal holds. A task without a goal is never achieved.
///
/// Goals name kinds, as programs do: `two CD Drawer` is done with two CDs in one drawer or in two
/// drawers.
pub(super) fn achieved(scene: &Scene, task: &Task) -> bool {
    let goal = match task.goal {
        Goal::Free(_) => false,
        Goal::Place { thing, place } => delivered(scene, thing, None, place) >= 1,
        Goal::Two { thing, place } => delivered(scene, thing, None, place) >= 2,
        Goal::Nested { thing, carrier, place } => nested(scene, thing, carrier, place),
        Goal::Clean { thing, place }
        | Goal::Heat { thing, place }
        | Goal::Cool { thing, place } => delivered(scene, thing, wanted(task), place) >= 1,
        Goal::Look { thing, light } => lit(scene, thing, light),
    };
    goal && (!task.closed || doors_closed(scene))
}

/// The parts of the goal, each with whether it holds.
pub(super) fn progress(scene: &Scene, task: &Task) -> Vec<(String, bool)> {
    let on = |place: Kind| format!("{} the {}", preposition(place), place.said());
    let any = |thing: Kind, state: Wanted| scene.of(thing).any(|i| state.holds(scene, i));
    let mut parts = match task.goal {
        Goal::Free(_) => vec![],
        Goal::Place { thing, place } => {
            let done = delivered(scene, thing, None, place) >= 1;
            vec![(format!("{} is {}", a(thing.said()), on(place)), done)]
        }
        Goal::Two { thing, place } => {
            let count = delivered(scene, thing, None, place);
            vec![
                (format!("{} is {}", a(thing.said()), on(place)), count >= 1),
                (format!("another {} is {}", thing.said(), on(place)), count >= 2),
            ]
        }
        Goal::Nested { thing, carrier, place } => {
            let inside = scene.of(thing).any(|i| is_in(scene, i, carrier));
            let within = preposition(carrier);
            vec![
                (format!("{} is {within} {}", a(thing.said()), a(carrier.said())), inside),
                (
                    format!("that {} is {}", carrier.said(), on(place)),
                    nested(scene, thing, carrier, place),
                ),
            ]
        }
        Goal::Clean { thing, place }
        | Goal::Heat { thing, place }
        | Goal::Cool { thing, place } => {
            let state = wanted(task).expect("these goals want a state");
            let word = state.word();
            vec![
                (format!("{} is {word}", a(thing.said())), any(thing, state)),
                (
                    format!("{} is {}", a(&format!("{word} {}", thing.said())), on(place)),
                    delivered(scene, thing, Some(state), place) >= 1,
                ),
            ]
        }
        Goal::Look { thing, light } => {
            let held = scene.robot.holds.is_some_and(|i| scene.object(i).kind == thing);
            let lamp = scene.of(light).any(|i| scene.object(i).is(State::On));
            vec![
                (format!("the robot holds {}", a(thing.said())), held),
                (format!("the {} is on", light.said()), lamp),
                (
                    format!("the {} lights the {}", light.said(), thing.said()),
                    lit(scene, thing, light),
                ),
            ]
        }
    };
    if task.closed {
        parts.push(("every door is closed".to_owned(), doors_closed(scene)));
    }
    parts
}

/// Whether the thing is already where the task wants it, so that a pick-up should take another.
pub(super) fn at_goal(scene: &Scene, task: &Task, index: Index) -> bool {
    let kind = scene.object(index).kind;
    match task.goal {
        Goal::Free(_) | Goal::Look { .. } => false,
        Goal::Place { thing, place } | Goal::Two { thing, place } => {
            kind == thing && is_in(scene, index, place)
        }
        Goal::Nested { thing, carrier, place } => {
            (kind == thing && is_in(scene, index, carrier))
                || (kind == carrier && is_in(scene, index, place))
        }
        Goal::Clean { thing, place }
        | Goal::Heat { thing, place }
        | Goal::Cool { thing, place } => {
            let state = wanted(task).expect("these goals want a state");
            kind == thing && is_in(scene, index, place) && state.holds(scene, index)
        }
    }
}

/// The state a task wants its thing in.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Wanted {
    Clean,
    Hot,
    Cold,
}

impl Wanted {
    /// Whether the thing is in the state.
    pub(crate) fn holds(self, scene: &Scene, index: Index) -> bool {
        let object = scene.object(index);
        match self {
            Wanted::Clean => !object.is(State::Dirty),
            Wanted::Hot => object.is(State::Hot),
            Wanted::Cold => object.is(State::Cold),
        }
    }

    fn word(self) -> &'static str {
        match self {
            Wanted::Clean => "clean",
            Wanted::Hot => "hot",
            Wanted::Cold => "cold",
        }
    }
}

pub(super) fn wanted(task: &Task) -> Option<Wanted> {
    match task.goal {
        Goal::Clean { .. } => Some(Wanted::Clean),
        Goal::Heat { .. } => Some(Wanted::Hot),
        Goal::Cool { .. } => Some(Wanted::Cold),
        _ => None,
    }
}

/// Whether the thing is directly in or on a thing of this kind.
pub(super) fn is_in(scene: &Scene, index: Index, place: Kind) -> bool {
    scene.object(index).parent.is_some_and(|parent| scene.object(parent).kind == place)
}

/// How many things of a kind, in the state wanted, are in or on things of another.
pub(super) fn delivered(scene: &Scene, thing: Kind, state: Option<Wanted>, place: Kind) -> usize {
    let there = scene.of(thing).filter(|&i| is_in(scene, i, place));
    there.filter(|&i| state.is_none_or(|state| state.holds(scene, i))).count()
}

fn nested(scene: &Scene, thing: Kind, carrier: Kind, place: Kind) -> bool {
    scene.of(thing).any(|index| match scene.object(index).parent {
        Some(parent) => scene.object(parent).kind == carrier && is_in(scene, parent, place),
        None => false,
    })
}

fn lit(scene: &Scene, thing: Kind, light: Kind) -> bool {
    let held = scene.robot.holds.is_some_and(|index| scene.object(index).kind == thing);
    held && scene.of(light).any(|lamp| scene.object(lamp).is(State::On) && scene.in_reach(lamp))
}

pub(super) fn doors_closed(scene: &Scene) -> bool {
    scene.objects.iter().all(|object| !object.kind.has_door() || object.shut())
}
