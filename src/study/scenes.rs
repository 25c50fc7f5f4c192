//! The scene that a row's sentence is said in: what its program needs, among ten other things of
//! that room.

use std::collections::{BTreeMap, BTreeSet};

use super::corpus::Row;
use crate::language::Symbol;
use crate::numerics::Rng;
use crate::world::household::{Household, MatchingScene, Scene};
use crate::world::{Domain, Lexicon};

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

/// Sets scenes.
pub struct Stages<'a> {
    lexicon: &'a Lexicon,
    /// From a kind to what it may be called.
    names: BTreeMap<Symbol, BTreeSet<&'a str>>,
}

impl<'a> Stages<'a> {
    pub fn new(household: &'a Household) -> Stages<'a> {
        let lexicon = household.lexicon();
        Stages { lexicon, names: names_by_kind(lexicon) }
    }

    /// The scene for a row, drawn by `rng`: its program runs in it.
    ///
    /// - errors: why there is none, in a sentence.
    pub fn set(&self, row: &Row, clashes: Clashes, rng: &mut Rng) -> Result<Scene, String> {
        let Row { room, program, on, .. } = row;
        let (room, on) = (*room, *on);
        let clashes = clashes == Clashes::Allowed;
        let seed = rng.next_u64();
        let scene = MatchingScene { room, program, others: OTHERS, clashes, on, seed };
        scene.build(self.lexicon)
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
    use crate::study::draw;
    use crate::world::household::{Room, Task};

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
