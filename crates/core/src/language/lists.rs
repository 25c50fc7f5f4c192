use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

/// Words of a language that are known by what they do in a clause, not by what they mean. Data of
/// a recipe, so another language is another file.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WordLists {
    /// Carry no meaning of their own.
    pub silent: BTreeSet<String>,
    pub determiners: BTreeSet<String>,
    pub particles: BTreeSet<String>,
    /// Particles that make another verb of a verb: "turn on", "pick up".
    pub verb_particles: BTreeSet<String>,
    pub adverbs: BTreeSet<String>,
    /// May stand between two clauses.
    pub joints: BTreeSet<String>,
    /// Where an utterance is cut, if a verb follows. Marks cut as well.
    pub cuts: BTreeSet<String>,
    pub stop: BTreeSet<String>,
    /// A part of a thing is the thing: "a slice of the apple", "apple slices".
    pub portions: BTreeSet<String>,
    /// Nouns as well: verbs only where an object follows.
    pub noun_verbs: BTreeSet<String>,
    /// Before a mention: it is where something goes.
    pub toward: BTreeSet<String>,
    pub inside: BTreeSet<String>,
    /// Open a phrase that says how things stand, not what to do: "while holding the card".
    pub standing: BTreeSet<String>,
    /// Verbs of moving that need no goal: "turn around".
    pub moving: BTreeSet<String>,
    pub verbs: BTreeSet<String>,
    /// Before a verb: what follows is what the rest is for ("to chill").
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub purposes: BTreeSet<String>,
    /// How long, how often, until when: no single step takes a time.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub lasting: BTreeSet<String>,
    /// Before a mention: where a way ends ("take the mug TO the sink"), and where it begins.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub destination: BTreeSet<String>,
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub leaving: BTreeSet<String>,
    /// What follows says where a place is, not which: "where the lamp is".
    #[serde(default = "release_0_1::wherever", skip_serializing_if = "release_0_1::is_wherever")]
    pub wherever: BTreeSet<String>,
    /// Before a place that something is put on, and particles that may stand between a verb and its
    /// object.
    #[serde(default = "release_0_1::onto", skip_serializing_if = "release_0_1::is_onto")]
    pub onto: BTreeSet<String>,
    #[serde(default = "release_0_1::passed", skip_serializing_if = "release_0_1::is_passed")]
    pub passed: BTreeSet<String>,
    /// Words, determiners aside, that make the mention behind them a landmark: "next to".
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub landmarks: BTreeSet<String>,
    /// After a noun that is a verb too: it is a verb ("clean up").
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
            pub fn $name() -> BTreeSet<String> {
                $words.map(str::to_owned).into()
            }
            pub fn $is(list: &BTreeSet<String>) -> bool {
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
    /// closing: close; picking: pick; putting: put.
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
