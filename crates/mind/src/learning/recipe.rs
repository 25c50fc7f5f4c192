use std::sync::{LazyLock, OnceLock};

use serde::{Deserialize, Serialize};

use crate::dialogue::Dialogue;
use crate::grounding::{Abstraction, Execution, RerankerSettings, Split};
use crate::ids::Digest;
use crate::language::Document;
use crate::numerics::NumericsVersion;
use crate::parser::{
    ExemplarSettings, FeaturesSettings, GrammarSettings, Seq2SeqSettings, TrainFault, WordTable,
};
use crate::world::Edition;

/// Everything that decides what a mind becomes, except the lessons: settings, with a digest.
#[derive(Debug, Clone)]
pub struct Recipe {
    name: String,
    settings: RecipeSettings,
    words: &'static WordTable,
    digest: Digest,
}

/// The sections of a recipe file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecipeSettings {
    /// Word vectors, and names of things.
    pub words: WordSettings,
    /// How utterances are lifted.
    pub abstraction: Abstraction,
    /// How lessons become exemplars.
    pub lifting: Lifting,
    /// How programs are run.
    pub execution: Execution,
    /// Which parser, and its settings.
    pub parser: ParserSettings,
    /// How the reranker is trained.
    pub reranker: RerankerSettings,
    /// What there is of a conversation beside requests; none in the recipes before `default-3`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dialogue: Option<Dialogue>,
}

/// Which words a mind knows: their vectors, and what things are called.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WordSettings {
    /// The name of a built-in table.
    pub table: String,
    /// Which edition of the world's names and words.
    #[serde(default, skip_serializing_if = "Edition::is_first")]
    pub edition: Edition,
}

/// How lessons become exemplars.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lifting {
    /// Whether a thing in the hand that was not mentioned becomes `<held>` in the lifted program.
    /// If not, it stays the type that it was, as in the paper.
    pub held: bool,
}

/// Which parser, and its settings in the section of the same name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParserSettings {
    /// Which one.
    pub kind: ParserKind,
    /// For [`ParserKind::Exemplar`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exemplar: Option<ExemplarSettings>,
    /// For [`ParserKind::Features`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub features: Option<FeaturesSettings>,
    /// For [`ParserKind::Grammar`] and [`ParserKind::Backed`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grammar: Option<GrammarSettings>,
    /// For [`ParserKind::Seq2seq`] and [`ParserKind::Backed`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seq2seq: Option<Seq2SeqSettings>,
}

/// The kinds of parsers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ParserKind {
    /// The paper's: an embedding network and the nearest exemplars.
    Exemplar,
    /// Judges with features and weights learned once. Only thresholds are trained per person.
    Features,
    /// A hand-written grammar: exact where it answers. It learns nothing.
    Grammar,
    /// A sequence-to-sequence model with attention and copying, trained on seeds and lessons.
    Seq2seq,
    /// The paper's baseline: the grammar first, else the sequence-to-sequence model.
    #[serde(rename = "seq2seq-grammar")]
    Backed,
}

/// A recipe file. Its name is not a setting and not part of the digest.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RecipeFile {
    name: String,
    words: WordSettings,
    abstraction: Abstraction,
    lifting: Lifting,
    execution: Execution,
    parser: ParserSettings,
    reranker: RerankerSettings,
    #[serde(default)]
    dialogue: Option<Dialogue>,
}

/// Where a recipe file is wrong: a sentence with what was expected there.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the recipe has an error at line {line}, column {column}: {reason}")]
pub struct RecipeError {
    /// From 1.
    pub line: usize,
    /// From 1, in characters.
    pub column: usize,
    /// What is wrong, and what was expected.
    pub reason: String,
}

const PAPER: &str = include_str!("../../data/recipes/paper.toml");
const DEFAULT_1: &str = include_str!("../../data/recipes/default-1.toml");
const DEFAULT_2: &str = include_str!("../../data/recipes/default-2.toml");
/// `default-2` and a conversation.
static DEFAULT_3: LazyLock<String> = LazyLock::new(|| {
    let dialogue = include_str!("../../data/recipes/dialogue.toml");
    format!("{}\n{dialogue}", DEFAULT_2.replacen("\"default-2\"", "\"default-3\"", 1))
});
/// Trains in a few milliseconds, for tests and simulations.
const TINY: &str = include_str!("../../data/recipes/tiny.toml");
// The paper's baseline, and its two halves alone.
const GRAMMAR: &str = include_str!("../../data/recipes/grammar.toml");
const SEQ2SEQ: &str = include_str!("../../data/recipes/seq2seq.toml");
const SEQ2SEQ_GRAMMAR: &str = include_str!("../../data/recipes/seq2seq-grammar.toml");

