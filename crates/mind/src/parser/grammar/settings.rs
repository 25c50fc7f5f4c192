use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::rules::Rules;
use crate::language::LiftedProgram;

/// A grammar as its recipe writes it: the requests, and their words.
///
/// A pattern is words with blanks between them. `{name}` stands for anything of the class `name`;
/// `<obj>` is a mention of that sort; `<obj:2>`, in a request, is a phrase of the class `obj` whose
/// first mention becomes the program's second argument.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GrammarSettings {
    /// Words that are skipped everywhere.
    #[serde(default)]
    pub silent: BTreeSet<String>,
    /// Classes of phrases that may replace each other, likeliest first. With an empty phrase, the
    /// class may be left out.
    pub classes: BTreeMap<String, Vec<String>>,
    /// The requests with their meanings. If several fit, the first counts.
    pub requests: Vec<(String, LiftedProgram)>,
}

impl GrammarSettings {
    /// Checks all patterns.
    ///
    /// - errors: field and sentence: a pattern with an unknown class, a class that begins with
    ///   itself, or a program with an argument that its request does not have.
    pub fn check(&self) -> Result<(), (&'static str, String)> {
        Rules::compile(self).map(|_| ())
    }
}
