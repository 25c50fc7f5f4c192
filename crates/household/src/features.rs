use super::primitives::{Action, Bound, act};
use super::scene::Scene;
use super::task::Task;
use crate::language::Program;

/// How many numbers [`features`] gives.
pub(super) const FEATURE_COUNT: usize = 10;

/// State features of a program, in this order, each between -1 and 1:
///
/// 0. whether the first step can run (1 or -1);
/// 1. the share of its steps that run before one fails;
/// 2. whether every kind it names is in the scene (1 or -1);
/// 3. the share of its arguments that are in reach now;
/// 4. the mean distance to its arguments in units of 5 m, at most 1;
/// 5. whether the first thing it picks up or puts down is in the hand (1), is not (-1), or there
///    is none (0);
/// 6. whether the hand is full (1 or -1);
/// 7. its number of steps in units of 16, at most 1;
/// 8. the share of its steps that walk;
/// 9. the share of its steps that leave the scene as it is.
pub(super) fn features(scene: &Scene, program: &Program) -> Vec<f32> {
    let task = Task::free();
    let count = program.steps.len().max(1) as f32;
    let yes = |holds: bool| if holds { 1.0 } else { -1.0 };
    let actions: Vec<Option<Action>> =
        program.steps.iter().map(|step| Action::read(step).ok()).collect();

    let mut after = scene.clone();
    let (mut ran, mut idle) = (0, 0);
    for action in &actions {
        let before = after.clone();
        match action.map(|action| act(&mut after, &task, action)) {
            Some(Ok(_)) => {
                ran += 1;
                idle += usize::from(before == after);
            }
            _ => break,
        }
    }
    let kinds: Vec<_> = actions.iter().flatten().flat_map(|action| action.kinds()).collect();
    let nearest = kinds.iter().map(|kind| {
        scene.of(*kind).map(|index| (scene.distance(index).0, scene.in_reach(index))).min()
    });
    let (mut present, mut near, mut far) = (kinds.len() >= program.steps.len(), 0, 0.0);
    for found in nearest {
        match found {
            Some((square, reach)) => {
                near += usize::from(reach);
                // The square root is exact to the last bit on every IEEE machine.
                far += ((square as f64).sqrt() / 500.0).min(1.0) as f32;
            }
            None => {
                present = false;
                far += 1.0;
            }
        }
    }
    let held = scene.robot.holds.map(|index| scene.object(index).kind);
    let handled = actions.iter().flatten().find_map(|action| match action {
        Action::Pickup(kind) | Action::Put(kind, _) => Some(*kind),
        _ => None,
    });
    let walks = actions.iter().flatten().filter(|a| matches!(a, Action::Goto(_))).count();
    let args = kinds.len().max(1) as f32;
    vec![
        yes(ran > 0),
        ran as f32 / count,
        yes(present),
        near as f32 / args,
        far / args,
        handled.map_or(0.0, |kind| yes(held == Some(kind))),
        yes(held.is_some()),
        (count / 16.0).min(1.0),
        walks as f32 / count,
        idle as f32 / count,
    ]
}

impl Action {
    pub(super) fn kinds(self) -> impl Iterator<Item = super::facts::Kind> {
        let (first, second) = match self {
            Action::Put(thing, place) => (thing, Some(place)),
            Action::Goto(kind)
            | Action::Pickup(kind)
            | Action::Open(kind)
            | Action::Close(kind)
            | Action::Toggle(kind) => (kind, None),
        };
        std::iter::once(first).chain(second)
    }
}

impl Bound {
    pub(super) fn names(self, scene: &Scene) -> Vec<String> {
        match self {
            Bound::One(index) => vec![scene.name(index)],
            Bound::Two(first, second) => vec![scene.name(first), scene.name(second)],
        }
    }
}
