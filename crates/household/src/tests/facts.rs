use std::collections::BTreeSet;

use super::super::facts::{Room, facts};
use super::{Household, Task};
use crate::language::{LiftedArg, Word};
use crate::world::{Edition, Lexicon, Words, World};

#[test]
fn every_recorded_task_makes_sense() {
    for room in Room::ALL {
        for text in facts().room(room).tasks.values().flatten() {
            let task: Task = text.parse().unwrap_or_else(|reason| panic!("{text}: {reason}"));
            assert_eq!(task.to_string(), *text);
        }
    }
}

#[test]
fn everything_that_can_be_carried_can_be_put_somewhere() {
    for kind in facts().all().filter(|kind| kind.pickupable()) {
        assert!(facts().all().any(|place| place.may_hold(kind)), "{kind}");
    }
}

#[test]
fn names_are_lower_case_and_every_kind_has_one() {
    let household = Household::new();
    for edition in Edition::ALL {
        check_names(household.lexicon(edition));
    }
}

fn check_names(lexicon: &Lexicon) {
    let mut named = BTreeSet::new();
    for (name, meanings) in &lexicon.names {
        assert_eq!(*name, name.to_lowercase());
        assert!(!meanings.is_empty(), "{name}");
        assert!(meanings.is_sorted_by_key(|m| std::cmp::Reverse(m.count)), "{name}");
        named.extend(meanings.iter().map(|meaning| meaning.kind.as_str().to_owned()));
    }
    for kind in facts().all() {
        assert!(named.contains(kind.name()), "{kind} has no name");
    }
    for states in ["clean", "dirty", "hot", "cold", "sliced", "open", "closed", "two"] {
        assert!(!lexicon.adjectives.iter().any(|word| word == states), "{states}");
    }
}

#[test]
fn there_are_44_seeds_over_six_primitives_and_all_programs_fit_their_utterances() {
    let household = Household::new();
    let seeds = household.seeds();
    assert_eq!(seeds.exemplars.len(), 44);
    let operators: BTreeSet<&str> = seeds
        .exemplars
        .iter()
        .flat_map(|seed| &seed.program.steps)
        .map(|step| step.operator.as_str())
        .collect();
    assert_eq!(operators.len(), 6);
    let mut known = BTreeSet::new();
    for seed in seeds.exemplars.iter().chain(&seeds.variants) {
        assert!(known.insert(seed.utterance.to_string()), "{} occurs twice", seed.utterance);
        assert!(seed.program.slots() <= seed.utterance.slots(), "{}", seed.utterance);
        for step in &seed.program.steps {
            let operator = household.signature().operators.iter().find(|o| o.name == step.operator);
            assert_eq!(operator.unwrap().args.len(), step.args.len(), "{}", seed.utterance);
            assert!(!step.args.iter().any(|arg| matches!(arg, LiftedArg::Constant(_))));
        }
    }
    let verbs: BTreeSet<&Word> =
        seeds.exemplars.iter().map(|seed| &seed.utterance.words[0]).collect();
    for unknown in &seeds.unknown {
        assert!(known.insert(unknown.to_string()), "{unknown} occurs twice");
        assert!(!verbs.contains(&unknown.words[0]), "{unknown} starts with a seed's verb");
    }
    assert!(seeds.variants.len() >= 40 && seeds.unknown.len() >= 60);
}
