use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock, OnceLock};

use serde::Deserialize;

use super::facts::{embedded, facts};
use crate::language::{Exemplar, Habits, LiftedUtterance, Roles, Symbol};
use crate::world::{Edition, Lexicon, Meaning, SeedSet};

/// The sort of every argument: a household has one.
pub(super) const SORT: &str = "obj";

#[derive(Deserialize)]
struct Words {
    pronouns: Vec<String>,
    adjectives: Vec<String>,
    plurals: BTreeMap<String, String>,
    fixtures: BTreeMap<String, String>,
}

/// What the second edition adds.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Further {
    plurals: BTreeMap<String, String>,
}

#[derive(Deserialize)]
struct Counts {
    order: Vec<String>,
    clauses: Vec<u32>,
    words: BTreeMap<String, Vec<u32>>,
}

#[derive(Deserialize)]
struct Seeds {
    exemplars: Vec<(String, String)>,
    variants: Vec<(String, String)>,
    unknown: Vec<String>,
}

/// From a name to how often it was said of each type.
type NameTable = BTreeMap<String, BTreeMap<String, u32>>;

/// What things are called, from `names.toml` and `words.toml`; in the second edition as changed by
/// `names-2.toml` and `words-2.toml`.
pub(super) fn lexicon(edition: Edition) -> Lexicon {
    let mut names: NameTable = embedded("names.toml", include_str!("../data/names.toml"));
    let mut words: Words = embedded("words.toml", include_str!("../data/words.toml"));
    if edition == Edition::Second {
        let changed: NameTable = embedded("names-2.toml", include_str!("../data/names-2.toml"));
        let further: Further = embedded("words-2.toml", include_str!("../data/words-2.toml"));
        names.extend(changed);
        names.retain(|_, meant| !meant.is_empty());
        words.plurals.extend(further.plurals);
    }
    let known = |name: &str| facts().kind(name).expect("tables name only kinds of types.toml");
    let meanings = |meant: BTreeMap<String, u32>| {
        let meaning = |(kind, count): (String, u32)| Meaning {
            sort: Symbol::new(SORT),
            kind: known(&kind).symbol().clone(),
            count,
        };
        let mut all: Vec<Meaning> = meant.into_iter().map(meaning).collect();
        all.sort_by(|a, b| b.count.cmp(&a.count).then_with(|| a.kind.cmp(&b.kind)));
        all
    };
    Lexicon {
        names: names.into_iter().map(|(name, meant)| (name, meanings(meant))).collect(),
        plurals: words.plurals,
        pronouns: words.pronouns,
        adjectives: words.adjectives,
        fixtures: words
            .fixtures
            .into_iter()
            .map(|(kind, word)| (known(&kind).symbol().clone(), word))
            .collect(),
        habits: Some(Arc::clone(&HABITS)),
        roles: Roles {
            going: Some(Symbol::new("GOTO")),
            taking: Some(Symbol::new("PICKUP")),
            putting: Some(Symbol::new("PUT")),
            doors: vec![Symbol::new("OPEN"), Symbol::new("CLOSE")],
        },
        summary: OnceLock::new(),
    }
}

/// All editions have the same habits.
static HABITS: LazyLock<Arc<Habits>> = LazyLock::new(|| Arc::new(habits()));

/// How recorded people used words for the primitives, from `habits.toml`.
fn habits() -> Habits {
    let Counts { order, clauses, words } =
        embedded("habits.toml", include_str!("../data/habits.toml"));
    let whole = words.values().chain([&clauses]).all(|row| row.len() == order.len());
    assert!(whole, "habits.toml counts each word for each primitive");
    Habits { order: order.iter().map(|name| Symbol::new(name)).collect(), clauses, words }
}

/// What every user starts with, from `seeds.toml`.
pub(super) fn seeds() -> SeedSet {
    let seeds: Seeds = embedded("seeds.toml", include_str!("../data/seeds.toml"));
    let exemplar = |(utterance, program): (String, String)| Exemplar {
        utterance: LiftedUtterance::parse(&utterance),
        program: program.parse().expect("seeds.toml writes lifted programs"),
    };
    SeedSet {
        exemplars: seeds.exemplars.into_iter().map(exemplar).collect(),
        variants: seeds.variants.into_iter().map(exemplar).collect(),
        unknown: seeds.unknown.iter().map(|text| LiftedUtterance::parse(text)).collect(),
    }
}

/// The word of `known` with the fewest edits from `word`, whatever the case; the first of equals.
pub(super) fn nearest_word<'a>(
    word: &str,
    known: impl Iterator<Item = &'a str>,
) -> Option<&'a str> {
    // A request may have kilobytes in the place of a name; the start is enough for a suggestion.
    let word: String = word.chars().take(40).collect::<String>().to_lowercase();
    known.min_by_key(|candidate| edits(&word, &candidate.to_lowercase()))
}

/// Insertions, deletions and replacements from one word to the other.
fn edits(from: &str, to: &str) -> usize {
    let to: Vec<char> = to.chars().collect();
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (i, a) in from.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, b) in to.iter().enumerate() {
            let replaced = diagonal + usize::from(a != *b);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[to.len()]
}

/// `a mug`, `an apple`.
pub(super) fn a(noun: &str) -> String {
    let article = match noun.chars().next() {
        Some('a' | 'e' | 'i' | 'o' | 'u' | 'A' | 'E' | 'I' | 'O' | 'U') => "an",
        _ => "a",
    };
    format!("{article} {noun}")
}
