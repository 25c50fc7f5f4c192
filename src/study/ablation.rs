//! What each difference between two recipes brings: one is taken back at a time, and everything is
//! measured again.

use std::fmt::{self, Display};

use serde::{Deserialize, Serialize};

use super::corpus::Corpus;
use super::figures::Spread;
use super::one_shot::one_shot;
use super::primitives::primitives;
use super::report::Setting;
use crate::learning::{Recipe, TrainError};

/// Differences to take back, one at a time (TOML; `docs/evaluation.md` has an example).
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ablation {
    #[serde(rename = "difference")]
    differences: Vec<Difference>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Difference {
    name: String,
    /// Settings of the recipe to replace, in its own sections.
    set: toml::Table,
}

/// A recipe with one difference taken back.
#[derive(Debug, Clone)]
pub struct Variant {
    pub name: String,
    pub recipe: Recipe,
}

impl Ablation {
    /// - errors: a sentence, for text that is no such list.
    pub fn parse(text: &str) -> Result<Ablation, String> {
        toml::from_str(text).map_err(|error| error.to_string().trim_end().to_owned())
    }

    /// The base recipe itself, then a variant for each difference.
    ///
    /// - `base`: the text of a recipe, which parses.
    /// - errors: the difference that does not give a recipe, and why.
    pub fn variants(&self, base: &str) -> Result<Vec<Variant>, String> {
        let parse = |name: &str, text: &str| match Recipe::parse(text) {
            Ok(recipe) => Ok(Variant { name: name.to_owned(), recipe }),
            Err(error) => Err(format!("difference {name:?}: {error}")),
        };
        let table: toml::Table = toml::from_str(base).map_err(|error| error.to_string())?;
        let mut variants = vec![parse("nothing", base)?];
        for Difference { name, set } in &self.differences {
            let mut changed = table.clone();
            merge(&mut changed, set);
            if changed == table {
                return Err(format!("difference {name:?} changes nothing in this recipe"));
            }
            let text = toml::to_string(&changed).map_err(|error| error.to_string())?;
            variants.push(parse(name, &text)?);
        }
        Ok(variants)
    }
}

fn merge(table: &mut toml::Table, set: &toml::Table) {
    for (key, value) in set {
        match (table.get_mut(key), value) {
            (Some(toml::Value::Table(old)), toml::Value::Table(new)) => merge(old, new),
            _ => {
                table.insert(key.clone(), value.clone());
            }
        }
    }
}

/// The figures that a difference is judged by.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Figures<T> {
    pub right: T,
    pub wrong: T,
    pub untaught_accepted: T,
    pub same_person: T,
    pub others_short: T,
    pub others: T,
    pub distractors_accepted: T,
}

impl<T: Copy> Figures<T> {
    const NAMES: [&'static str; 7] =
        ["right", "wrong", "untaught", "same person", "others short", "others any", "distractors"];

    fn list(&self) -> [T; 7] {
        let Figures { right, wrong, untaught_accepted, .. } = *self;
        let Figures { same_person, others_short, others, distractors_accepted, .. } = *self;
        [right, wrong, untaught_accepted, same_person, others_short, others, distractors_accepted]
    }

    fn of(list: [T; 7]) -> Figures<T> {
        let [right, wrong, untaught_accepted, same_person, others_short, others, distractors] =
            list;
        let distractors_accepted = distractors;
        Figures {
            right,
            wrong,
            untaught_accepted,
            same_person,
            others_short,
            others,
            distractors_accepted,
        }
    }
}

/// One variant beside the recipe with everything.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    pub without: String,
    pub recipe_digest: String,
    /// Over seeds.
    pub figures: Figures<Spread>,
    /// What the difference brings: the whole recipe less this variant, seed by seed.
    pub gain: Figures<Spread>,
    /// A training failed, and why: no figures then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
}

/// What an ablation found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AblationReport {
    pub recipe: String,
    pub people: String,
    pub seeds: Vec<u64>,
    pub lines: Vec<Line>,
}

