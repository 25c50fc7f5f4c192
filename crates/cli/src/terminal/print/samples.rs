//! Answers for the tests of this folder.

use apprentice::client::ActionView;
use apprentice::language::{
    Accounted, Answer, Discarded, Evidence, LiftedUtterance, Near, Outcome, Use,
};

pub fn done(number: u32, sentence: &str) -> ActionView {
    ActionView { number, step: "GOTO Mug".into(), sentence: sentence.into() }
}

pub fn evidence() -> Evidence {
    Evidence {
        lifted: vec![LiftedUtterance::parse("wash the <obj>")],
        nearest: vec![Near {
            exemplar: LiftedUtterance::parse("pick up the <obj>"),
            program: "PICKUP <obj:1>".parse().unwrap(),
            distance: 0.914,
            number: 3,
        }],
        threshold: 0.42,
        discarded: vec![Discarded {
            program: "PICKUP Mug".parse().unwrap(),
            reason: "the hand is full.".into(),
        }],
        reranked: 2,
        ..Evidence::default()
    }
}

pub fn answered(outcome: Outcome) -> Answer {
    Answer { outcome, evidence: evidence(), mentioned: None, chosen: Vec::new() }
}

pub fn accounting(words: &[(&str, Use)]) -> Vec<Accounted> {
    let accounted = |&(word, used): &(&str, Use)| Accounted { word: word.to_owned(), used };
    words.iter().map(accounted).collect()
}
