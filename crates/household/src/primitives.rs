use super::facts::{Kind, facts};
use super::refusal::Refusal;
use super::scene::{Index, Scene, State};
use super::task::Task;
use super::task_goal::at_goal;
use crate::language::Step;

/// One of the six primitives with the kinds it names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Action {
    Goto(Kind),
    Pickup(Kind),
    Put(Kind, Kind),
    Open(Kind),
    Close(Kind),
    Toggle(Kind),
}

/// The instances an action was carried out with, one per argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Bound {
    One(Index),
    Two(Index, Index),
}

impl Action {
    /// Reads a step.
    ///
    /// - errors: a sentence, when an argument is not a kind of the household. The operator and the
    ///   number of arguments were checked against the signature.
    pub(crate) fn read(step: &Step) -> Result<Action, String> {
        let kind = |index: usize| match step.args.get(index) {
            Some(name) => facts().find(name.as_str()),
            None => Err(format!("{step} lacks an argument")),
        };
        match step.operator.as_str() {
            "GOTO" => Ok(Action::Goto(kind(0)?)),
            "PICKUP" => Ok(Action::Pickup(kind(0)?)),
            "PUT" => Ok(Action::Put(kind(0)?, kind(1)?)),
            "OPEN" => Ok(Action::Open(kind(0)?)),
            "CLOSE" => Ok(Action::Close(kind(0)?)),
            "TOGGLE" => Ok(Action::Toggle(kind(0)?)),
            other => Err(format!("there is no primitive {other}")),
        }
    }

    /// The action as a step of a program.
    pub(crate) fn step(self) -> Step {
        let (operator, kinds) = match self {
            Action::Goto(kind) => ("GOTO", vec![kind]),
            Action::Pickup(kind) => ("PICKUP", vec![kind]),
            Action::Put(thing, place) => ("PUT", vec![thing, place]),
            Action::Open(kind) => ("OPEN", vec![kind]),
            Action::Close(kind) => ("CLOSE", vec![kind]),
            Action::Toggle(kind) => ("TOGGLE", vec![kind]),
        };
        let args = kinds.into_iter().map(|kind| kind.symbol().clone()).collect();
        Step { operator: operator.into(), args }
    }
}

/// What an argument may be bound to: every thing of a kind, or only the one that was chosen.
#[derive(Clone, Copy)]
struct Wanted {
    kind: Kind,
    chosen: Option<Index>,
}

impl Wanted {
    fn candidates(self, scene: &Scene) -> impl Iterator<Item = Index> {
        scene.of(self.kind).filter(move |&index| self.admits(index))
    }

    fn is(self, scene: &Scene, index: Index) -> bool {
        scene.object(index).kind == self.kind && self.admits(index)
    }

    fn admits(self, index: Index) -> bool {
        self.chosen.is_none_or(|chosen| chosen == index)
    }
}

/// The instances that were chosen, one per argument of an action; none where it is free.
pub(super) type Chosen = [Option<Index>; 2];

/// Carries out one action, bound to the nearest instances for which it can run.
///
/// - errors: [`Refusal`]; the scene is then unchanged.
pub(super) fn act(scene: &mut Scene, task: &Task, action: Action) -> Result<Bound, Refusal> {
    act_on(scene, task, action, [None, None])
}

/// As [`act`], with the chosen instances. Each is of the kind that its argument names.
///
/// - errors: [`Refusal`], about the chosen instance where there is one; the scene is then
///   unchanged.
pub(super) fn act_on(
    scene: &mut Scene,
    task: &Task,
    action: Action,
    [first, second]: Chosen,
) -> Result<Bound, Refusal> {
    let wanted = |kind: Kind| Wanted { kind, chosen: first };
    match action {
        Action::Goto(kind) => goto(scene, task, wanted(kind)),
        Action::Pickup(kind) => pickup(scene, task, wanted(kind)),
        Action::Put(thing, kind) => put(scene, wanted(thing), Wanted { kind, chosen: second }),
        Action::Open(kind) => open(scene, wanted(kind)),
        Action::Close(kind) => close(scene, wanted(kind)),
        Action::Toggle(kind) => toggle(scene, wanted(kind)),
    }
}

