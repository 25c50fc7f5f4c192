//! What somebody meant, and whether it is what was done.

use apprentice::language::{Program, Step};
use apprentice::world::household::{Household, Scene, Task};
use apprentice::world::{Show, Words, World};

/// What a request comes to in the present scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Aim {
    pub program: Program,
    /// The scene when it is done.
    pub after: Scene,
}

/// Missing steps added before one step; opening and walking are all that can be missing.
const ADDED_MAX: usize = 4;

/// The steps as they have to be done now: walks and doors that are missing are added, and what is
/// so already is left out; nothing at all may be left.
///
/// - returns: none when it cannot be done from here.
pub fn aim(household: &Household, scene: &Scene, task: &Task, steps: &[Step]) -> Option<Aim> {
    let mut after = scene.clone();
    let mut done = Vec::new();
    for step in steps {
        let mut added = 0;
        let runs = loop {
            let Err(refused) = household.step(&mut after, task, step) else { break true };
            if is_so(household, &after, step) {
                break false;
            }
            let first = refused.first.filter(|_| added < ADDED_MAX)?;
            household.step(&mut after, task, &first).ok()?;
            done.push(first);
            added += 1;
        };
        if runs {
            done.push(step.clone());
        }
    }
    Some(Aim { program: Program { steps: done }, after })
}

/// Whether a step that cannot run has nothing left to do.
fn is_so(household: &Household, scene: &Scene, step: &Step) -> bool {
    let Some(thing) = step.args.first() else { return false };
    let view = household.look(scene);
    let has = |state: &str, of: &apprentice::world::Thing| of.states.iter().any(|s| s == state);
    let here = |state: &str| {
        view.things.iter().any(|t| t.kind == *thing && has("here", t) && has(state, t))
    };
    match step.operator.as_str() {
        "OPEN" => here("open"),
        "CLOSE" => here("closed"),
        "PICKUP" => household.held(scene).as_ref() == Some(thing),
        _ => false,
    }
}

/// Whether the robot did what was meant, as a person sees it: every thing is then in the same kind
/// of place with the same states. Doors count only where the request was about nothing but doors, and
/// where the robot stands only where it was about nothing but walking.
///
/// - `meant`: runs in `before`.
pub fn carried_out_as_meant(
    household: &Household,
    task: &Task,
    before: &Scene,
    meant: &Program,
    after: &Scene,
) -> bool {
    let mut expected = before.clone();
    for step in &meant.steps {
        if household.step(&mut expected, task, step).is_err() {
            return false;
        }
    }
    let is = |names: &[&str]| meant.steps.iter().all(|s| names.contains(&s.operator.as_str()));
    let (walks, doors) = (is(&["GOTO"]), is(&["GOTO", "OPEN", "CLOSE"]));
    let stands = |scene: &Scene| household.here(scene);
    seen(household, &expected, doors) == seen(household, after, doors)
        && (!walks || stands(&expected) == stands(after))
}

/// Each thing's kind, the kind of its place, and its states, in an order of their own.
fn seen(household: &Household, scene: &Scene, doors: bool) -> Vec<(String, String, Vec<String>)> {
    let counts = |state: &String| match state.as_str() {
        "on" | "dirty" | "hot" | "cold" | "held" => true,
        "open" => doors,
        _ => false,
    };
    let kind_of = |name: String| name.split(' ').next().unwrap_or_default().to_owned();
    let things = household.look(scene).things.into_iter().map(|thing| {
        let states = thing.states.into_iter().filter(counts).collect();
        (thing.kind.to_string(), thing.place.map(kind_of).unwrap_or_default(), states)
    });
    let mut things: Vec<_> = things.collect();
    things.sort();
    things
}

/// The run of actions, from number `after` + 1 on, that is what was meant and nothing else; numbers
/// count from 1. Walks are free; doors may be worked where the meaning does not say so.
///
/// - returns: none where something else was done in between.
pub fn run_for(meant: &Program, actions: &[Step], after: usize) -> Option<(u32, u32)> {
    let walk = |step: &Step| step.operator == "GOTO";
    let door = |step: &Step| step.operator == "OPEN" || step.operator == "CLOSE";
    let mut wanted = meant.steps.iter().filter(|step| !walk(step)).peekable();
    if wanted.peek().is_none() {
        let last = meant.steps.last()?;
        let first = actions.get(after)?;
        return (first == last).then_some((after as u32 + 1, after as u32 + 1));
    }
    for (index, action) in actions.iter().enumerate().skip(after) {
        if wanted.peek() == Some(&action) {
            wanted.next();
        } else if !walk(action) && !door(action) {
            return None;
        }
        if wanted.peek().is_none() {
            return Some((after as u32 + 1, index as u32 + 1));
        }
    }
    None
}
