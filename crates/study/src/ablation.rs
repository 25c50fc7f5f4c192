//! What each difference between two recipes brings: one is taken back, or added, at a time, and
//! everything is measured again.

use std::collections::BTreeMap;
use std::fmt::{self, Display};

use apprentice::learning::{Recipe, TrainError};
use serde::{Deserialize, Serialize};

use super::corpus::Corpus;
use super::figures::Spread;
use super::one_shot::one_shot;
use super::primitives::primitives;
use super::report::Setting;

/// Differences to take back, or to add, one at a time (TOML; `docs/evaluation.md` has an example).
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ablation {
    /// Whether a difference adds to the recipe, and so the variant is the one that has it.
    #[serde(default)]
    adds: bool,
    #[serde(rename = "difference")]
    differences: Vec<Difference>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Difference {
    name: String,
    /// Settings of the recipe to replace, in its own sections.
    #[serde(default)]
    set: toml::Table,
    /// Settings to leave out, each named from its section on: `execution.carrying`. What a recipe
    /// need not have cannot be replaced by nothing.
    #[serde(default)]
    unset: Vec<String>,
}

/// A recipe with one difference taken back.
#[derive(Debug, Clone)]
pub struct Variant {
    pub name: String,
    pub recipe: Recipe,
}

impl Ablation {
    pub fn adds(&self) -> bool {
        self.adds
    }

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
        for Difference { name, set, unset } in &self.differences {
            let mut changed = table.clone();
            merge(&mut changed, set);
            if let Some(path) = unset.iter().find(|path| !leave_out(&mut changed, path)) {
                return Err(format!("difference {name:?}: this recipe has no {path:?}"));
            }
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

/// - returns: whether there was a setting of this name.
fn leave_out(table: &mut toml::Table, path: &str) -> bool {
    match path.split_once('.') {
        None => table.remove(path).is_some(),
        Some((section, rest)) => match table.get_mut(section) {
            Some(toml::Value::Table(inner)) => leave_out(inner, rest),
            _ => false,
        },
    }
}

/// The figures that a difference is judged by: key in JSON, title in the table.
const FIGURES: [(&str, &str); 7] = [
    ("right", "right"),
    ("wrong", "wrong"),
    ("untaught_accepted", "untaught"),
    ("same_person", "same person"),
    ("others_short", "others short"),
    ("others", "others any"),
    ("distractors_accepted", "distractors"),
];

/// A figure each, by key.
type Figures = BTreeMap<&'static str, Spread>;

/// One variant beside the recipe with everything.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    pub difference: String,
    pub recipe_digest: String,
    /// Over seeds.
    pub figures: Figures,
    /// What the difference brings: the figure with it less the one without it, seed by seed.
    pub gain: Figures,
    /// A training failed, and why: no figures then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
}

/// What an ablation found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AblationReport {
    pub recipe: String,
    pub adds: bool,
    pub people: String,
    pub seeds: Vec<u64>,
    pub lines: Vec<Line>,
}

/// Runs *primitives* and *one-shot* for every variant, each seed by itself.
///
/// - `adds`: see [`Ablation::adds`].
/// - errors: a training of the whole recipe fails. One of a variant is a line that says so.
pub fn ablate(
    setting: &Setting<'_>,
    corpus: &Corpus,
    variants: &[Variant],
    adds: bool,
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
            let spread = |figure: usize| {
                let seeds = 0..measured.len();
                Spread::of(&seeds.map(|seed| value(seed, figure)).collect::<Vec<f64>>())
            };
            FIGURES.iter().enumerate().map(|(place, (key, _))| (*key, spread(place))).collect()
        };
        lines.push(Line {
            difference: name.clone(),
            recipe_digest: recipe.digest().short(),
            figures: over(&|seed, figure| measured[seed][figure]),
            gain: over(&|seed, figure| {
                let lost = whole[seed][figure] - measured[seed][figure];
                // Not the negative of 0, which is shown as a loss.
                if adds { 0.0 - lost } else { lost }
            }),
            failed,
        });
    }
    Ok(AblationReport {
        recipe: setting.recipe.name().to_owned(),
        adds,
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
        let head = if self.adds { "with" } else { "without" };
        writeln!(f, "| {head} | {} |", FIGURES.map(|(_, title)| title).join(" | "))?;
        writeln!(f, "|---|{}", "---|".repeat(FIGURES.len()))?;
        for (number, line) in self.lines.iter().enumerate() {
            write!(f, "| {} |", line.difference)?;
            if let Some(reason) = &line.failed {
                writeln!(f, " training fails: {reason} |")?;
                continue;
            }
            for (key, _) in FIGURES {
                let (figure, gain) = (line.figures[key], line.gain[key]);
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
    fn a_setting_that_a_recipe_need_not_have_is_left_out() {
        let base = Recipe::builtin("default-2").expect("it ships");
        let without = |path: &str| {
            let list = format!("[[difference]]\nname = \"x\"\nunset = [\"{path}\"]\n");
            Ablation::parse(&list).unwrap().variants(base)
        };
        let found = without("execution.carrying").unwrap();
        assert!(found[0].recipe.settings().execution.carrying.is_some());
        assert!(found[1].recipe.settings().execution.carrying.is_none());
        for path in ["execution.carry", "execution.carrying.leaving.x", "", "."] {
            let refused = without(path).unwrap_err();
            assert!(refused.contains(&format!("has no {path:?}")), "{refused}");
        }
        // What every recipe must have is missed when the variant is read.
        assert!(without("execution.polarity").unwrap_err().starts_with("difference \"x\""));
    }

    #[test]
    fn a_list_says_whether_it_adds() {
        let list = "[[difference]]\nname = \"x\"\nset.lifting.held = true\n";
        assert!(!Ablation::parse(list).unwrap().adds());
        assert!(Ablation::parse(&format!("adds = true\n{list}")).unwrap().adds());
    }

    #[test]
    fn the_lists_that_ship_fit_the_recipes_that_ship() {
        let lists = [
            ("default-1", include_str!("../../../tools/ablation.toml"), false),
            ("default-2", include_str!("../../../tools/ablation-2.toml"), false),
            ("paper", include_str!("../../../tools/additions.toml"), true),
        ];
        for (recipe, list, adds) in lists {
            let list = Ablation::parse(list).unwrap();
            assert_eq!(list.adds(), adds);
            let variants = list.variants(Recipe::builtin(recipe).unwrap()).unwrap();
            assert!(variants.len() > 8, "{recipe}");
        }
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