fn goto(scene: &mut Scene, task: &Task, wanted: Wanted) -> Result<Bound, Refusal> {
    let carried = |scene: &Scene, index| match Some(scene.root(index)) == scene.robot.holds {
        true => Err(Refusal::InHand(index)),
        false => Ok(()),
    };
    let target = bind(scene, wanted, Some(task), carried)?;
    let root = scene.root(target);
    (scene.robot.x, scene.robot.y) = scene.place(root);
    scene.robot.at = Some(root);
    Ok(Bound::One(target))
}

fn pickup(scene: &mut Scene, task: &Task, wanted: Wanted) -> Result<Bound, Refusal> {
    let kind = wanted.kind;
    if scene.of(kind).next().is_none() {
        return Err(Refusal::NoneHere(kind));
    }
    if !kind.pickupable() {
        return Err(Refusal::NotPickupable(kind));
    }
    if let Some(held) = scene.robot.holds {
        let same = wanted.is(scene, held);
        return Err(if same { Refusal::InHand(held) } else { Refusal::HandFull(held) });
    }
    let target = bind(scene, wanted, Some(task), reachable)?;
    if scene.robot.at == Some(target) {
        scene.robot.at = None;
    }
    scene.robot.holds = Some(target);
    scene.object_mut(target).parent = None;
    move_with_contents(scene, target, (0, 0));
    Ok(Bound::One(target))
}

fn put(scene: &mut Scene, wanted: Wanted, target: Wanted) -> Result<Bound, Refusal> {
    let (thing, place) = (wanted.kind, target.kind);
    let held = match (scene.robot.holds, wanted.chosen) {
        (Some(held), _) if wanted.is(scene, held) => held,
        (_, Some(chosen)) => return Err(Refusal::OtherHeld(chosen)),
        _ if scene.of(thing).next().is_none() => return Err(Refusal::NoneHere(thing)),
        _ => return Err(Refusal::NotHeld(thing)),
    };
    if scene.of(place).next().is_none() {
        return Err(Refusal::NoneHere(place));
    }
    if !place.receptacle() {
        return Err(Refusal::NoReceptacle(place));
    }
    if !place.may_hold(thing) {
        return Err(Refusal::DoesNotGo(thing, place));
    }
    let target = bind(scene, target, None, |scene, index| {
        if scene.root(index) == held {
            return Err(Refusal::IntoItself(held));
        }
        reachable(scene, index)?;
        match scene.object(index).shut() {
            true => Err(Refusal::Shut(index)),
            false => Ok(()),
        }
    })?;
    scene.robot.holds = None;
    scene.object_mut(held).parent = Some(target);
    let spot = spot_on(scene, target, held);
    move_with_contents(scene, held, spot);
    scene.settle();
    Ok(Bound::Two(held, target))
}

fn open(scene: &mut Scene, wanted: Wanted) -> Result<Bound, Refusal> {
    let kind = wanted.kind;
    if scene.of(kind).next().is_some() && !kind.openable() {
        return Err(Refusal::NotOpenable(kind));
    }
    let target = bind(scene, wanted, None, |scene, index| {
        reachable(scene, index)?;
        let object = scene.object(index);
        match (object.shut(), object.is(State::On)) {
            (false, _) => Err(Refusal::AlreadyOpen(index)),
            // A laptop may run with its lid closed. Only a thing that works behind its door must be
            // shut.
            (true, true) if kind.receptacle() => Err(Refusal::Running(index)),
            (true, _) => Ok(()),
        }
    })?;
    scene.object_mut(target).set(State::Open, true);
    Ok(Bound::One(target))
}

