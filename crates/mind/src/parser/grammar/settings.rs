use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::rules::Rules;
use crate::language::LiftedProgram;

/// A grammar, as its recipe writes it: which requests there are, and by what words.
///
/// A pattern is words with blanks between them. `{name}` stands for anything of the class `name`;
/// `<obj>` is a mention of that sort; `<obj:2>`, in a request, is a phrase of the class `obj` whose
/// first mention becomes the program's second argument.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GrammarSettings {
    /// Words that are read past wherever they stand.
    #[serde(default)]
    pub silent: BTreeSet<String>,
    /// Phrases that may stand for each other, likeliest first. An empty one may be left out.
    pub classes: BTreeMap<String, Vec<String>>,
    /// What can be asked, and what it means. Where several fit, the first counts.
    pub requests: Vec<(String, LiftedProgram)>,
}

impl GrammarSettings {
    /// - errors: a pattern that names no class, a class that begins with itself, or a program with
    ///   an argument that its request does not say; field and sentence.
    pub fn check(&self) -> Result<(), (&'static str, String)> {
        Rules::compile(self).map(|_| ())
    }
}
