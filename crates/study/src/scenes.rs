//! The scene that a row's sentence is said in: what its program needs, among ten other things of
//! that room.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::str::FromStr;

use apprentice::language::{Program, Symbol};
use apprentice::numerics::Rng;
use apprentice::world::household::{Household, MatchingScene, Scene, Task};
use apprentice::world::{Edition, Lexicon, Words, World};

use super::carried::carried;
use super::corpus::Row;

/// Other things in a scene, where the room has so many.
pub const OTHERS: usize = 10;

/// Whether other things may be called what a needed thing is called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clashes {
    /// None of the others shares a name with a needed thing: a name means what it should.
    Avoided,
    /// As rooms are: a mug beside the cup.
    Allowed,
}

/// Whether a scene also has what only the sentence tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Staging {
    /// What the program needs, and nothing else: hands are empty on a walk, lamps are off.
    #[default]
    Plain,
    /// "Bring the mug to the sink" is said with the mug in the hand, and "turn off the lamp" while
    /// the lamp is on.
    Held,
}

impl fmt::Display for Staging {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Staging::Plain => "plain",
            Staging::Held => "held",
        })
    }
}

impl FromStr for Staging {
    type Err = String;
    fn from_str(text: &str) -> Result<Staging, String> {
        match text {
            "plain" => Ok(Staging::Plain),
            "held" => Ok(Staging::Held),
            other => Err(format!("{other:?} is neither plain nor held")),
        }
    }
}

/// Sets scenes.
pub struct Stages<'a> {
    household: &'a Household,
    lexicon: &'a Lexicon,
    pub staging: Staging,
    /// From a kind to what it may be called.
    names: BTreeMap<Symbol, BTreeSet<&'a str>>,
}

impl<'a> Stages<'a> {
    pub fn new(household: &'a Household) -> Stages<'a> {
        let lexicon = household.lexicon(Edition::First);
        let (names, staging) = (names_by_kind(lexicon), Staging::Plain);
        Stages { household, lexicon, staging, names }
    }

    pub fn staged(self, staging: Staging) -> Stages<'a> {
        Stages { staging, ..self }
    }

    /// The scene for a row, drawn by `rng`: its program runs in it.
    ///
    /// - errors: why there is none, in a sentence.
    pub fn set(&self, row: &Row, clashes: Clashes, rng: &mut Rng) -> Result<Scene, String> {
        let Row { room, program, .. } = row;
        let clashes = clashes == Clashes::Allowed;
        let seed = rng.next_u64();
        let held = match self.staging {
            Staging::Plain => None,
            Staging::Held => carried(self.lexicon, row),
        };
        let build = |on: bool| {
            let room = *room;
            let scene = MatchingScene { room, program, others: OTHERS, clashes, on, held, seed };
            scene.build(self.lexicon)
        };
        let scene = build(row.on)?;
        match self.staging == Staging::Held && !row.on && self.contradicted(row, &scene) {
            true => build(true),
            false => Ok(scene),
        }
    }

    /// Whether the words of a row ask to turn off what is off in the scene.
    fn contradicted(&self, row: &Row, scene: &Scene) -> bool {
        let steps = &row.program.steps;
        let mut toggles = (0..steps.len()).filter(|at| steps[*at].operator == "TOGGLE");
        let (Some(at), None) = (toggles.next(), toggles.next()) else { return false };
        let mut scene = scene.clone();
        for step in &steps[..at] {
            if self.household.step(&mut scene, &Task::free(), step).is_err() {
                return false;
            }
        }
        let toggle = Program { steps: vec![steps[at].clone()] };
        self.household.contradiction(&scene, &row.sentence.tokens(), &toggle).is_some()
    }

    /// Whether two kinds may be called the same.
    pub fn share_a_name(&self, one: &Symbol, other: &Symbol) -> bool {
        match (self.names.get(one), self.names.get(other)) {
            (Some(ones), Some(others)) => !ones.is_disjoint(others),
            _ => false,
        }
    }
}