impl Recipe {
    /// The names of the built-in recipes for people. `tiny` is for tests, and `default-3` is not
    /// finished.
    pub const BUILTIN: [&'static str; 6] =
        ["default-1", "default-2", "paper", "grammar", "seq2seq", "seq2seq-grammar"];
    /// The recipe that the name `default` means today. A new person or study gets it under its own
    /// name, and only that name is recorded.
    pub const DEFAULT: &'static str = "default-2";

    /// The TOML text of a built-in recipe; none for another name.
    pub fn builtin(name: &str) -> Option<&'static str> {
        match name {
            "default" => Recipe::builtin(Recipe::DEFAULT),
            "default-1" => Some(DEFAULT_1),
            "default-2" => Some(DEFAULT_2),
            "default-3" => Some(&DEFAULT_3),
            "paper" => Some(PAPER),
            "tiny" => Some(TINY),
            "grammar" => Some(GRAMMAR),
            "seq2seq" => Some(SEQ2SEQ),
            "seq2seq-grammar" => Some(SEQ2SEQ_GRAMMAR),
            _ => None,
        }
    }

    /// Reads a recipe.
    ///
    /// - errors: [`RecipeError`], for text that is not TOML, an unknown or missing field, a value
    ///   out of range, or an unknown word table.
    pub fn parse(toml: &str) -> Result<Recipe, RecipeError> {
        // Most records carry a built-in recipe, and every session reads its own when it wakes.
        static SHIPPED: LazyLock<Vec<(String, OnceLock<Recipe>)>> = LazyLock::new(|| {
            // Release 0.1 wrote `default-1` with the name `default`.
            let former = DEFAULT_1.replacen("\"default-1\"", "\"default\"", 1);
            let texts =
                [DEFAULT_1, DEFAULT_2, &DEFAULT_3, PAPER, TINY, GRAMMAR, SEQ2SEQ, SEQ2SEQ_GRAMMAR];
            let texts = texts.into_iter().map(str::to_owned).chain([former]);
            texts.map(|text| (text, OnceLock::new())).collect()
        });
        let Some((_, kept)) = SHIPPED.iter().find(|(text, _)| text == toml) else {
            return Recipe::read(toml);
        };
        if let Some(recipe) = kept.get() {
            return Ok(recipe.clone());
        }
        let recipe = Recipe::read(toml)?;
        Ok(kept.get_or_init(|| recipe).clone())
    }

    fn read(toml: &str) -> Result<Recipe, RecipeError> {
        let file: RecipeFile = toml::from_str(toml).map_err(|error| {
            let start = error.span().map_or(0, |span| span.start);
            at(toml, start, error.message().trim().replace('\n', "; "))
        })?;
        let RecipeFile { name, words, abstraction, lifting, execution, parser, reranker, dialogue } =
            file;
        let settings =
            RecipeSettings { words, abstraction, lifting, execution, parser, reranker, dialogue };
        check_name(&name).map_err(|reason| at(toml, locate(toml, "", "name"), reason))?;
        settings
            .check()
            .map_err(|(section, field, reason)| at(toml, locate(toml, section, field), reason))?;
        let words = WordTable::builtin(&settings.words.table).ok_or_else(|| {
            let found = &settings.words.table;
            let reason =
                format!("there is no word table {found:?}; expected \"paper\" or \"default\"");
            at(toml, locate(toml, "words", "table"), reason)
        })?;
        let digest = settings.digest(words);
        Ok(Recipe { name, settings, words, digest })
    }

    /// The same settings under another digest, and so with another training seed. For evaluations,
    /// which must separate the quality of a method from the luck of one training. No person's mind
    /// is trained with it.
    pub fn reseeded(&self, seed: u64) -> Recipe {
        let mut hasher = blake3::Hasher::new_derive_key("apprentice 2026 evaluation seed");
        hasher.update(&self.digest.0);
        hasher.update(&seed.to_be_bytes());
        Recipe { digest: Digest(*hasher.finalize().as_bytes()), ..self.clone() }
    }

    /// As its file names it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The sections of its file.
    pub fn settings(&self) -> &RecipeSettings {
        &self.settings
    }

