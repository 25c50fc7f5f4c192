//! Means and spreads over people.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::rows::{EpisodeRow, UtteranceRow};
use crate::cells::{decimal, maybe_decimal, text};

/// The task type of lines over all types.
pub const ALL: &str = "all";
/// The task type of lines over recorded people with fewer episodes than the others have.
pub const FEW: &str = "under_5_episodes";

/// A measure's name, and its value of one episode where it has one.
pub type Measure = (&'static str, fn(&EpisodeRow) -> Option<f64>);

/// What is summed up, in the order of the table.
pub const MEASURES: [Measure; 7] = [
    ("complexity", |row| row.complexity),
    ("examples_taught", |row| Some(f64::from(row.examples_taught))),
    ("normalised_length", |row| row.normalised_length),
    ("not_sure_rate", |row| ratio(row.not_sure, row.utterances)),
    ("reuse_rate", |row| ratio(row.reuses.1, row.reuses.0)),
    ("understood_first_try", |row| ratio(row.first_tries.1, row.first_tries.0)),
    ("wrong_rate", |row| ratio(row.wrong, row.utterances)),
];

fn ratio(part: u32, whole: u32) -> Option<f64> {
    (whole > 0).then(|| f64::from(part) / f64::from(whole))
}

#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SummaryRow {
    #[serde(with = "text")]
    pub condition: String,
    #[serde(with = "text")]
    pub task_type: String,
    pub episode: u32,
    #[serde(with = "text")]
    pub measure: String,
    pub users: u32,
    #[serde(with = "decimal")]
    pub mean: f64,
    /// Divided by n - 1; none for one person.
    #[serde(with = "maybe_decimal")]
    pub sd: Option<f64>,
}

/// The summary of sorted episodes.
///
/// - `few`: whether a person's episodes are reported apart.
pub fn summary(episodes: &[EpisodeRow], few: impl Fn(&EpisodeRow) -> bool) -> Vec<SummaryRow> {
    let mut groups: BTreeMap<(&str, &str, u32, &'static str), Vec<f64>> = BTreeMap::new();
    for row in episodes {
        let types = match few(row) {
            true => vec![FEW],
            false => vec![ALL, &row.task_type],
        };
        for task_type in types {
            for (measure, value) in MEASURES {
                let Some(value) = value(row) else { continue };
                let key = (row.condition.as_str(), task_type, row.episode, measure);
                groups.entry(key).or_default().push(value);
            }
        }
    }
    let row = |((condition, task_type, episode, measure), values): (_, Vec<f64>)| {
        let (condition, task_type, measure): (&str, &str, &str) = (condition, task_type, measure);
        let (mean, sd) = spread(&values);
        SummaryRow {
            condition: condition.to_owned(),
            task_type: task_type.to_owned(),
            episode,
            measure: measure.to_owned(),
            users: values.len() as u32,
            mean,
            sd,
        }
    };
    groups.into_iter().map(row).collect()
}

/// Mean and sample standard deviation of at least one value.
fn spread(values: &[f64]) -> (f64, Option<f64>) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    (mean, (values.len() > 1).then(|| (squares / (n - 1.0)).sqrt()))
}

#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct AnsweredRow {
    #[serde(with = "text")]
    pub condition: String,
    #[serde(with = "text")]
    pub answered_by: String,
    pub parses: u32,
    /// Of the condition's parses.
    #[serde(with = "decimal")]
    pub share: f64,
}

/// Who gave how many of the programs, carried out or impossible.
pub fn answered(utterances: &[UtteranceRow]) -> Vec<AnsweredRow> {
    let mut counts: BTreeMap<(&str, &str), u32> = BTreeMap::new();
    let mut all: BTreeMap<&str, u32> = BTreeMap::new();
    for row in utterances.iter().filter(|row| !row.answered_by.is_empty()) {
        *counts.entry((&row.condition, &row.answered_by)).or_default() += 1;
        *all.entry(&row.condition).or_default() += 1;
    }
    let row = |((condition, answered_by), parses): ((&str, &str), u32)| AnsweredRow {
        condition: condition.to_owned(),
        answered_by: answered_by.to_owned(),
        parses,
        share: f64::from(parses) / f64::from(all[condition]),
    };
    counts.into_iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_is_that_of_a_sample_and_none_of_one_value() {
        assert_eq!(spread(&[2.0]), (2.0, None));
        let (mean, sd) = spread(&[1.0, 2.0, 3.0, 6.0]);
        assert_eq!(mean, 3.0);
        assert!((sd.unwrap() - (14.0f64 / 3.0).sqrt()).abs() < 1e-12);
    }

    fn episode(task_type: &str, user: &str, utterances: u32, wrong: u32) -> EpisodeRow {
        EpisodeRow {
            condition: "paper".to_owned(),
            task_type: task_type.to_owned(),
            user: user.to_owned(),
            episode: 1,
            goal: String::new(),
            utterances,
            understood: utterances,
            not_sure: 0,
            impossible: 0,
            wrong,
            primitives: utterances,
            fewest_actions: Some(4),
            normalised_length: Some(f64::from(utterances) / 4.0),
            complexity: Some(1.0),
            examples_taught: 44,
            finished: true,
            first_tries: (0, 0),
            reuses: (0, 0),
        }
    }

    #[test]
    fn people_are_summed_up_by_type_over_all_and_those_with_few_episodes_apart() {
        let episodes =
            [episode("cool", "a", 4, 1), episode("cool", "b", 8, 0), episode("look", "c", 2, 1)];
        let rows = summary(&episodes, |row| row.user == "c");
        let find = |task_type: &str, measure: &str| {
            let of = |row: &&SummaryRow| row.task_type == task_type && row.measure == measure;
            rows.iter().find(of).map(|row| (row.users, row.mean))
        };
        assert_eq!(find(ALL, "wrong_rate"), Some((2, 0.125)));
        assert_eq!(find("cool", "normalised_length"), Some((2, 1.5)));
        assert_eq!(find(FEW, "wrong_rate"), Some((1, 0.5)));
        assert_eq!(find("look", "wrong_rate"), None);
        // Nobody tried anything new, and nobody could re-use anything.
        assert_eq!(find(ALL, "understood_first_try"), None);
        assert_eq!(find(ALL, "reuse_rate"), None);
        assert!(rows.is_sorted_by_key(|row| (
            row.task_type.clone(),
            row.episode,
            row.measure.clone()
        )));
    }
}
