//! What a study is, and the file that says so: `study.toml`.

use std::fmt::Write as _;
use std::path::Path;

use apprentice::ids::Digest;
use apprentice::learning::Recipe;

use crate::participant::Teacher;

/// The settings that decide every byte of a study's tables.
pub struct Design {
    pub seed: u64,
    pub conditions: Vec<Condition>,
    pub who: Who,
    /// Its words for primitives are what recorded people fall back to.
    pub teacher: Teacher,
}

pub struct Condition {
    pub name: String,
    pub recipe_text: String,
    pub recipe: Recipe,
}

/// Who takes part.
pub enum Who {
    Simulated {
        task_types: Vec<String>,
        /// Each user has one type: so many for each, or so many spread over all.
        users: usize,
        per_type: bool,
        episodes: u32,
    },
    Recorded {
        corpus: Digest,
        episodes_max: u32,
        /// People chosen by the same names as for `eval`.
        people: String,
    },
}

impl Who {
    pub fn simulated(&self) -> bool {
        matches!(self, Who::Simulated { .. })
    }
}

/// The file in a study's directory that says what was run.
pub const STUDY_FILE: &str = "study.toml";

impl Design {
    /// What was run, as TOML; equal designs give equal text.
    pub fn text(&self) -> String {
        let quoted = |text: &str| toml::Value::from(text).to_string();
        let mut text = String::from(
            "# Written by `apprentice study run`; the study goes on only with the same settings.\n",
        );
        let program = concat!("apprentice ", env!("CARGO_PKG_VERSION"));
        let _ = writeln!(text, "seed = {}\nprogram = {}", self.seed, quoted(program));
        match &self.who {
            Who::Simulated { task_types, users, per_type, episodes } => {
                let types: Vec<String> = task_types.iter().map(|name| quoted(name)).collect();
                let users_key = if *per_type { "users_per_type" } else { "users" };
                let _ = writeln!(
                    text,
                    "\n[design]\ntask_types = [{}]\n{users_key} = {users}\nepisodes = {episodes}",
                    types.join(", ")
                );
                let teacher = self.teacher.digest().to_hex();
                let _ = writeln!(
                    text,
                    "\n[participants]\n# The users were simulated.\nsimulated = true\n\
                     teacher = {}",
                    quoted(&teacher)
                );
            }
            Who::Recorded { corpus, episodes_max, people } => {
                let _ = writeln!(text, "\n[design]\nepisodes_max = {episodes_max}");
                let _ = writeln!(
                    text,
                    "\n[participants]\n# Recorded people: their sentences, played back.\n\
                     simulated = false\ncorpus = {}\npeople = {}\nteacher = {}",
                    quoted(&corpus.to_hex()),
                    quoted(people),
                    quoted(&self.teacher.digest().to_hex())
                );
            }
        }
        for condition in &self.conditions {
            let digest = condition.recipe.digest().to_hex();
            let _ = writeln!(
                text,
                "\n[[condition]]\nname = {}\nrecipe = {}",
                quoted(&condition.name),
                quoted(&digest)
            );
        }
        text
    }
}

/// What two designs differ in, line by line.
///
/// - returns: none when they are the same.
pub fn difference(before: &str, now: &str) -> Option<String> {
    let lines = |text: &str| -> Vec<String> {
        let lines = text.lines().filter(|line| line.contains('=') && !line.starts_with('#'));
        lines.map(str::to_owned).collect()
    };
    if before == now {
        return None;
    }
    let (before, now) = (lines(before), lines(now));
    let only = |ones: &[String], others: &[String]| {
        let gone: Vec<&str> =
            ones.iter().filter(|one| !others.contains(one)).map(String::as_str).collect();
        if gone.is_empty() { "no such settings".to_owned() } else { gone.join(", ") }
    };
    Some(format!("it has {}; you asked for {}", only(&before, &now), only(&now, &before)))
}

/// Where a condition's service keeps its data.
pub fn data_dir(out: &Path, condition: &str) -> std::path::PathBuf {
    out.join("data").join(condition)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn design(seed: u64) -> Design {
        let text = Recipe::builtin("default").unwrap().to_owned();
        Design {
            seed,
            conditions: vec![Condition {
                name: "default".to_owned(),
                recipe: Recipe::parse(&text).unwrap(),
                recipe_text: text,
            }],
            who: Who::Simulated {
                task_types: vec!["cool".to_owned()],
                users: 2,
                per_type: true,
                episodes: 5,
            },
            teacher: Teacher::parse(Teacher::TEXT).unwrap(),
        }
    }

    #[test]
    fn a_design_is_toml_and_says_that_users_were_simulated() {
        let read: toml::Table = design(7).text().parse().unwrap();
        assert_eq!(read["seed"].as_integer(), Some(7));
        assert_eq!(read["participants"]["simulated"].as_bool(), Some(true));
        assert_eq!(read["condition"][0]["name"].as_str(), Some("default"));
    }

    #[test]
    fn designs_differ_in_what_is_named() {
        assert_eq!(difference(&design(7).text(), &design(7).text()), None);
        let difference = difference(&design(7).text(), &design(8).text()).unwrap();
        assert_eq!(difference, "it has seed = 7; you asked for seed = 8");
    }
}
