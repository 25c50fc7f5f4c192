//! The fewest primitives that achieve a task: A* over scenes with [`bound::remaining`] as the
//! lower bound.
//!
//! **Why the answer is exact.** A step names kinds, and which instance it binds to depends on where
//! the robot stands. So the search carries out real steps ([`act`]) on a smaller scene that keeps
//! every instance of every *relevant* kind — what the task names, its appliances, what any instance
//! of those is in or on or, when it can be carried, contains, what the hand holds and where that
//! can be put — with everything around them and every free-standing thing. Steps on other kinds
//! change nothing that the goal or a binding looks at, with one exception: walking to another thing
//! can change which instance is nearest. Those walks are tried too. The effect of a relevant step
//! depends on relevant things only, so each step of the small scene does the same in the whole one,
//! and no useful step is left out. Two kinds of steps are left out because they cost a step and
//! give nothing that walking does not: turning on things that do not matter, and putting relevant
//! things where neither the goal nor an appliance is. The exceptions (a full hand, a container that
//! moves its contents) are tried.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::rc::Rc;

use super::bound::remaining;
use super::facts::{Kind, facts};
use super::primitives::{Action, act};
use super::scene::{Index, Scene};
use super::task::{Goal, Task};
use super::task_goal::achieved;
use crate::language::Program;
use crate::limits::PROGRAM_STEPS_MAX;

/// How many things, counted over all scenes that it looks at, the planner handles before it gives
/// up: about 15,000 scenes of an ordinary room, fewer of a crowded one. So no scene file can keep
/// it busy for long.
const THINGS_MAX: usize = 1_000_000;

/// A program with the fewest primitives that achieves the task. None for a task that is already
/// done, because no program is empty, and beyond [`THINGS_MAX`] or [`PROGRAM_STEPS_MAX`].
pub(super) fn plan(scene: &Scene, task: &Task) -> Option<Program> {
    let missing = |kind: &Kind| scene.of(*kind).next().is_none();
    if matches!(task.goal, Goal::Free(_))
        || achieved(scene, task)
        || task.needs().iter().any(missing)
    {
        return None;
    }
    let search = Search::new(scene, task);
    let actions = search.run(search.small.clone())?;
    Some(Program { steps: actions.into_iter().map(Action::step).collect() })
}

struct Search<'a> {
    task: &'a Task,
    small: Scene,
    /// Relevant kinds, in order.
    kinds: Vec<Kind>,
    /// Each kind that is not relevant, and where its things are.
    stands: Vec<(Kind, Vec<Stand>)>,
}

/// A thing that matters only as somewhere to walk to.
struct Stand {
    /// What it is in or on, as an index of the small scene.
    root: Index,
    place: (i16, i16),
    /// In or on the free-standing thing, not that thing itself.
    contained: bool,
    /// Shut in something between it and the free-standing thing, which the search never opens.
    away: bool,
}

struct Node {
    scene: Rc<Scene>,
    steps: u32,
    from: Option<(usize, Action)>,
}

