use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::language::{Grammar, Habits, Roles, Symbol, Verb, Word, WordLists};
use crate::numerics::normalise;
use crate::parser::WordTable;

/// A word's weight is a / (a + frequency) (smooth inverse frequency).
const SIF: f32 = 1e-3;
const PARTICLE_WEIGHT: f32 = 0.25;
const FIXTURE_WEIGHT: f32 = 0.4;
const OBJECT_WEIGHT: f32 = 0.15;
/// The word whose vector is used for a slot without a fixture.
const OBJECT: &str = "object";
/// A word is new when it stands in a smaller share of simple clauses than this.
const RARE: f64 = 0.01;

/// What is known about words before anybody has taught anything.
#[derive(Debug, Clone, Copy)]
pub struct Background<'a> {
    /// The recipe's lists.
    pub lists: &'a WordLists,
    /// The lexicon's.
    pub adjectives: &'a [String],
    /// The lexicon's fixtures and their words.
    pub fixtures: &'a BTreeMap<Symbol, String>,
    /// Of the world's operators.
    pub roles: &'a Roles,
    /// None in a world without recordings.
    pub habits: Option<&'a Arc<Habits>>,
}

/// A [`Background`] that a parser keeps, and the word table.
#[derive(Debug, Clone)]
pub(super) struct Knowledge {
    pub words: &'static WordTable,
    pub lists: WordLists,
    pub adjectives: Vec<String>,
    pub fixtures: BTreeMap<Symbol, String>,
    pub habits: Arc<Habits>,
}

/// A word or slot that carries meaning.
#[derive(Debug, Clone)]
pub(super) struct Item {
    pub word: String,
    pub plain: bool,
    pub weight: f32,
    /// Weight by rarity among simple requests.
    pub rare: f32,
    /// Of length 1.
    pub vector: Vec<f32>,
}

/// What the judges use of an utterance: its lifted words, and nothing of the scene.
#[derive(Debug, Clone)]
pub(super) struct Sentence {
    pub items: Vec<Item>,
    /// Places of the items that simple requests hardly use.
    pub new: Vec<usize>,
    /// The weighted sum of the items, of length 1.
    pub whole: Vec<f32>,
    pub rare_whole: Vec<f32>,
    pub fixtures: BTreeSet<String>,
    /// Words and slots.
    pub length: usize,
}

impl Knowledge {
    pub(super) fn new(words: &'static WordTable, background: Background<'_>) -> Knowledge {
        Knowledge {
            words,
            lists: background.lists.clone(),
            adjectives: background.adjectives.to_vec(),
            fixtures: background.fixtures.clone(),
            habits: background.habits.cloned().unwrap_or_default(),
        }
    }

    pub(super) fn grammar(&self) -> Grammar<'_> {
        Grammar { lists: &self.lists, adjectives: &self.adjectives }
    }

    /// Of length 1.
    pub(super) fn vector(&self, word: &str) -> Vec<f32> {
        let mut vector = self.words.vector(word);
        normalise(&mut vector);
        vector
    }

    pub(super) fn weight(&self, word: &str) -> f32 {
        SIF / (SIF + self.words.frequency(word))
    }

    pub(super) fn sentence(&self, words: &[Word]) -> Sentence {
        let items: Vec<Item> = words.iter().filter_map(|word| self.item(word)).collect();
        let is_new = |item: &Item| {
            item.plain
                && item.word.chars().all(char::is_alphabetic)
                && !self.lists.stop.contains(&item.word)
                && self.habits.rate(&item.word) < RARE
        };
        let new = (0..items.len()).filter(|&place| is_new(&items[place])).collect();
        let whole = self.sum(&items, |item| item.weight);
        let rare_whole = self.sum(&items, |item| item.rare);
        let fixture = |word: &Word| match word {
            Word::Slot { fixture, .. } => fixture.clone(),
            Word::Text(_) => None,
        };
        let fixtures = words.iter().filter_map(fixture).collect();
        Sentence { items, new, whole, rare_whole, fixtures, length: words.len() }
    }

    fn item(&self, word: &Word) -> Option<Item> {
        let (word, plain, weight) = match word {
            Word::Text(text) if self.lists.silent.contains(text) => return None,
            Word::Text(text) if self.lists.particles.contains(text) => {
                (text.as_str(), true, PARTICLE_WEIGHT)
            }
            Word::Text(text) => (text.as_str(), true, self.weight(text)),
            Word::Slot { fixture: Some(fixture), .. } => (fixture.as_str(), false, FIXTURE_WEIGHT),
            Word::Slot { .. } => (OBJECT, false, OBJECT_WEIGHT),
        };
        let rare = match plain {
            true => {
                let rarity = RARE / (RARE + self.habits.rate(word));
                rarity as f32 * (0.2 + self.weight(word)).min(1.0)
            }
            false => weight,
        };
        Some(Item { word: word.to_owned(), plain, weight, rare, vector: self.vector(word) })
    }

    fn sum(&self, items: &[Item], weight: impl Fn(&Item) -> f32) -> Vec<f32> {
        let mut sum = vec![0.0; self.words.dims()];
        for item in items {
            let weight = weight(item);
            sum.iter_mut().zip(&item.vector).for_each(|(sum, x)| *sum += weight * x);
        }
        normalise(&mut sum);
        sum
    }

    /// The features that [`Habits`] count, each once.
    pub(super) fn habit_words(&self, words: &[Word], verb: Option<&Verb>) -> BTreeSet<String> {
        let lists = &self.lists;
        let base = verb.map_or("", |verb| verb.word.as_str());
        let named = words.iter().filter(|word| matches!(word, Word::Slot { .. })).count();
        let mut found = BTreeSet::from([format!("V:{base}"), format!("n:{}", named.min(3))]);
        if let Some(verb) = verb.filter(|verb| !verb.particle.is_empty()) {
            found.insert(format!("V:{base}_{}", verb.particle));
        }
        // "take it TO", "take it FROM": the first function word after a mention distinguishes uses
        // of a verb.
        let mut behind_mention = false;
        for (place, word) in words.iter().enumerate() {
            match word {
                Word::Slot { .. } => behind_mention = true,
                Word::Text(_) if verb.is_some_and(|verb| verb.at == place) => {}
                Word::Text(text) if lists.determiners.contains(text) => {}
                Word::Text(text) => {
                    if behind_mention && lists.stop.contains(text) {
                        found.insert(format!("V:{base}+{text}"));
                    }
                    behind_mention = false;
                    found.insert(text.clone());
                }
            }
        }
        found
    }
}
