use super::builder::{ObjectId, SceneBuilder};
use super::facts::{Kind, Room, facts};
use super::primitives::{Action, act};
use super::random::Random;
use super::refusal::Refusal;
use super::scene::{Index, Scene, State};
use super::task::Task;
use crate::language::Program;
use crate::world::Lexicon;

/// A request for a scene in which a given program runs. An evaluation needs it: it has a recorded
/// sentence and its program, but no recorded scene.
///
/// The scene has the things that the program names, and `others` more things of the room, drawn
/// from `seed`. The robot stands where the program needs it and holds what the program needs. Doors
/// are open or shut as the program needs them. A type that it picks up without saying from where is
/// somewhere in the room.
#[derive(Debug, Clone)]
pub struct MatchingScene<'a> {
    /// The kind of room.
    pub room: Room,
    /// What the scene must fit.
    pub program: &'a Program,
    /// How many more things.
    pub others: usize,
    /// Whether these may share a name with what the program names.
    pub clashes: bool,
    /// Whether what the program toggles is on at first.
    pub on: bool,
    /// What the robot holds at first, where the program does not say.
    pub held: Option<Kind>,
    /// Every value is legal.
    pub seed: u64,
}

/// What the scene will be built from.
#[derive(Default)]
struct Sketch {
    things: Vec<Wish>,
    held: Option<usize>,
    stands_at: Option<usize>,
}

struct Wish {
    kind: Kind,
    parent: Option<usize>,
    open: bool,
    on: bool,
}

/// How often a sketch is repaired before it is given up. Each repair adds or moves one thing.
const REPAIRS_MAX: usize = 100;

impl MatchingScene<'_> {
    /// Builds the scene.
    ///
    /// - errors: a sentence with the step, when no scene fits the program (it puts a Mug on a
    ///   Sofa), or when it names something that is not a type.
    pub fn build(&self, lexicon: &Lexicon) -> Result<Scene, String> {
        let actions: Vec<Action> =
            self.program.steps.iter().map(Action::read).collect::<Result<_, _>>()?;
        let mut random = Random::new(self.seed);
        let mut sketch = Sketch::default();
        if let Some(kind) = self.held {
            sketch.held = Some(sketch.add(kind, None));
        }
        for _ in 0..REPAIRS_MAX {
            let scene = sketch.build(self.room)?;
            match first_failure(&scene, &actions) {
                None => {
                    self.furnish(&mut sketch, lexicon, &mut random);
                    let scene = sketch.shuffled(&mut random).build(self.room)?;
                    return match first_failure(&scene, &actions) {
                        None => Ok(scene),
                        Some((step, refusal, at)) => Err(unfit(step, refusal, &at)),
                    };
                }
                Some((step, refusal, at)) => {
                    if !sketch.repair(&actions, step, refusal, &scene, &at, self.on) {
                        return Err(unfit(step, refusal, &at));
                    }
                }
            }
        }
        Err(format!("no scene was found for {} in {REPAIRS_MAX} attempts", self.program))
    }

    /// Adds the other things of the room, and gives every carriable thing without a place a place.
    fn furnish(&self, sketch: &mut Sketch, lexicon: &Lexicon, random: &mut Random) {
        let gold: Vec<Kind> = sketch.things.iter().map(|wish| wish.kind).collect();
        let share = |kind: Kind| {
            let means = |kind: Kind, meanings: &[crate::world::Meaning]| {
                meanings.iter().any(|meaning| meaning.kind == *kind.symbol())
            };
            let both = |meanings: &Vec<crate::world::Meaning>| {
                means(kind, meanings) && gold.iter().any(|other| means(*other, meanings))
            };
            lexicon.names.values().any(both)
        };
        let mut choice: Vec<(Kind, u32)> = facts()
            .room(self.room)
            .things
            .iter()
            // A faucet is never alone: it comes with its basin.
            .filter(|thing| thing.kind != facts().faucet && !gold.contains(&thing.kind))
            .filter(|thing| self.clashes || !share(thing.kind))
            .map(|thing| (thing.kind, thing.in_scenes))
            .collect();
        for _ in 0..self.others {
            let Some(kind) = random.weighted(&choice).copied() else { break };
            choice.retain(|(other, _)| *other != kind);
            let id = sketch.add(kind, None);
            sketch.settle_down(id, random);
        }
        for id in 0..gold.len() {
            if sketch.things[id].kind.pickupable() {
                sketch.settle_down(id, random);
            }
        }
    }
}

fn unfit(step: usize, refusal: Refusal, scene: &Scene) -> String {
    format!("no scene fits step {}: {}", step + 1, refusal.sentence(scene))
}

