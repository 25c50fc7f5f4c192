use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

/// Words of a language by what they do in a clause, whatever they mean. They are data of a recipe,
/// so another language is another file.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WordLists {
    /// Carry no meaning of their own.
    pub silent: BTreeSet<String>,
    /// Articles and the like: "the", "a", "my".
    pub determiners: BTreeSet<String>,
    /// Short words of place and direction: "up", "off", "in".
    pub particles: BTreeSet<String>,
    /// Particles that make another verb of a verb: "turn on", "pick up".
    pub verb_particles: BTreeSet<String>,
    /// Words of manner and order: "then", "carefully".
    pub adverbs: BTreeSet<String>,
    /// May stand between two clauses.
    pub joints: BTreeSet<String>,
    /// Where an utterance is cut, if a verb follows. Marks cut as well.
    pub cuts: BTreeSet<String>,
    /// Function words. None of them is a verb.
    pub stop: BTreeSet<String>,
    /// Words for a part of a thing, which then stands for the thing: "a slice of the apple", "apple
    /// slices".
    pub portions: BTreeSet<String>,
    /// Words that are nouns too. They are verbs only where an object follows.
    pub noun_verbs: BTreeSet<String>,
    /// Before a mention: something goes there.
    pub toward: BTreeSet<String>,
    /// Before a mention: something is in it, or is put into it.
    pub inside: BTreeSet<String>,
    /// Begin a phrase that describes a state and asks for nothing: "while holding the card".
    pub standing: BTreeSet<String>,
    /// Verbs of moving that need no goal: "turn around".
    pub moving: BTreeSet<String>,
    /// Verbs in their base form.
    pub verbs: BTreeSet<String>,
    /// Before a verb: what follows is what the rest is for ("to chill").
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub purposes: BTreeSet<String>,
    /// Words for how long, how often or until when. No single step takes a time.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub lasting: BTreeSet<String>,
    /// Before a mention: where a way ends ("take the mug TO the sink").
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub destination: BTreeSet<String>,
    /// Before a mention: where a way begins ("FROM the table").
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub leaving: BTreeSet<String>,
    /// What follows says where a place is, not which: "where the lamp is".
    #[serde(default = "release_0_1::wherever", skip_serializing_if = "release_0_1::is_wherever")]
    pub wherever: BTreeSet<String>,
    /// Before a mention: something is put on it.
    #[serde(default = "release_0_1::onto", skip_serializing_if = "release_0_1::is_onto")]
    pub onto: BTreeSet<String>,
    /// Particles that may stand between a verb and its object.
    #[serde(default = "release_0_1::passed", skip_serializing_if = "release_0_1::is_passed")]
    pub passed: BTreeSet<String>,
    /// Words that make the mention after them a landmark: "next to". Determiners are not counted.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub landmarks: BTreeSet<String>,
    /// After a word of `noun_verbs`: it is a verb there ("clean up").
    #[serde(
        default = "release_0_1::carrying_on",
        skip_serializing_if = "release_0_1::is_carrying_on"
    )]
    pub carrying_on: BTreeSet<String>,
    /// The verbs that a misspelt first word may be.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub common_verbs: BTreeSet<String>,
}

/// Lists that release 0.1 had in its code. A recipe that was recorded by it has none of them, and
/// must keep its meaning and its digest.
mod release_0_1 {
    use std::collections::BTreeSet;

    macro_rules! list {
        ($name:ident, $is:ident, $words:expr) => {
            pub(super) fn $name() -> BTreeSet<String> {
                $words.map(str::to_owned).into()
            }
            pub(super) fn $is(list: &BTreeSet<String>) -> bool {
                *list == $name()
            }
        };
    }
    list!(wherever, is_wherever, ["where"]);
    list!(onto, is_onto, ["on", "onto", "to"]);
    list!(passed, is_passed, ["up", "down", "back", "away", "both"]);
    list!(carrying_on, is_carrying_on, ["up", "back", "down", "off"]);
}

impl WordLists {
    /// The base form of a word that ends in -ing, where that form is a known verb (closing: close;
    /// picking: pick; putting: put); else the word itself.
    pub fn base(&self, word: &str) -> String {
        let stem = word.strip_suffix("ing").filter(|_| !self.verbs.contains(word));
        let Some(stem) = stem else { return word.to_owned() };
        let doubled = stem.char_indices().last().map_or("", |(end, _)| &stem[..end]);
        let forms = [stem.to_owned(), format!("{stem}e"), doubled.to_owned()];
        let known = |form: &&String| self.verbs.contains(*form) || self.noun_verbs.contains(*form);
        forms.iter().find(known).cloned().unwrap_or_else(|| word.to_owned())
    }

    /// Whether a word names a part of a thing, in the singular or plural.
    pub fn is_portion(&self, word: &str) -> bool {
        let singular = word.strip_suffix('s').unwrap_or(word);
        self.portions.contains(word) || self.portions.contains(singular)
    }
}