    /// The word table that its settings name.
    pub fn words(&self) -> &'static WordTable {
        self.words
    }

    /// BLAKE3 over the settings in a canonical form, the word table's digest and the version of
    /// the arithmetic. The name and the file's comments do not count.
    pub fn digest(&self) -> Digest {
        self.digest
    }
}

impl PartialEq for Recipe {
    fn eq(&self, other: &Recipe) -> bool {
        self.name == other.name && self.digest == other.digest
    }
}

impl RecipeSettings {
    fn digest(&self, words: &WordTable) -> Digest {
        let mut hasher = blake3::Hasher::new_derive_key("apprentice 2026 recipe");
        hasher.update(&NumericsVersion::CURRENT.0.to_be_bytes());
        hasher.update(&words.digest().0);
        hasher.update(&Document::of(self).digest().0);
        Digest(*hasher.finalize().as_bytes())
    }

    /// - errors: section, field and what was expected.
    fn check(&self) -> Result<(), (&'static str, &'static str, String)> {
        let reranker = &self.reranker;
        let size = |field, value: usize, max: usize| {
            let reason = || format!("{field} is {value}; expected a number between 1 and {max}");
            (1..=max).contains(&value).then_some(()).ok_or_else(|| ("reranker", field, reason()))
        };
        size("hidden", reranker.hidden, 512)?;
        size("symbol", reranker.symbol, 512)?;
        size("steps_max", reranker.steps_max, 100_000)?;
        let real = |field, value: f32, max: f32| {
            let reason = || format!("{field} is {value}; expected a number between 0 and {max}");
            (0.0..=max).contains(&value).then_some(()).ok_or_else(|| ("reranker", field, reason()))
        };
        real("learning_rate", reranker.learning_rate, 1.0)?;
        real("stop_below", reranker.stop_below, 100.0)?;
        self.check_parser()
    }

    fn check_parser(&self) -> Result<(), (&'static str, &'static str, String)> {
        let ParserSettings { kind, exemplar, features, grammar, seq2seq } = &self.parser;
        if self.abstraction.split == Split::Verbs && self.abstraction.lists.is_none() {
            let reason = "split is \"verbs\"; expected a section [abstraction.lists], which says \
                          what is a verb";
            return Err(("abstraction", "split", reason.to_owned()));
        }
        let absent = |section: &str| {
            let reason = format!("expected a section [{section}] with the settings of that kind");
            Err(("parser", "kind", reason))
        };
        let fault = |section, fault: TrainFault| match fault {
            TrainFault::Setting { field, .. } => (section, field, fault.to_string()),
            other => (section, "", other.to_string()),
        };
        if *kind == ParserKind::Exemplar {
            let Some(exemplar) = exemplar else { return absent("parser.exemplar") };
            exemplar.check().map_err(|found| fault("parser.exemplar", found))?;
        }
        if *kind == ParserKind::Features {
            let Some(features) = features else { return absent("parser.features") };
            if self.abstraction.lists.is_none() {
                return absent("abstraction.lists");
            }
            features.check().map_err(|(field, reason)| ("parser.features", field, reason))?;
        }
        if matches!(kind, ParserKind::Grammar | ParserKind::Backed) {
            let Some(grammar) = grammar else { return absent("parser.grammar") };
            grammar.check().map_err(|(field, reason)| ("parser.grammar", field, reason))?;
        }
        if matches!(kind, ParserKind::Seq2seq | ParserKind::Backed) {
            let Some(seq2seq) = seq2seq else { return absent("parser.seq2seq") };
            seq2seq.check().map_err(|found| fault("parser.seq2seq", found))?;
        }
        Ok(())
    }
}

fn check_name(name: &str) -> Result<(), String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if (1..=64).contains(&name.len()) && name.chars().all(plain) {
        return Ok(());
    }
    Err(format!("{name:?} is not a name: expected 1 to 64 letters, digits, hyphens or underscores"))
}

fn at(toml: &str, start: usize, reason: String) -> RecipeError {
    let before = toml.get(..start).unwrap_or(toml);
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
    RecipeError { line, column, reason }
}

