//! Reports of lives written by hand.

use apprentice::ids::{Digest, Seq, TenantId, UserId};
use apprentice::language::{Outcome, Program};

use super::report::Report;
use super::*;

fn understood(program: &str) -> Outcome {
    let program: Program = program.parse().unwrap();
    Outcome::Understood { bindings: vec![Vec::new(); program.steps.len()], program }
}

fn impossible(program: &str) -> Outcome {
    let program = program.parse().unwrap();
    Outcome::Impossible { program, step: 0, reason: "it is too late".to_owned() }
}

fn turn(seq: u64, utterance: &str, recorded: Outcome, other: Outcome) -> Turn {
    let (seq, utterance) = (Seq::new(seq).unwrap(), utterance.to_owned());
    Turn { seq, utterance, recorded, others: vec![other] }
}

fn life(episodes: Vec<Episode>, live: Vec<Taught>) -> Life {
    Life {
        tenant: TenantId::local(),
        user: UserId::new("ada, the \"first\"").unwrap(),
        recipe: "paper".to_owned(),
        recipe_digest: Digest::ZERO,
        episodes,
        live,
        minds: MindCounts::default(),
    }
}

fn two_episodes() -> Life {
    let taught = |explains, utterance: &str, program: &str| Taught {
        explains: Seq::new(explains).unwrap(),
        utterance: utterance.to_owned(),
        program: program.parse().unwrap(),
    };
    let first = Episode {
        number: 1,
        goal: "a clean mug.".to_owned(),
        fewest: Some(2),
        turns: vec![
            turn(3, "go", understood("GOTO Mug"), understood("GOTO Mug")),
            turn(4, "wash it", Outcome::NotSure, impossible("OPEN Mug")),
            turn(5, "rinse it", Outcome::NotSure, understood("PICKUP Mug; TOGGLE Faucet")),
            turn(6, "take it", understood("PICKUP Mug"), Outcome::NotSure),
        ],
        ends: vec![Some(2)],
    };
    let second = Episode {
        number: 2,
        goal: "the same".to_owned(),
        fewest: Some(1),
        turns: vec![turn(20, "open", impossible("OPEN Mug"), Outcome::NotSure)],
        ends: vec![None],
    };
    let live = vec![
        taught(5, "rinse it", "PICKUP Mug; TOGGLE Faucet"),
        taught(4, "wash it", "OPEN Mug"),
        // The same pair again is one example.
        taught(4, "wash it", "OPEN Mug"),
    ];
    life(vec![first, second], live)
}

fn report(lives: &[Life]) -> Report {
    Report::of(&[Variant::threshold(0.25)], lives, Vec::new(), 44)
}

#[test]
fn changes_are_counted_up_to_the_end_and_over_all_turns() {
    let report = report(&[two_episodes()]);
    let variant = &report.variants[0];
    let (near, all) = (&variant.up_to_the_end, &variant.over_all_turns);
    assert_eq!((near.turns, all.turns), (4, 5));
    assert_eq!((near.same, near.different), (1, 3));
    assert_eq!((all.same, all.different), (1, 4));
    assert_eq!((near.became_understood, near.became_impossible, near.became_not_sure), (1, 1, 1));
    assert_eq!((all.became_understood, all.became_impossible, all.became_not_sure), (1, 1, 2));
    assert_eq!((all.recorded.understood, all.other.understood), (2, 2));
    assert_eq!(near.recorded.complexity, 1.0 / 4.0);
    assert_eq!(near.other.complexity, 3.0 / 4.0);
    assert_eq!((all.recorded.complexity, all.other.complexity), (2.0 / 5.0, 3.0 / 5.0));
}

#[test]
fn a_lesson_is_needless_when_its_program_is_the_answer() {
    let report = report(&[two_episodes()]);
    let examples = report.variants[0].over_all_turns.examples_taught;
    assert_eq!((examples.recorded, examples.other), (46.0, 45.0));
    // An impossible answer names the program and does not carry it out: that lesson is needed.
    assert_eq!((examples.needless, examples.newly_open), (1, 1));
    assert_eq!(report.variants[0].up_to_the_end.examples_taught.newly_open, 0);
}

#[test]
fn episodes_say_where_the_loop_ends_and_what_is_known_of_their_length() {
    let report = report(&[two_episodes()]);
    let episodes = report.variants[0].episodes;
    assert_eq!((episodes.episodes, episodes.loop_ends), (2, 1));
    assert_eq!(episodes.loop_end_turn, Some(3.0));
    assert_eq!(episodes.normalised_length_recorded, Some((4.0 / 2.0 + 1.0) / 2.0));
    assert_eq!(episodes.normalised_length_unchanged, Some(1.0));
    let told = &report.variants[0].people[0].episodes;
    assert_eq!(told[0].loop_ends_at_turn, Some(3));
    let closed: Vec<bool> = told[0].differences.iter().map(|d| d.before_the_loop_ended).collect();
    assert_eq!(closed, [true, true, false]);
    assert_eq!(told[1].loop_ends_at_turn, None);
    let text = report.to_string();
    for part in [
        "episode 1, a clean mug: 3 of 4 turns differ; the open loop ends at turn 3",
        "turn 4 (after the end): \"take it\"",
        "episode 2, the same: 1 of 1 turn differ; no action differs",
        "The open loop ends in 1 of 2 episodes, at turn 3.0 on average.",
    ] {
        assert!(text.contains(part), "{part:?} is missing in\n{text}");
    }
}

#[test]
fn nobody_gives_zeros_and_no_numbers_that_are_none() {
    let report = report(&[]);
    let variant = &report.variants[0];
    assert_eq!(variant.over_all_turns, Figures::default());
    assert_eq!(variant.episodes, EpisodeFigures::default());
    assert!(!report.to_string().contains("NaN"));
}

#[test]
fn the_table_quotes_what_needs_it_and_has_every_turn() {
    let table = table(&[Variant::threshold(0.25)], &[two_episodes()]);
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines.len(), 6);
    assert_eq!(
        lines[3],
        "tau=0.25,local,\"ada, the \"\"first\"\"\",paper,1,3,5,rinse it,not_sure,,understood,\
         PICKUP Mug; TOGGLE Faucet,became_understood,1"
    );
    assert!(lines[4].ends_with("became_not_sure,0"), "{}", lines[4]);
}

#[test]
fn every_pair_of_outcomes_has_its_change() {
    let (one, two) = (understood("GOTO Mug"), understood("OPEN Mug"));
    let (forbidden, unsure) = (impossible("OPEN Mug"), Outcome::NotSure);
    let name = |recorded: &Outcome, other: &Outcome| Change::of(recorded, other).name();
    assert_eq!(name(&one, &one), "same");
    assert_eq!(name(&one, &two), "another_program");
    assert_eq!(name(&forbidden, &impossible("GOTO Mug")), "another_program");
    assert_eq!(name(&forbidden, &two), "became_understood");
    assert_eq!(name(&unsure, &one), "became_understood");
    assert_eq!(name(&one, &unsure), "became_not_sure");
    assert_eq!(name(&forbidden, &unsure), "became_not_sure");
    assert_eq!(name(&unsure, &forbidden), "became_impossible");
    assert_eq!(name(&one, &forbidden), "became_impossible");
}
