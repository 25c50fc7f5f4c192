//! What was run, as `study.toml` says it.

use std::fs;
use std::path::Path;

use serde::Deserialize;

/// What every figure of a study says of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct About {
    pub seed: u64,
    /// The program and its version.
    pub program: String,
    pub users: Users,
    pub conditions: Vec<Condition>,
}

/// Who took part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Users {
    /// So many for each task type and condition.
    SimulatedPerType { users: u32, task_types: Vec<String>, episodes: u32 },
    /// So many for each condition, spread over the task types.
    Simulated { users: u32, task_types: Vec<String>, episodes: u32 },
    /// People whose recorded sentences were played back.
    Recorded { people: String, corpus: String, episodes_max: u32 },
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Condition {
    pub name: String,
    /// The recipe's digest in hexadecimal.
    pub recipe: String,
}

/// Why nobody can say what was run.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("study.toml cannot be read: {0}; is this the directory of a study?")]
pub struct AboutError(pub String);

#[derive(Deserialize)]
struct File {
    seed: u64,
    program: String,
    design: Design,
    participants: Participants,
    condition: Vec<FileCondition>,
}

#[derive(Deserialize)]
struct Design {
    #[serde(default)]
    task_types: Vec<String>,
    users: Option<u32>,
    users_per_type: Option<u32>,
    episodes: Option<u32>,
    episodes_max: Option<u32>,
}

#[derive(Deserialize)]
struct Participants {
    simulated: bool,
    corpus: Option<String>,
    people: Option<String>,
}

#[derive(Deserialize)]
struct FileCondition {
    name: String,
    recipe: String,
}

impl About {
    /// Reads `study.toml` of a study's directory.
    pub fn read(directory: &Path) -> Result<About, AboutError> {
        let text = fs::read_to_string(directory.join("study.toml"));
        About::parse(&text.map_err(|error| AboutError(error.to_string()))?)
    }

    pub fn parse(text: &str) -> Result<About, AboutError> {
        let file: File = toml::from_str(text).map_err(|error| {
            let start = error.span().map_or(0, |span| span.start);
            let line = text[..start].matches('\n').count() + 1;
            AboutError(format!("line {line}: {}", error.message().trim().replace('\n', "; ")))
        })?;
        let File { seed, program, design, participants, condition } = file;
        let absent = |what: &str| AboutError(format!("the section [design] has no {what}"));
        let users = if participants.simulated {
            let episodes = design.episodes.ok_or_else(|| absent("episodes"))?;
            let task_types = design.task_types;
            match (design.users_per_type, design.users) {
                (Some(users), _) => Users::SimulatedPerType { users, task_types, episodes },
                (None, Some(users)) => Users::Simulated { users, task_types, episodes },
                (None, None) => return Err(absent("users or users_per_type")),
            }
        } else {
            Users::Recorded {
                people: participants.people.unwrap_or_else(|| "all".to_owned()),
                corpus: participants.corpus.unwrap_or_default(),
                episodes_max: design.episodes_max.ok_or_else(|| absent("episodes_max"))?,
            }
        };
        let conditions = condition
            .into_iter()
            .map(|FileCondition { name, recipe }| Condition { name, recipe })
            .collect();
        Ok(About { seed, program, users, conditions })
    }

    pub fn is_simulated(&self) -> bool {
        !matches!(self.users, Users::Recorded { .. })
    }

    /// Who took part, in a sentence that every figure carries.
    pub fn participants(&self) -> String {
        let counted = |number: u32, what: &str| match number {
            1 => format!("1 {what}"),
            number => format!("{number} {what}s"),
        };
        match &self.users {
            Users::SimulatedPerType { users, task_types, episodes } => format!(
                "Simulated users, not people: {users} for each of {} and each condition, {} each; \
                 seed {}.",
                counted(task_types.len() as u32, "task type"),
                counted(*episodes, "episode"),
                self.seed
            ),
            Users::Simulated { users, task_types, episodes } => format!(
                "Simulated users, not people: {users} for each condition, spread over {}, {} \
                 each; seed {}.",
                counted(task_types.len() as u32, "task type"),
                counted(*episodes, "episode"),
                self.seed
            ),
            Users::Recorded { people, episodes_max, .. } => format!(
                "Recorded people ({people}): their own sentences, played back; at most {} each; \
                 seed {}.",
                counted(*episodes_max, "episode"),
                self.seed
            ),
        }
    }

