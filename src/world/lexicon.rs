use std::collections::BTreeMap;
use std::sync::Arc;

use crate::language::{Exemplar, Habits, LiftedUtterance, Roles, Symbol};

/// What things are called. Shared by a domain's users; people teach requests, not names.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Lexicon {
    /// From a lower-case name in the singular (`coffee mug`, `bar of soap`) to what it may mean,
    /// likeliest first.
    pub names: BTreeMap<String, Vec<Meaning>>,
    /// From an irregular plural of a name's last word to its singular: `knives` → `knife`.
    pub plurals: BTreeMap<String, String>,
    /// Words that stand for something named before: `it`, `them`.
    pub pronouns: Vec<String>,
    /// Words before a name that say how it looks or which one it is, and may be swallowed in
    /// lifting: `red`, `small`, `left`. No state words (`clean`, `cold`, `sliced`), no numbers.
    pub adjectives: Vec<String>,
    /// Types whose word is worth keeping beside their slot, with that word: `SinkBasin` → `sink`.
    pub fixtures: BTreeMap<Symbol, String>,
    /// How recorded people used words for the domain's operators; none where nobody was recorded.
    pub habits: Option<Arc<Habits>>,
    /// Which operators go, take, put and open.
    pub roles: Roles,
}

impl Lexicon {
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
    pub sort: Symbol,
    pub kind: Symbol,
    /// How often recorded people used the name for this type; for breaking ties.
    pub count: u32,
}

/// What every user starts with, and what the threshold is calibrated on.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SeedSet {
    /// The exemplars: 44 in the household (paper, Table 1).
    pub exemplars: Vec<Exemplar>,
    /// Variants that no exemplar has, for calibration: an utterance and its right program.
    pub variants: Vec<Exemplar>,
    /// Utterances with verbs that no seed has, for calibration: nothing known is right for them.
    pub unknown: Vec<LiftedUtterance>,
}