fn names_by_kind(lexicon: &Lexicon) -> BTreeMap<Symbol, BTreeSet<&str>> {
    let mut names: BTreeMap<Symbol, BTreeSet<&str>> = BTreeMap::new();
    for (name, meanings) in &lexicon.names {
        for meaning in meanings {
            names.entry(meaning.kind.clone()).or_default().insert(name);
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw;
    use apprentice::world::Show;
    use apprentice::world::household::{Room, Task};

    fn row(room: Room, program: &str) -> Row {
        Row::about(room, "do it", program)
    }

    fn set(stages: &Stages<'_>, row: &Row, clashes: Clashes, seed: u64) -> Result<Scene, String> {
        stages.set(row, clashes, &mut draw::rng(seed, &["test"]))
    }

    fn things(scene: &Scene, household: &Household) -> Vec<Symbol> {
        household.look(scene).things.into_iter().map(|thing| thing.kind).collect()
    }

    #[test]
    fn ten_other_things_share_no_name_with_what_is_needed() {
        let household = Household::new();
        let stages = Stages::new(&household);
        let row = row(Room::LivingRoom, "PUT Mug CoffeeTable");
        let mut met = false;
        for seed in 0..20 {
            let scene = set(&stages, &row, Clashes::Avoided, seed).unwrap();
            let kinds = things(&scene, &household);
            assert_eq!(kinds.len(), 2 + OTHERS, "seed {seed}: {kinds:?}");
            assert_eq!(household.held(&scene), Some(Symbol::new("Mug")));
            for kind in &kinds {
                let needed = kind == "Mug" || kind == "CoffeeTable";
                let table = stages.share_a_name(kind, &Symbol::new("CoffeeTable"));
                assert!(needed || !table, "seed {seed}: {kind}");
            }
            let clashing = set(&stages, &row, Clashes::Allowed, seed).unwrap();
            let clashing = things(&clashing, &household);
            met |= clashing.iter().any(|kind| kind == "SideTable" || kind == "DiningTable");
        }
        assert!(met, "no scene had another table, though clashes were allowed");
    }

    #[test]
    fn what_people_held_and_what_was_on_is_staged_when_asked_for() {
        let household = Household::new();
        let stages = Stages::new(&household);
        let held = Stages::new(&household).staged(Staging::Held);
        let carry = Row::about(Room::Kitchen, "take the mug to the sink", "GOTO SinkBasin");
        let lamp = Row::about(Room::Bedroom, "turn off the desk lamp", "TOGGLE DeskLamp");
        let is_on = |scene: &Scene| {
            let things = household.look(scene).things;
            things
                .iter()
                .any(|thing| thing.kind == "DeskLamp" && thing.states.iter().any(|s| s == "on"))
        };
        for seed in 0..5 {
            let scene = set(&held, &carry, Clashes::Avoided, seed).unwrap();
            assert_eq!(household.held(&scene), Some(Symbol::new("Mug")));
            let scene = set(&stages, &carry, Clashes::Avoided, seed).unwrap();
            assert_eq!(household.held(&scene), None);
            assert!(is_on(&set(&held, &lamp, Clashes::Avoided, seed).unwrap()));
            assert!(!is_on(&set(&stages, &lamp, Clashes::Avoided, seed).unwrap()));
            let pick = row(Room::Kitchen, "PICKUP Mug");
            let [one, other] = [&held, &stages].map(|s| set(s, &pick, Clashes::Avoided, seed));
            assert_eq!(one, other);
        }
    }

    #[test]
    fn the_program_runs_in_its_scene() {
        let household = Household::new();
        let stages = Stages::new(&household);
        for program in [
            "PICKUP Mug",
            "OPEN Fridge; PICKUP Mug; CLOSE Fridge",
            "PUT Mug SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Mug",
            "OPEN Microwave; PUT Mug Microwave; CLOSE Microwave; TOGGLE Microwave; \
             TOGGLE Microwave; OPEN Microwave; PICKUP Mug; CLOSE Microwave",
            "GOTO CounterTop; PICKUP Mug; GOTO Fridge; OPEN Fridge; PUT Mug Fridge; CLOSE Fridge",
        ] {
            let row = row(Room::Kitchen, program);
            for seed in 0..10 {
                let scene = set(&stages, &row, Clashes::Avoided, seed);
                let mut scene = scene.unwrap_or_else(|why| panic!("seed {seed}: {program}: {why}"));
                for step in &row.program.steps {
                    let done = household.step(&mut scene, &Task::free(), step);
                    assert!(done.is_ok(), "seed {seed}: {program}: {done:?}");
                }
            }
        }
    }

    #[test]
    fn a_scene_depends_on_its_seed_alone() {
        let household = Household::new();
        let stages = Stages::new(&household);
        let row = row(Room::Bedroom, "PICKUP Book");
        let set = |seed| set(&stages, &row, Clashes::Avoided, seed).unwrap();
        assert_eq!(set(3), set(3));
        assert_ne!(set(3), set(4));
    }

    #[test]
    fn what_cannot_be_done_anywhere_is_said() {
        let household = Household::new();
        let stages = Stages::new(&household);
        let why = |program: &str| {
            set(&stages, &row(Room::Kitchen, program), Clashes::Avoided, 1).unwrap_err()
        };
        assert!(why("GOTO Unicorn").contains("Unicorn"));
        assert!(why("PICKUP Fridge").contains("Fridge"));
    }
}