    /// The command that runs this study again; where its files go is for the reader to say.
    pub fn command(&self) -> String {
        let names: Vec<&str> = self.conditions.iter().map(|c| c.name.as_str()).collect();
        let conditions = names.join(",");
        let seed = self.seed;
        match &self.users {
            Users::SimulatedPerType { users, task_types, episodes } => format!(
                "apprentice study run --conditions {conditions} --users-per-type {users} \
                 --task-types {} --episodes {episodes} --seed {seed} --out DIR",
                task_types.join(",")
            ),
            Users::Simulated { users, task_types, episodes } => format!(
                "apprentice study run --conditions {conditions} --users {users} --task-types {} \
                 --episodes {episodes} --seed {seed} --out DIR",
                task_types.join(",")
            ),
            Users::Recorded { people, episodes_max, .. } => format!(
                "apprentice study run --corpus FILE --people {people} --conditions {conditions} \
                 --episodes-max {episodes_max} --seed {seed} --out DIR"
            ),
        }
    }

    /// Where a condition stands in the order of the study; those that it does not name come last.
    pub(super) fn rank(&self, condition: &str) -> usize {
        let place = self.conditions.iter().position(|known| known.name == condition);
        place.unwrap_or(self.conditions.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_run_is_said_and_can_be_run_again() {
        let simulated = "seed = 7\nprogram = \"apprentice 0.2.0\"\n[design]\n\
                         task_types = [\"clean\", \"cool\"]\nusers_per_type = 20\nepisodes = 5\n\
                         [participants]\nsimulated = true\n[[condition]]\nname = \"paper\"\n\
                         recipe = \"ab\"\n[[condition]]\nname = \"default\"\nrecipe = \"cd\"\n";
        let about = About::parse(simulated).unwrap();
        assert_eq!(
            about.participants(),
            "Simulated users, not people: 20 for each of 2 task types and each condition, 5 \
             episodes each; seed 7."
        );
        assert_eq!(
            about.command(),
            "apprentice study run --conditions paper,default --users-per-type 20 --task-types \
             clean,cool --episodes 5 --seed 7 --out DIR"
        );
        assert_eq!((about.rank("default"), about.rank("unknown")), (1, 2));
        let spread = About::parse(&simulated.replace("users_per_type", "users")).unwrap();
        assert!(spread.participants().contains("20 for each condition, spread over 2 task types"));
        let recorded = "seed = 1\nprogram = \"apprentice\"\n[design]\nepisodes_max = 20\n\
                        [participants]\nsimulated = false\ncorpus = \"ef\"\npeople = \"held-out\"\n\
                        [[condition]]\nname = \"default\"\nrecipe = \"cd\"\n";
        let about = About::parse(recorded).unwrap();
        assert!(!about.is_simulated());
        assert!(about.participants().starts_with("Recorded people (held-out): their own"));
        assert!(about.command().contains("--corpus FILE --people held-out"));
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        let error = About::parse("seed = 1\nprogram = 7\n").unwrap_err().to_string();
        assert!(error.starts_with("study.toml cannot be read: line 2: "), "{error}");
        let empty = "seed = 1\nprogram = \"a\"\ncondition = []\n[design]\n[participants]\n\
                     simulated = true\n";
        let error = About::parse(empty).unwrap_err().to_string();
        assert!(error.contains("the section [design] has no episodes"), "{error}");
    }
}
