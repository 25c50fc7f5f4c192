//! Every turn as a table, for those who count otherwise.

use std::fmt::Write;

use apprentice::language::Outcome;

use super::configuration::Variant;
use super::report::Change;
use super::walk::Life;
use crate::cells;

const HEADER: &str = "with,tenant,user,recorded_recipe,episode,turn,seq,utterance,recorded_outcome,\
                      recorded_program,other_outcome,other_program,change,before_the_loop_ended\n";

/// RFC 4180 with line feeds, one line for each variant and turn, the same answers too; by variant,
/// person, episode and turn.
pub fn table(variants: &[Variant], lives: &[Life]) -> String {
    let mut out = HEADER.to_owned();
    for (number, variant) in variants.iter().enumerate() {
        for life in lives {
            for episode in &life.episodes {
                for (place, turn) in episode.turns.iter().enumerate() {
                    let other = &turn.others[number];
                    let (was, would) = (cells(&turn.recorded), cells(other));
                    let change = Change::of(&turn.recorded, other).name();
                    let closed = u8::from(episode.is_closed(number, place));
                    let fields = [
                        cells::written(&variant.name),
                        cells::written(life.tenant.as_str()),
                        cells::written(life.user.as_str()),
                        cells::written(&life.recipe),
                        episode.number.to_string(),
                        (place + 1).to_string(),
                        turn.seq.to_string(),
                        cells::written(&turn.utterance),
                        was.0.to_owned(),
                        cells::written(&was.1),
                        would.0.to_owned(),
                        cells::written(&would.1),
                        change.to_owned(),
                        closed.to_string(),
                    ];
                    writeln!(out, "{}", fields.join(",")).expect("writing to a string succeeds");
                }
            }
        }
    }
    out
}

/// An outcome's name, and its program where it has one.
fn cells(outcome: &Outcome) -> (&'static str, String) {
    match outcome {
        Outcome::Understood { program, .. } => ("understood", program.to_string()),
        Outcome::Impossible { program, .. } => ("impossible", program.to_string()),
        Outcome::NotSure => ("not_sure", String::new()),
    }
}