impl<'a> Search<'a> {
    fn new(scene: &Scene, task: &'a Task) -> Search<'a> {
        let kinds = relevant(scene, task);
        let (small, renumbered) = shrink(scene, &kinds);
        let mut stands: BTreeMap<Kind, Vec<Stand>> = BTreeMap::new();
        for index in 0..scene.objects.len() as Index {
            let root = scene.root(index);
            let kind = scene.object(index).kind;
            if kinds.contains(&kind) || scene.robot.holds == Some(root) {
                continue;
            }
            let root = renumbered[usize::from(root)].expect("free-standing things are kept");
            let away = scene.shut_in(index).is_some_and(|around| around != scene.root(index));
            let contained = scene.object(index).parent.is_some();
            let stand = Stand { root, place: scene.place(index), contained, away };
            stands.entry(kind).or_default().push(stand);
        }
        Search { task, small, kinds, stands: stands.into_iter().collect() }
    }

    fn run(&self, start: Scene) -> Option<Vec<Action>> {
        let nodes_max = THINGS_MAX / start.objects.len().max(1);
        let start = Rc::new(start);
        let mut nodes = vec![Node { scene: start.clone(), steps: 0, from: None }];
        let mut best: BTreeMap<Rc<Scene>, u32> = BTreeMap::from([(start.clone(), 0)]);
        // Ordered by steps in all, then by steps still to go, then by age: the search is the same
        // every time.
        let mut open = BinaryHeap::from([Reverse((remaining(&start, self.task), 0, 0))]);
        while let Some(Reverse((_, _, number))) = open.pop() {
            let (scene, steps) = (nodes[number].scene.clone(), nodes[number].steps);
            if best.get(&scene).is_some_and(|known| *known < steps) {
                continue;
            }
            if achieved(&scene, self.task) {
                return Some(trace(&nodes, number));
            }
            if steps as usize == PROGRAM_STEPS_MAX {
                continue;
            }
            for (action, next) in self.successors(&scene) {
                if best.get(&next).is_some_and(|known| *known <= steps + 1) {
                    continue;
                }
                if nodes.len() >= nodes_max {
                    return None;
                }
                let next = Rc::new(next);
                best.insert(next.clone(), steps + 1);
                let left = remaining(&next, self.task);
                open.push(Reverse((steps + 1 + left, left, nodes.len())));
                nodes.push(Node { scene: next, steps: steps + 1, from: Some((number, action)) });
            }
        }
        None
    }

    /// Every step that can run and matters, with what it leads to.
    fn successors(&self, scene: &Scene) -> Vec<(Action, Scene)> {
        let mut next = Vec::new();
        let mut attempt = |action: Action| {
            let mut after = scene.clone();
            if act(&mut after, self.task, action).is_ok() {
                next.push((action, after));
            }
        };
        let held = scene.robot.holds.map(|held| scene.object(held).kind);
        for &kind in &self.kinds {
            attempt(Action::Goto(kind));
            match held {
                None if kind.pickupable() => attempt(Action::Pickup(kind)),
                Some(thing) if kind.may_hold(thing) => attempt(Action::Put(thing, kind)),
                _ => {}
            }
            if kind.openable() {
                attempt(Action::Open(kind));
                attempt(Action::Close(kind));
            }
            if kind.toggleable() {
                attempt(Action::Toggle(kind));
            }
        }
        self.walks(scene, &mut next);
        next
    }

    /// Walks to things that do not matter themselves: one walk for each place.
    fn walks(&self, scene: &Scene, next: &mut Vec<(Action, Scene)>) {
        let mut reached: Vec<Index> = scene.robot.at.into_iter().collect();
        for (kind, stands) in &self.stands {
            let key = |stand: &&Stand| {
                let square = |(x, y): (i16, i16)| {
                    let dx = i64::from(x) - i64::from(scene.robot.x);
                    let dy = i64::from(y) - i64::from(scene.robot.y);
                    dx * dx + dy * dy
                };
                let apart = match scene.robot.at == Some(stand.root) {
                    true => 0,
                    false => square(scene.place(stand.root)),
                };
                let away = stand.away || (stand.contained && scene.object(stand.root).shut());
                (away, apart, square(stand.place))
            };
            // `min_by_key` takes the first of equals, as binding does.
            let Some(stand) = stands.iter().min_by_key(key) else { continue };
            if reached.contains(&stand.root) {
                continue;
            }
            reached.push(stand.root);
            let mut after = scene.clone();
            (after.robot.x, after.robot.y) = after.place(stand.root);
            after.robot.at = Some(stand.root);
            next.push((Action::Goto(*kind), after));
        }
    }
}

fn trace(nodes: &[Node], end: usize) -> Vec<Action> {
    let mut actions = Vec::new();
    let mut at = end;
    while let Some((from, action)) = nodes[at].from {
        actions.push(action);
        at = from;
    }
    actions.reverse();
    actions
}

/// The kinds that the task's steps can be about; see the top of this file.
fn relevant(scene: &Scene, task: &Task) -> Vec<Kind> {
    let mut wanted = vec![false; facts().kinds.len()];
    let mut mark = |kind: Kind| std::mem::replace(&mut wanted[usize::from(kind.0)], true);
    task.needs().into_iter().for_each(|kind| {
        mark(kind);
    });
    if let Some(held) = scene.robot.holds {
        let held = scene.object(held).kind;
        mark(held);
        // Putting down what the hand holds may be the shortest way, whatever it is.
        let places = scene.objects.iter().map(|object| object.kind);
        places.filter(|place| place.may_hold(held)).for_each(|place| {
            mark(place);
        });
    }
    if task.closed {
        let doors = scene.objects.iter().filter(|o| o.kind.has_door() && !o.shut());
        doors.for_each(|door| {
            mark(door.kind);
        });
    }
    // What a relevant thing is in or on matters too, and what a relevant thing that can be carried
    // contains (it moves along, and can be walked to); then all things of those kinds.
    let is = |wanted: &[bool], index: Index| wanted[usize::from(scene.object(index).kind.0)];
    loop {
        let missing = (0..scene.objects.len() as Index).find_map(|index| {
            let inside = scene.ancestors(index).find(|&around| !is(&wanted, around));
            let carried = |around: Index| scene.object(around).kind.pickupable();
            if is(&wanted, index) {
                inside
            } else {
                let around = |i: Index| is(&wanted, i) && carried(i);
                scene.ancestors(index).any(around).then_some(index)
            }
        });
        match missing {
            Some(index) => wanted[usize::from(scene.object(index).kind.0)] = true,
            None => break,
        }
    }
    facts().all().filter(|kind| wanted[usize::from(kind.0)]).collect()
}

/// The scene with only the things that matter and those that stand free, in the same order; and
/// for each thing its number there.
fn shrink(scene: &Scene, kinds: &[Kind]) -> (Scene, Vec<Option<Index>>) {
    let mut renumbered: Vec<Option<Index>> = Vec::with_capacity(scene.objects.len());
    let mut kept = 0;
    for index in 0..scene.objects.len() as Index {
        let object = scene.object(index);
        let keep = object.parent.is_none() || kinds.contains(&object.kind);
        renumbered.push(keep.then_some(kept));
        kept += Index::from(keep);
    }
    let new = |index: Index| renumbered[usize::from(index)].expect("what is around is kept");
    let mut small = scene.clone();
    small.objects.clear();
    for (object, number) in scene.objects.iter().zip(&renumbered) {
        if number.is_some() {
            let mut object = *object;
            object.parent = object.parent.map(new);
            small.objects.push(object);
        }
    }
    small.robot.at = small.robot.at.map(new);
    small.robot.holds = small.robot.holds.map(new);
    (small, renumbered)
}