/// The first step (from 0) that cannot run, with the scene it could not run in.
fn first_failure(scene: &Scene, actions: &[Action]) -> Option<(usize, Refusal, Scene)> {
    let mut scene = scene.clone();
    let task = Task::free();
    actions.iter().enumerate().find_map(|(step, action)| {
        act(&mut scene, &task, *action).err().map(|refusal| (step, refusal, scene.clone()))
    })
}

impl Sketch {
    fn add(&mut self, kind: Kind, parent: Option<usize>) -> usize {
        self.things.push(Wish { kind, parent, open: kind.usually_open(), on: false });
        self.things.len() - 1
    }

    /// Things keep their numbers: the scene's n-th thing is the sketch's n-th.
    fn build(&self, room: Room) -> Result<Scene, String> {
        let mut builder = SceneBuilder::new(room);
        for (number, wish) in self.things.iter().enumerate() {
            let id = match wish.parent {
                _ if self.held == Some(number) => builder.hold(wish.kind.name()),
                // Parents may come later in the sketch; they are set when all are there.
                _ => builder.stand_kind(wish.kind),
            };
            let id = id.map_err(|error| error.to_string())?;
            for (state, holds) in [(State::Open, wish.open), (State::On, wish.on)] {
                if state.fits(wish.kind) {
                    builder.set(id, state, holds).map_err(|error| error.to_string())?;
                }
            }
        }
        for (number, wish) in self.things.iter().enumerate() {
            if let Some(parent) = wish.parent {
                let (child, parent) = (ObjectId(number as Index), ObjectId(parent as Index));
                builder.place_in(child, parent).map_err(|error| error.to_string())?;
            }
        }
        if let Some(at) = self.stands_at {
            builder.stand_at(ObjectId(at as Index));
        }
        Ok(builder.build())
    }

    /// Changes the sketch so that the step gets further; `at` is the scene in which it failed.
    fn repair(
        &mut self,
        actions: &[Action],
        step: usize,
        refusal: Refusal,
        start: &Scene,
        at: &Scene,
        on: bool,
    ) -> bool {
        let walked = actions[..step].iter().any(|action| matches!(action, Action::Goto(_)));
        let here = at.robot.at.map(usize::from);
        match refusal {
            Refusal::NoneHere(kind) => self.introduce(actions, step, kind, here, on),
            Refusal::NotHeld(kind) if at.robot.holds.is_none() && self.held.is_none() => {
                self.held = Some(self.add(kind, None));
                true
            }
            Refusal::OutOfReach(index) => {
                let number = usize::from(index);
                let moved = start.object(index).parent != at.object(index).parent
                    || start.robot.holds == Some(index);
                match here {
                    None if !walked => {
                        self.stands_at = Some(number);
                        true
                    }
                    // The program carried the first one away before, so a second one must be here.
                    _ if moved => {
                        let kind = at.object(index).kind;
                        let before = self.things.len();
                        self.introduce(actions, step, kind, here, on)
                            && self.things.len() > before
                            && self.things[before].parent.is_some()
                    }
                    Some(here) => self.bring_together(number, here, actions, step),
                    None => false,
                }
            }
            Refusal::Shut(index) | Refusal::ShutIn(_, index) | Refusal::AlreadyClosed(index) => {
                let wish = &mut self.things[usize::from(index)];
                !std::mem::replace(&mut wish.open, true)
            }
            Refusal::AlreadyOpen(index) => {
                let wish = &mut self.things[usize::from(index)];
                std::mem::replace(&mut wish.open, false)
            }
            _ => false,
        }
    }

    /// Adds the first thing of a kind where the step needs it.
    fn introduce(
        &mut self,
        actions: &[Action],
        step: usize,
        kind: Kind,
        here: Option<usize>,
        on: bool,
    ) -> bool {
        match actions[step] {
            Action::Put(thing, _) if thing == kind => {
                if self.held.is_some() {
                    return false;
                }
                self.held = Some(self.add(kind, None));
                return true;
            }
            Action::Pickup(_) => {
                if let Some(around) = self.opened_around(actions, step, kind) {
                    self.add(kind, Some(around));
                    return true;
                }
            }
            _ => {}
        }
        let base = match here {
            Some(here) if !matches!(actions[step], Action::Goto(_)) => self.base(kind, here),
            _ => self
                .things
                .iter()
                .position(|wish| kind == facts().faucet && kind.may_stand_on(wish.kind)),
        };
        let id = self.add(kind, base);
        self.things[id].on = on && matches!(actions[step], Action::Toggle(_));
        // A faucet has a basin to run into.
        if kind == facts().faucet && base.is_none() {
            let sink = self.add(facts().sink, None);
            self.things[id].parent = Some(sink);
        }
        true
    }