fn close(scene: &mut Scene, wanted: Wanted) -> Result<Bound, Refusal> {
    let kind = wanted.kind;
    if scene.of(kind).next().is_some() && !kind.openable() {
        return Err(Refusal::NotOpenable(kind));
    }
    let target = bind(scene, wanted, None, |scene, index| {
        reachable(scene, index)?;
        match scene.object(index).shut() {
            true => Err(Refusal::AlreadyClosed(index)),
            false => Ok(()),
        }
    })?;
    scene.object_mut(target).set(State::Open, false);
    scene.settle();
    Ok(Bound::One(target))
}

fn toggle(scene: &mut Scene, wanted: Wanted) -> Result<Bound, Refusal> {
    let kind = wanted.kind;
    if scene.of(kind).next().is_some() && !kind.toggleable() {
        return Err(Refusal::NotToggleable(kind));
    }
    let target = bind(scene, wanted, None, |scene, index| {
        reachable(scene, index)?;
        let object = scene.object(index);
        match kind.has_door() && !object.shut() && !object.is(State::On) {
            true => Err(Refusal::DoorOpen(index)),
            false => Ok(()),
        }
    })?;
    let on = scene.object(target).is(State::On);
    scene.object_mut(target).set(State::On, !on);
    scene.settle();
    Ok(Bound::One(target))
}

fn reachable(scene: &Scene, index: Index) -> Result<(), Refusal> {
    if !scene.in_reach(index) {
        return Err(Refusal::OutOfReach(index));
    }
    match scene.shut_in(index) {
        Some(around) => Err(Refusal::ShutIn(index, around)),
        None => Ok(()),
    }
}

/// The order in which instances are taken, smallest first. The distance comes last.
type Order = (bool, bool, (i64, i64));

/// The nearest of the candidates that `can` be used. With a task (for walking and picking up),
/// things that are not yet at their goal come first, and among these, things in sight. Ties go to
/// the earlier thing.
///
/// - errors: why the nearest candidate cannot be used. A candidate in reach comes first, because
///   its reason says more than "out of reach".
fn bind(
    scene: &Scene,
    wanted: Wanted,
    task: Option<&Task>,
    can: impl Fn(&Scene, Index) -> Result<(), Refusal>,
) -> Result<Index, Refusal> {
    let mut best: Option<(Order, Index)> = None;
    let mut reason: Option<(Order, Refusal)> = None;
    for index in wanted.candidates(scene) {
        match can(scene, index) {
            Ok(()) => {
                let done = task.is_some_and(|task| at_goal(scene, task, index));
                let away = task.is_some() && scene.shut_in(index).is_some();
                let key = (done, away, scene.distance(index));
                if best.is_none_or(|(known, _)| key < known) {
                    best = Some((key, index));
                }
            }
            Err(refusal) => {
                let away = scene.shut_in(index).is_some();
                let key = (!scene.in_reach(index), away, scene.distance(index));
                if reason.is_none_or(|(known, _)| key < known) {
                    reason = Some((key, refusal));
                }
            }
        }
    }
    match (best, reason) {
        (Some((_, index)), _) => Ok(index),
        (None, Some((_, refusal))) => Err(refusal),
        (None, None) => Err(Refusal::NoneHere(wanted.kind)),
    }
}

/// A place in or on a receptacle that depends on the two things alone. So putting things down in
/// another order gives the same scene, and a scene without other things gives the same place.
pub(super) fn spot_on(scene: &Scene, receptacle: Index, thing: Index) -> (i16, i16) {
    let (x, y) = scene.place(receptacle);
    let kind = scene.object(thing).kind;
    let earlier = scene.of(kind).take_while(|&index| index < thing).count() as i16;
    let number = (i16::from(kind.0) + 11 * earlier) % 35;
    let (column, row) = (number % 7 - 3, number / 7 - 2);
    let inside = |centre: i16, offset: i16| centre.saturating_add(offset).max(0);
    (inside(x, column * 8), inside(y, row * 8))
}

fn move_with_contents(scene: &mut Scene, moved: Index, place: (i16, i16)) {
    for index in 0..scene.objects.len() as Index {
        if index == moved || scene.ancestors(index).any(|around| around == moved) {
            let object = scene.object_mut(index);
            (object.x, object.y) = place;
        }
    }
}
