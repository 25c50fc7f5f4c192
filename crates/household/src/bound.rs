//! A lower bound of the primitives that a task still needs. Each rule counts steps that every
//! program must contain: a thing gets somewhere only by a PICKUP and a PUT there, the robot gets
//! to a place only by a GOTO, a shut door needs an OPEN. Where one step could serve two rules, it
//! is counted once or not at all.

use super::facts::{Kind, facts};
use super::scene::{Index, Scene, State};
use super::task::{Goal, Task};
use super::task_goal::{achieved, delivered, is_in, wanted};

/// Combinations of things looked at for one bound.
const PAIRS_MAX: usize = 1_000;

/// Never more than the fewest primitives that achieve the task from here; 0 when it is done.
pub(super) fn remaining(scene: &Scene, task: &Task) -> u32 {
    if achieved(scene, task) {
        return 0;
    }
    // The rules look at pairs of things. In a scene with hundreds of apples and tables, a weaker
    // bound is faster in all.
    let count = |kind: &Kind| scene.of(*kind).count();
    if task.needs().iter().map(count).product::<usize>() > PAIRS_MAX {
        return 1;
    }
    let here = Here { scene };
    let goal = match task.goal {
        Goal::Free(_) => 0,
        Goal::Place { thing, place } => here.deliver_some(thing, place, 1),
        Goal::Two { thing, place } => here.deliver_some(thing, place, 2),
        Goal::Nested { thing, carrier, place } => here.nested(thing, carrier, place),
        Goal::Clean { thing, place }
        | Goal::Heat { thing, place }
        | Goal::Cool { thing, place } => here.treat(task, thing, place),
        Goal::Look { thing, light } => here.look(thing, light),
    };
    // Every door that is open now needs a CLOSE beyond those counted above: a microwave or
    // fridge that is closed to work is opened again afterwards.
    match task.closed {
        true => goal + here.open_doors(),
        false => goal,
    }
}

struct Here<'a> {
    scene: &'a Scene,
}