    /// The thing itself, or what is in or on it, that a new thing of `kind` can be in or on.
    fn base(&self, kind: Kind, here: usize) -> Option<usize> {
        let fits = |number: &usize| {
            let under = self.things[*number].kind;
            under.may_hold(kind) || kind.may_stand_on(under)
        };
        let on_it = (0..self.things.len()).filter(|n| self.things[*n].parent == Some(here));
        std::iter::once(here).chain(on_it).find(fits)
    }

    /// The container that is opened just before a pick-up or closed just after it.
    fn opened_around(&mut self, actions: &[Action], step: usize, kind: Kind) -> Option<usize> {
        let before = actions[..step].iter().rev().find_map(|action| match action {
            Action::Open(around) => Some(Some(*around)),
            Action::Close(_) | Action::Goto(_) => Some(None),
            _ => None,
        });
        let after = match actions.get(step + 1) {
            Some(Action::Close(around)) => Some(*around),
            _ => None,
        };
        let around = before.flatten().or(after).filter(|around| around.may_hold(kind))?;
        let known = self.things.iter().position(|wish| wish.kind == around);
        Some(known.unwrap_or_else(|| self.add(around, None)))
    }

    /// Makes a thing reachable from where the robot is: on what it stands at, or that in it.
    fn bring_together(
        &mut self,
        number: usize,
        here: usize,
        actions: &[Action],
        step: usize,
    ) -> bool {
        let kind = self.things[number].kind;
        let free = self.things[number].parent.is_none();
        if let Some(base) = self.base(kind, here).filter(|base| free && *base != number) {
            self.things[number].parent = Some(base);
            return true;
        }
        // "Go to the cup; open the cabinet": the cup is in the cabinet.
        let walked_to = actions[..step].iter().rev().find_map(|action| match action {
            Action::Goto(kind) => Some(*kind),
            _ => None,
        });
        let inner = self.things.iter().position(|wish| Some(wish.kind) == walked_to);
        match inner {
            Some(inner) if self.things[inner].parent.is_none() => {
                let inner_kind = self.things[inner].kind;
                let fits = kind.may_hold(inner_kind) || inner_kind.may_stand_on(kind);
                if fits {
                    self.things[inner].parent = Some(number);
                }
                fits || (free && self.share_base(number, here))
            }
            _ => free && self.share_base(number, here),
        }
    }

    /// "Go to the lamp; pick up the book": both are on one table.
    fn share_base(&mut self, number: usize, here: usize) -> bool {
        let (thing, lamp) = (self.things[number].kind, self.things[here].kind);
        let fits = |base: &Kind| base.may_hold(thing) && lamp.may_stand_on(*base);
        match facts().all().find(fits).filter(|_| self.things[here].parent.is_none()) {
            Some(kind) => {
                let base = self.add(kind, None);
                self.things[number].parent = Some(base);
                self.things[here].parent = Some(base);
                true
            }
            None => false,
        }
    }

    /// Puts a carriable thing without a place in or on something that can hold it and is not behind
    /// a door, and a further lamp on a table.
    fn settle_down(&mut self, number: usize, random: &mut Random) {
        let wish = &self.things[number];
        let used = self.held == Some(number) || self.stands_at == Some(number);
        if used || wish.parent.is_some() {
            return;
        }
        let fits = |other: &usize| {
            let under = self.things[*other].kind;
            *other != number
                && under.may_hold(wish.kind)
                && !under.pickupable()
                && !under.has_door()
        };
        let places: Vec<usize> = (0..self.things.len()).filter(fits).collect();
        let place = random.pick(&places).copied();
        self.things[number].parent = place;
    }

    /// The same in another order, so that what the program names is not always first.
    fn shuffled(self, random: &mut Random) -> Sketch {
        let mut order: Vec<usize> = (0..self.things.len()).collect();
        random.shuffle(&mut order);
        let mut place = vec![0; order.len()];
        order.iter().enumerate().for_each(|(new, old)| place[*old] = new);
        let mut things: Vec<(usize, Wish)> = self
            .things
            .into_iter()
            .enumerate()
            .map(|(old, wish)| (place[old], Wish { parent: wish.parent.map(|p| place[p]), ..wish }))
            .collect();
        things.sort_by_key(|(new, _)| *new);
        Sketch {
            things: things.into_iter().map(|(_, wish)| wish).collect(),
            held: self.held.map(|old| place[old]),
            stands_at: self.stands_at.map(|old| place[old]),
        }
    }
}
