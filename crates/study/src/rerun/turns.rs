//! Every turn as a table, for those who count otherwise.

use apprentice::language::Outcome;
use serde::Serialize;

use super::configuration::Variant;
use super::report::Change;
use super::walk::Life;
use crate::cells::{bit, text, written};
use crate::measures::Heard;

#[derive(Default, Serialize)]
struct TurnRow<'a> {
    #[serde(serialize_with = "text::serialize")]
    with: &'a str,
    #[serde(serialize_with = "text::serialize")]
    tenant: &'a str,
    #[serde(serialize_with = "text::serialize")]
    user: &'a str,
    #[serde(serialize_with = "text::serialize")]
    recorded_recipe: &'a str,
    episode: u32,
    turn: usize,
    seq: u64,
    #[serde(serialize_with = "text::serialize")]
    utterance: &'a str,
    recorded_outcome: Heard,
    #[serde(serialize_with = "text::serialize")]
    recorded_program: String,
    other_outcome: Heard,
    #[serde(serialize_with = "text::serialize")]
    other_program: String,
    change: &'static str,
    #[serde(with = "bit")]
    before_the_loop_ended: bool,
}

/// A line for each variant and turn, the same answers too; by variant, person, episode and turn.
pub fn table(variants: &[Variant], lives: &[Life]) -> String {
    let mut rows = Vec::new();
    for (number, variant) in variants.iter().enumerate() {
        for life in lives {
            for episode in &life.episodes {
                for (place, turn) in episode.turns.iter().enumerate() {
                    let other = &turn.others[number];
                    rows.push(TurnRow {
                        with: &variant.name,
                        tenant: life.tenant.as_str(),
                        user: life.user.as_str(),
                        recorded_recipe: &life.recipe,
                        episode: episode.number,
                        turn: place + 1,
                        seq: turn.seq.get(),
                        utterance: &turn.utterance,
                        recorded_outcome: Heard::from(&turn.recorded),
                        recorded_program: program(&turn.recorded),
                        other_outcome: Heard::from(other),
                        other_program: program(other),
                        change: Change::of(&turn.recorded, other).name(),
                        before_the_loop_ended: episode.is_closed(number, place),
                    });
                }
            }
        }
    }
    written(&rows)
}

fn program(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Understood { program, .. } | Outcome::Impossible { program, .. } => {
            program.to_string()
        }
        Outcome::NotSure | Outcome::Asked { .. } | Outcome::Told { .. } => String::new(),
    }
}
