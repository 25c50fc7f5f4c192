//! Our own sentences for the primitives: the seeds with things in their slots. Asked where a
//! corpus has no sentences for single steps.

use std::collections::BTreeMap;

use apprentice::language::{Exemplar, Symbol, Utterance, Word};
use apprentice::numerics::Rng;
use apprentice::world::household::{Household, Kind, Room};
use apprentice::world::{Edition, Words};

use super::corpus::Row;
use super::draw;
use super::renaming::plain_names;
use super::scenes::{Clashes, Stages};

/// Draws tried for one seed before it is left out: most pairs of things do not go together.
const TRIES: usize = 2_000;

/// Each seed once, about things for which it can be done, drawn by seed.
pub fn rows(household: &Household, stages: &Stages<'_>, seed: u64) -> Vec<Row> {
    let names = plain_names(household.lexicon(Edition::First));
    let exemplars = household.seeds().exemplars.iter().enumerate();
    let rows = exemplars.filter_map(|(number, exemplar)| {
        let id = format!("seed/{number}");
        let mut rng = draw::rng(seed, &["seed sentence", &id]);
        let mut tries = (0..TRIES).filter_map(|_| fill(&names, exemplar, &id, &mut rng));
        tries.find_map(|row| said_of_the_right_state(household, stages, row, seed))
    });
    rows.collect()
}

/// The row, with what "turn off" is said of on; `None` when it cannot be done in any scene.
fn said_of_the_right_state(
    household: &Household,
    stages: &Stages<'_>,
    row: Row,
    seed: u64,
) -> Option<Row> {
    let set = |row: &Row| {
        stages.set(row, Clashes::Avoided, &mut draw::rng(seed, &["scene", &row.id])).ok()
    };
    let contradicts = |row: &Row| {
        let words = row.sentence.tokens();
        set(row).map(|scene| household.contradiction(&scene, &words, &row.program).is_some())
    };
    if !contradicts(&row)? {
        return Some(row);
    }
    let row = Row { on: true, ..row };
    (contradicts(&row) == Some(false)).then_some(row)
}

/// The seed about things of a room that were drawn, whether or not they go together; `None` when
/// one thing was drawn twice.
fn fill(
    names: &BTreeMap<Symbol, &str>,
    exemplar: &Exemplar,
    id: &str,
    rng: &mut Rng,
) -> Option<Row> {
    let room = Room::ALL[rng.below(Room::ALL.len())];
    let kinds: Vec<&Symbol> =
        room.kinds().map(Kind::symbol).filter(|kind| names.contains_key(*kind)).collect();
    let mut draw = || kinds[rng.below(kinds.len())].clone();
    let meant: Vec<Symbol> = (0..exemplar.utterance.slots()).map(|_| draw()).collect();
    let held = draw();
    if (1..meant.len()).any(|place| meant[..place].contains(&meant[place])) {
        return None;
    }
    let mut fillers = meant.iter();
    let words = exemplar.utterance.words.iter().map(|word| match word {
        Word::Text(text) => text.as_str(),
        Word::Slot { .. } => names[fillers.next().expect("one was drawn for each slot")],
    });
    let text: Vec<&str> = words.collect();
    let program = exemplar.program.fill(&meant, Some(&held))?;
    Some(Row {
        id: id.to_owned(),
        sentence: Utterance::new(&text.join(" ")).ok()?,
        label: program.steps.last()?.operator.to_string(),
        program,
        room,
        user: String::new(),
        egocentric: false,
        on: false,
        hand: None,
        next: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score;

    #[test]
    fn every_seed_gets_a_sentence_that_can_be_done() {
        let household = Household::new();
        let stages = Stages::new(&household);
        let rows = rows(&household, &stages, 1);
        let said: Vec<String> =
            rows.iter().map(|row| format!("{} = {}", row.sentence, row.program)).collect();
        assert!(rows.len() >= household.seeds().exemplars.len() - 4, "{said:#?}");
        assert!(rows.iter().all(|row| score::core(&row.program).is_some()), "{said:#?}");
    }
}