/// Runs *primitives* and *one-shot* for every variant, each seed by itself.
///
/// - errors: a training of the whole recipe fails. One of a variant is a line that says so.
pub fn ablate(
    setting: &Setting<'_>,
    corpus: &Corpus,
    variants: &[Variant],
) -> Result<AblationReport, TrainError> {
    let mut lines = Vec::new();
    let mut whole: Vec<[f64; 7]> = Vec::new();
    for (number, Variant { name, recipe }) in variants.iter().enumerate() {
        let measured: Result<Vec<[f64; 7]>, TrainError> = setting
            .seeds
            .iter()
            .map(|seed| measure(setting, corpus, recipe, std::slice::from_ref(seed)))
            .collect();
        let (measured, failed) = match measured {
            Ok(measured) => (measured, None),
            Err(error) if number == 0 => return Err(error),
            Err(error) => (Vec::new(), Some(error.to_string())),
        };
        if number == 0 {
            whole.clone_from(&measured);
        }
        let over = |value: &dyn Fn(usize, usize) -> f64| {
            Figures::of(std::array::from_fn(|figure| {
                let values: Vec<f64> =
                    (0..measured.len()).map(|seed| value(seed, figure)).collect();
                Spread::of(&values)
            }))
        };
        lines.push(Line {
            without: name.clone(),
            recipe_digest: recipe.digest().short(),
            figures: over(&|seed, figure| measured[seed][figure]),
            gain: over(&|seed, figure| whole[seed][figure] - measured[seed][figure]),
            failed,
        });
    }
    Ok(AblationReport {
        recipe: setting.recipe.name().to_owned(),
        people: setting.people.to_string(),
        seeds: setting.seeds.to_vec(),
        lines,
    })
}

fn measure(
    setting: &Setting<'_>,
    corpus: &Corpus,
    recipe: &Recipe,
    seeds: &[u64],
) -> Result<[f64; 7], TrainError> {
    let of_rows = Setting { recipe, seeds, failures: 0, ..*setting };
    let of_episodes = Setting { limit: None, ..of_rows };
    let first = primitives(&of_rows, &corpus.steps)?;
    let taught = one_shot(&of_episodes, corpus)?.figures;
    Ok([
        first.shares.right,
        first.shares.wrong,
        first.untaught_accepted,
        taught.same_person.mean,
        taught.others_short.mean,
        taught.others.mean,
        taught.distractors_accepted.mean,
    ])
}

/// A table in Markdown, in percent: the recipe's own figures, then what each difference brings.
impl Display for AblationReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seeds: Vec<String> = self.seeds.iter().map(u64::to_string).collect();
        writeln!(
            f,
            "recipe {} · people: {} · seeds {}; gain = with less without, ± sd over seeds\n",
            self.recipe,
            self.people,
            seeds.join(", ")
        )?;
        writeln!(f, "| without | {} |", Figures::<f64>::NAMES.join(" | "))?;
        writeln!(f, "|---|{}", "---|".repeat(Figures::<f64>::NAMES.len()))?;
        for (number, line) in self.lines.iter().enumerate() {
            write!(f, "| {} |", line.without)?;
            if let Some(reason) = &line.failed {
                writeln!(f, " training fails: {reason} |")?;
                continue;
            }
            for (figure, gain) in line.figures.list().iter().zip(line.gain.list()) {
                let mean = figure.mean * 100.0;
                match number {
                    0 => write!(f, " **{mean:.1}** |")?,
                    _ => write!(
                        f,
                        " {mean:.1} ({:+.1} ± {:.1}) |",
                        gain.mean * 100.0,
                        gain.sd * 100.0
                    )?,
                }
            }
            writeln!(f)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn variants(text: &str) -> Result<Vec<Variant>, String> {
        let base = Recipe::builtin("default").expect("it ships");
        Ablation::parse(text).and_then(|ablation| ablation.variants(base))
    }

    #[test]
    fn each_variant_has_one_difference_taken_back() {
        let found = variants(
            "[[difference]]\nname = \"spelling\"\nset.abstraction.spelling = false\n\
             [[difference]]\nname = \"held\"\nset.lifting.held = false\n",
        )
        .unwrap();
        let names: Vec<&str> = found.iter().map(|variant| variant.name.as_str()).collect();
        assert_eq!(names, ["nothing", "spelling", "held"]);
        let settings = |place: usize| found[place].recipe.settings();
        assert!(settings(0).abstraction.spelling && settings(0).lifting.held);
        assert!(!settings(1).abstraction.spelling && settings(1).lifting.held);
        assert!(settings(2).abstraction.spelling && !settings(2).lifting.held);
        let whole = Recipe::parse(Recipe::builtin("default").unwrap()).unwrap();
        assert_eq!(found[0].recipe.digest(), whole.digest());
    }

    #[test]
    fn a_difference_that_is_none_is_refused_by_name() {
        let same = variants("[[difference]]\nname = \"x\"\nset.abstraction.spelling = true\n");
        assert!(same.unwrap_err().contains("\"x\" changes nothing"));
        let unknown = variants("[[difference]]\nname = \"y\"\nset.abstraction.spell = true\n");
        assert!(unknown.unwrap_err().starts_with("difference \"y\""));
        assert!(variants("[[differences]]\n").is_err());
    }
}
