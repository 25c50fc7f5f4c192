use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::Path;

use super::super::{MatchingScene, Room};
use super::{Household, Scene, Task, run};
use crate::language::Program;
use crate::world::{Edition, Show, Words};

fn matching(household: &Household, program: &str, seed: u64) -> Result<Scene, String> {
    let program: Program = program.parse().unwrap();
    let request = MatchingScene {
        room: Room::Kitchen,
        program: &program,
        others: 10,
        clashes: false,
        on: false,
        held: None,
        seed,
    };
    request.build(household.lexicon(Edition::First))
}

#[test]
fn a_matching_scene_has_what_the_program_needs_and_ten_other_things_with_other_names() {
    let household = Household::new();
    for program in [
        "PICKUP Cup",
        "PUT Knife CounterTop",
        "OPEN Fridge; PUT Apple Fridge; CLOSE Fridge",
        "PICKUP Tomato; CLOSE Fridge",
        "TOGGLE Faucet",
        "GOTO SinkBasin; PUT Apple SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Apple",
        "GOTO Cup; OPEN Cabinet; PUT Spoon Cup; CLOSE Cabinet",
        "GOTO Shelf; PICKUP Cup; GOTO Fridge; OPEN Fridge; PUT Cup Fridge; GOTO Shelf; PICKUP Cup",
    ] {
        for seed in 0..20 {
            let mut scene = matching(&household, program, seed)
                .unwrap_or_else(|reason| panic!("{program}, seed {seed}: {reason}"));
            let kinds: Vec<_> = household.look(&scene).things.into_iter().map(|t| t.kind).collect();
            assert!(kinds.len() >= 11, "{program}, seed {seed}");
            let gold = program.split([' ', ';']).filter(|word| kinds.iter().any(|k| *k == *word));
            let gold: Vec<&str> = gold.collect();
            for meanings in household.lexicon(Edition::First).names.values() {
                let shared = |kind: &&crate::language::Symbol| {
                    meanings.iter().any(|m| m.kind == **kind) && !gold.contains(&kind.as_str())
                };
                if meanings.iter().any(|m| gold.contains(&m.kind.as_str())) {
                    // A basin comes with its faucet though both may be called "sink".
                    let clash = kinds.iter().find(shared).filter(|kind| **kind != "SinkBasin");
                    assert_eq!(clash, None, "{program}, seed {seed}");
                }
            }
            run(&household, &mut scene, &Task::free(), program).unwrap();
        }
    }
    let reason = matching(&household, "PUT Mug Sofa", 1).unwrap_err();
    assert_eq!(reason, "no scene fits step 1: a Mug does not go on a Sofa");
}

/// Recorded plans run in scenes made for them. Needs the recorded data beside the project.
#[test]
fn recorded_plans_run_in_matching_scenes() {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let household = Household::new();
    for name in ["alfred_goals.jsonl.gz", "alfred_utterances.jsonl.gz"] {
        let Ok(file) = std::fs::File::open(shared.join(name)) else {
            println!("skipped: {} is not there", shared.join(name).display());
            return;
        };
        let lines = BufReader::new(flate2::read::GzDecoder::new(file)).lines();
        let mut programs: BTreeMap<(Room, String), u32> = BTreeMap::new();
        for line in lines {
            let row: serde_json::Value = serde_json::from_str(&line.unwrap()).unwrap();
            let Some(prims) = row["prims"].as_array() else { continue };
            if row["expressible"] == false || row["suspect"] == true {
                continue;
            }
            let room = match row["scene"].as_u64().unwrap() {
                1..=30 => Room::Kitchen,
                201..=230 => Room::LivingRoom,
                301..=330 => Room::Bedroom,
                _ => Room::Bathroom,
            };
            let steps: Vec<&str> = prims.iter().map(|step| step.as_str().unwrap()).collect();
            *programs.entry((room, steps.join("; "))).or_default() += 1;
        }
        let (mut fit, mut all) = (0, 0);
        let mut reasons: Vec<(u32, String)> = Vec::new();
        for ((room, text), count) in &programs {
            let program: Program = text.parse().unwrap();
            let request = MatchingScene {
                room: *room,
                program: &program,
                others: 10,
                clashes: false,
                on: false,
                held: None,
                seed: 7,
            };
            all += count;
            match request.build(household.lexicon(Edition::First)) {
                Ok(_) => fit += count,
                Err(reason) => reasons.push((*count, format!("{text}: {reason}"))),
            }
        }
        reasons.sort();
        reasons.iter().rev().take(12).for_each(|(count, reason)| println!("{count} × {reason}"));
        println!("{name}: {fit} of {all} recorded programs fit a scene");
        assert!(fit * 100 >= all * 97, "{name}: only {fit} of {all}");
    }
}
