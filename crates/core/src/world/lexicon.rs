use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use crate::language::{Exemplar, Habits, LiftedUtterance, Roles, Symbol};

/// What things are called. All users of a world share it: people teach requests, not names.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Lexicon {
    /// From a lower-case name in the singular (`coffee mug`, `bar of soap`) to what it may mean,
    /// likeliest first.
    pub names: BTreeMap<String, Vec<Meaning>>,
    /// From an irregular plural of a name's last word to its singular: `knives` → `knife`.
    pub plurals: BTreeMap<String, String>,
    /// Words that stand for something named before: `it`, `them`.
    pub pronouns: Vec<String>,
    /// Words before a name that say how the thing looks or which one it is; lifting may drop them:
    /// `red`, `small`, `left`. No state words (`clean`, `cold`, `sliced`), no numbers.
    pub adjectives: Vec<String>,
    /// Types whose word is kept in their slot, where the recipe wants it: `SinkBasin` → `sink`.
    pub fixtures: BTreeMap<Symbol, String>,
    /// How recorded people used words for the operators; none in a world without recordings.
    pub habits: Option<Arc<Habits>>,
    /// Which operators go, take, put and open.
    pub roles: Roles,
    /// Computed from `names` by [`Lexicon::summary`].
    pub summary: OnceLock<NameSummary>,
}

/// What the names of a lexicon are like, taken together.
#[derive(Debug, Clone, PartialEq)]
pub struct NameSummary {
    /// Words of the longest name.
    pub longest: usize,
    /// The sort that most names have: what a pronoun is taken for.
    pub sort: Symbol,
}

impl Lexicon {
    /// What the names are like; computed at the first call.
    pub fn summary(&self) -> &NameSummary {
        self.summary.get_or_init(|| {
            let longest = self.names.keys().map(|name| name.split(' ').count()).max().unwrap_or(0);
            let mut sorts: Vec<(&Symbol, usize)> = Vec::new();
            for meaning in self.names.values().filter_map(|meanings| meanings.first()) {
                match sorts.iter_mut().find(|(sort, _)| *sort == &meaning.sort) {
                    Some((_, count)) => *count += 1,
                    None => sorts.push((&meaning.sort, 1)),
                }
            }
            // Ties go to the sort whose first name comes first in the alphabet.
            let most = sorts.iter().rev().max_by_key(|(_, count)| *count);
            let sort = most.map_or_else(|| Symbol::new("obj"), |(sort, _)| (*sort).clone());
            NameSummary { longest, sort }
        })
    }

    /// Whether fewer than one in fifteen uses of the name mean this kind ("bowl" for a cup).
    pub fn rarely_means(&self, surface: &str, kind: &Symbol) -> bool {
        let meanings = self.names.get(surface).or_else(|| {
            let (words, last) = surface.rsplit_once(' ').unwrap_or(("", surface));
            let singular = match self.plurals.get(last) {
                Some(singular) => singular.as_str(),
                None => last.strip_suffix('s')?,
            };
            self.names.get(format!("{words} {singular}").trim_start())
        });
        let Some(meanings) = meanings else { return false };
        let all: u32 = meanings.iter().map(|meaning| meaning.count).sum();
        let this = meanings.iter().find(|meaning| meaning.kind == *kind);
        this.is_some_and(|meaning| meaning.count * 15 < all)
    }
}

/// One thing that a name may mean.
#[derive(Debug, Clone, PartialEq)]
pub struct Meaning {
    /// The sort of the type.
    pub sort: Symbol,
    /// The type.
    pub kind: Symbol,
    /// How often recorded people used the name for this type; for breaking ties.
    pub count: u32,
}

/// What every user starts with, and what the threshold is calibrated on.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SeedSet {
    /// The exemplars: 44 in the household (paper, Table 1).
    pub exemplars: Vec<Exemplar>,
    /// For calibration: utterances that are no exemplars, each with its right program.
    pub variants: Vec<Exemplar>,
    /// For calibration: utterances with verbs that no seed has, so that no exemplar is right.
    pub unknown: Vec<LiftedUtterance>,
}