/// Where a field of a section is in the text, in bytes from 0; the head of the section when the
/// field is not written, 0 when the section is not.
fn locate(toml: &str, section: &str, field: &str) -> usize {
    let head = format!("[{section}]");
    let mut inside = section.is_empty();
    let mut found = 0;
    let mut start = 0;
    for line in toml.split_inclusive('\n') {
        let text = line.trim_start();
        let indent = line.len() - text.len();
        if text.starts_with('[') {
            inside = text.starts_with(&head);
            if inside {
                found = start + indent;
            }
        } else if inside
            && text.strip_prefix(field).is_some_and(|rest| rest.trim_start().starts_with('='))
        {
            return start + indent;
        }
        start += line.len();
    }
    found
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn the_recipes_that_ship_are_whole_and_differ() {
        let names = Recipe::BUILTIN.into_iter().chain(["tiny", "default-3"]);
        let digests: BTreeMap<Digest, &str> = names
            .clone()
            .map(|name| {
                let recipe = Recipe::parse(Recipe::builtin(name).unwrap()).unwrap();
                assert_eq!(recipe.name(), name);
                (recipe.digest(), name)
            })
            .collect();
        assert_eq!(digests.len(), names.count(), "{digests:?}");
        assert_eq!(Recipe::builtin("nobody's"), None);
    }

    #[test]
    fn the_baseline_has_the_grammar_and_the_model_of_its_halves() {
        let settings = |name| Recipe::parse(Recipe::builtin(name).unwrap()).unwrap().settings;
        let [whole, grammar, model] = ["seq2seq-grammar", "grammar", "seq2seq"].map(settings);
        assert_eq!(whole.parser.grammar, grammar.parser.grammar);
        assert_eq!(whole.parser.seq2seq, model.parser.seq2seq);
        // And all hear what the paper's parser hears.
        let paper = settings("paper");
        for recipe in [whole, grammar, model] {
            let heard = (recipe.words, recipe.abstraction, recipe.lifting, recipe.execution);
            let hears = paper.clone();
            assert_eq!(heard, (hears.words, hears.abstraction, hears.lifting, hears.execution));
        }
    }

    #[test]
    fn the_digest_is_of_the_settings_and_not_of_the_text() {
        let text = Recipe::builtin("tiny").unwrap();
        let recipe = Recipe::parse(text).unwrap();
        let renamed = text.replace("name = \"tiny\"", "# a comment\nname = \"other\"");
        assert_eq!(Recipe::parse(&renamed).unwrap().digest(), recipe.digest());
        let changed = text.replace("spelling = false", "spelling = true");
        assert_ne!(changed, text);
        assert_ne!(Recipe::parse(&changed).unwrap().digest(), recipe.digest());
        // The first edition is what a recipe without an edition reads.
        let edition = |number| text.replacen("[words]", &format!("[words]\nedition = {number}"), 1);
        assert_eq!(Recipe::parse(&edition(1)).unwrap().digest(), recipe.digest());
        assert_ne!(Recipe::parse(&edition(2)).unwrap().digest(), recipe.digest());
    }

    #[test]
    fn an_error_in_a_recipe_says_where_and_what_was_expected() {
        let text = Recipe::builtin("tiny").unwrap();
        let check = |from: &str, to: &str, expected: &str| {
            assert!(text.contains(from), "{from}");
            let broken = text.replacen(from, to, 1);
            let error = Recipe::parse(&broken).unwrap_err();
            let line = broken[..broken.find(to).unwrap()].matches('\n').count() + 1;
            assert_eq!(error.line, line, "{error}");
            assert!(error.to_string().contains(expected), "{error}");
        };
        check("spelling = false", "speling = false", "expected one of `adjectives`");
        check("spelling = false", "spelling = 3", "expected a boolean");
        check("split = \"and\"", "split = \"often\"", "expected one of `and`, `clauses`, `verbs`");
        check("name = \"tiny\"", "name = \"ti ny\"", "expected 1 to 64 letters");
        check("table = \"paper\"", "table = \"none\"", "there is no word table \"none\"");
        let edition = |number: &str| format!("table = \"paper\"\nedition = {number}");
        for number in ["0", "3", "-1", "9223372036854775807"] {
            let error = Recipe::parse(&text.replace("table = \"paper\"", &edition(number)));
            let error = error.unwrap_err();
            let line = text[..text.find("table").unwrap()].matches('\n').count() + 2;
            assert_eq!(error.line, line, "{error}");
            assert!(error.reason.ends_with("expected 1 or 2"), "{error}");
        }
        check("kind = \"exemplar\"", "kind = \"oracle\"", "expected one of `exemplar`");
        check("hidden = 8\n", "hidden = 0\n", "a number between 1 and 512");
        check("hidden = 16\n", "hidden = 0\n", "allowed is between 1 and 1024");
        let error = Recipe::parse("name = ").unwrap_err();
        assert_eq!((error.line, error.column), (1, 8));
    }
}