impl Here<'_> {
    fn held(&self, index: Index) -> bool {
        self.scene.is_held(index)
    }

    /// Held, or inside what is held.
    fn carried(&self, index: Index) -> bool {
        Some(self.scene.root(index)) == self.scene.robot.holds
    }

    fn walk(&self, index: Index) -> u32 {
        u32::from(!self.scene.in_reach(index))
    }

    /// Steps until the thing is in the hand: a walk, an OPEN around it, an emptied hand, a PICKUP.
    fn fetch(&self, index: Index) -> u32 {
        if self.held(index) {
            return 0;
        }
        let opened = u32::from(self.scene.shut_in(index).is_some());
        let emptied = u32::from(self.scene.robot.holds.is_some());
        self.walk(index) + opened + emptied + 1
    }

    /// A walk from where the thing is to some thing of `place`, unless one is there.
    fn bring(&self, index: Index, place: Kind) -> u32 {
        let root = self.scene.root(index);
        let there = |target: Index| match self.carried(index) {
            true => self.scene.in_reach(target),
            false => self.scene.root(target) == root,
        };
        u32::from(!self.scene.of(place).any(there))
    }

    /// An OPEN of the place, when all of its kind are shut and none is what the thing is shut in
    /// (then one OPEN serves both).
    fn open_place(&self, index: Index, place: Kind) -> u32 {
        let around = self.scene.shut_in(index).map(|around| self.scene.object(around).kind);
        let all_shut = self.scene.of(place).all(|target| self.scene.object(target).shut());
        u32::from(all_shut && around != Some(place))
    }

    fn deliver(&self, index: Index, place: Kind) -> u32 {
        self.fetch(index) + self.bring(index, place) + self.open_place(index, place) + 1
    }

    /// Steps for a second delivery after a first: there and back, unless it comes along in
    /// something that can be carried.
    fn deliver_next(&self, index: Index, place: Kind) -> u32 {
        let scene = self.scene;
        let comes_along = scene.ancestors(index).any(|i| scene.object(i).kind.pickupable());
        let root = scene.root(index);
        let there = scene.of(place).any(|target| scene.root(target) == root);
        let walks = if comes_along || there { 0 } else { 2 };
        let opened = scene.shut_in(index).map(|around| scene.object(around).kind);
        2 + walks + u32::from(opened.is_some_and(|around| around != place))
    }

    fn deliver_some(&self, thing: Kind, place: Kind, count: usize) -> u32 {
        let scene = self.scene;
        let missing = count.saturating_sub(delivered(scene, thing, None, place));
        let away: Vec<Index> = scene.of(thing).filter(|&i| !is_in(scene, i, place)).collect();
        let first = |index: Index| self.deliver(index, place);
        match missing {
            0 => 0,
            1 => away.iter().map(|&i| first(i)).min().unwrap_or(0),
            _ => {
                // What the hand holds is put down by its own delivery, so it must come first;
                // putting it elsewhere costs the PUT that `fetch` counts.
                let pairs = away.iter().flat_map(|&a| away.iter().map(move |&b| (a, b)));
                let cost = |(a, b): (Index, Index)| match self.held(b) {
                    true => None,
                    false => Some(first(a) + self.deliver_next(b, place)),
                };
                pairs.filter(|(a, b)| a != b).filter_map(cost).min().unwrap_or(0)
            }
        }
    }

    fn treat(&self, task: &Task, thing: Kind, place: Kind) -> u32 {
        let facts = facts();
        let appliance = match task.goal {
            Goal::Clean { .. } => facts.sink,
            Goal::Heat { .. } => facts.microwave,
            _ => facts.fridge,
        };
        let state = wanted(task).expect("asked of washing, heating and cooling only");
        let cost = |index: Index| match state.holds(self.scene, index) {
            true => self.deliver(index, place),
            false => {
                let closing = u32::from(task.closed && appliance.has_door());
                self.treat_one(task, index, appliance, place)
                    + self.closed_twice(appliance, closing)
            }
        };
        self.scene.of(thing).map(cost).min().unwrap_or(0)
    }

    /// An appliance that is shut now is opened to take the thing out, and so needs one more CLOSE
    /// than [`Here::open_doors`] sees.
    fn closed_twice(&self, appliance: Kind, closing: u32) -> u32 {
        let all_shut = self.scene.of(appliance).all(|i| self.scene.object(i).shut());
        if all_shut { closing } else { 0 }
    }

    fn treat_one(&self, task: &Task, index: Index, appliance: Kind, place: Kind) -> u32 {
        let scene = self.scene;
        let inside = scene.ancestors(index).find(|&i| scene.object(i).kind == appliance);
        let all_shut = scene.of(appliance).all(|i| scene.object(i).shut());
        // Into the appliance: fetched (or carried there in what the hand holds), and put.
        let into = match inside {
            Some(_) => self.walk(index) + u32::from(scene.robot.holds.is_some()),
            None => {
                let fetch = if self.carried(index) { 0 } else { self.fetch(index) };
                let opened = u32::from(appliance.has_door() && all_shut);
                fetch + self.bring(index, appliance) + opened + 1
            }
        };
        // The appliance works and gives the thing back.
        let shut_with_it = inside.is_some_and(|i| scene.object(i).shut());
        let work = match task.goal {
            Goal::Clean { .. } => {
                let running = |i: Index| scene.object(i).is(State::On);
                u32::from(!scene.of(facts().faucet).any(running))
            }
            Goal::Heat { .. } => u32::from(!shut_with_it) + 3,
            _ => u32::from(!shut_with_it) + 1,
        };
        let there = scene
            .of(place)
            .any(|target| scene.of(appliance).any(|i| scene.root(i) == scene.root(target)));
        let deliver = 1 + u32::from(!there) + 1 + self.open_place(index, place);
        into + work + deliver
    }

    fn look(&self, thing: Kind, light: Kind) -> u32 {
        let scene = self.scene;
        let dark = u32::from(!scene.of(light).any(|lamp| scene.object(lamp).is(State::On)));
        let cost = |index: Index| self.fetch(index) + self.bring(index, light);
        dark + scene.of(thing).map(cost).min().unwrap_or(0)
    }

    fn nested(&self, thing: Kind, carrier: Kind, place: Kind) -> u32 {
        let scene = self.scene;
        let cost = |index: Index, around: Index| {
            let inside = scene.object(index).parent == Some(around);
            let there = is_in(scene, around, place);
            match (inside, there) {
                (true, true) => 0,
                (true, false) => self.deliver(around, place),
                (false, true) => {
                    let same = scene.root(index) == scene.root(around);
                    let near = if self.carried(index) { scene.in_reach(around) } else { same };
                    self.fetch(index) + u32::from(!near) + 1
                }
                (false, false) => self.fill_and_deliver(index, around, place),
            }
        };
        let pairs = scene.of(thing).flat_map(|i| scene.of(carrier).map(move |c| (i, c)));
        pairs.filter(|(i, c)| i != c).map(|(i, c)| cost(i, c)).min().unwrap_or(0)
    }

    /// Both the thing and its carrier are picked up and put once; every place that has to be
    /// visited and is not in reach takes a walk.
    fn fill_and_deliver(&self, index: Index, around: Index, place: Kind) -> u32 {
        let scene = self.scene;
        let mut visits: Vec<Index> = Vec::new();
        for each in [index, around] {
            if !self.carried(each) && !visits.contains(&scene.root(each)) {
                visits.push(scene.root(each));
            }
        }
        let on_the_way = scene
            .of(place)
            .any(|target| visits.contains(&scene.root(target)) || scene.in_reach(target));
        let walks = visits.iter().filter(|root| scene.robot.at != Some(**root)).count() as u32;
        let in_the_way = scene.robot.holds.is_some_and(|held| held != index && held != around);
        let picked = u32::from(!self.held(index)) + u32::from(!self.held(around));
        walks + u32::from(!on_the_way) + u32::from(in_the_way) + picked + 2
    }

    fn open_doors(&self) -> u32 {
        let doors = self.scene.objects.iter().filter(|o| o.kind.has_door() && !o.shut());
        doors.count() as u32
    }
}
