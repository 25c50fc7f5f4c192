//! Episodes in which one sentence is taught, and what is understood after it. The protocols
//! *one-shot* and *goals* differ only in what is taught.

use std::collections::BTreeMap;

use apprentice::learning::{TrainError, train};
use apprentice::parallel::in_order;
use apprentice::world::household::Household;
use serde::Serialize;

use super::corpus::Row;
use super::episode::{Episode, Tests, run};
use super::failures::Failure;
use super::figures::{Reasons, Spread};
use super::report::{Base, Setting};
use super::scenes::Stages;
use super::seeds;

/// Episodes of each seed, without a limit.
pub const EPISODES: usize = 24;

/// What may be taught and what is asked.
pub struct Material<'a> {
    pub protocol: &'a str,
    /// What a lesson is about, with all its sentences. A sentence of one is a distractor to the
    /// others.
    pub groups: Vec<(&'a str, Vec<&'a Row>)>,
    /// Sentences for one primitive each; the seeds' own are asked where there is none.
    pub primitives: Vec<&'a Row>,
}

/// What the protocol found. Each figure is over episodes: in how large a part of its sentences an
/// episode did well.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LessonsReport {
    #[serde(flatten)]
    pub base: Base,
    pub episodes: usize,
    /// Sentences taught in each.
    pub lessons: usize,
    /// Whether all were one person's: `one` or `several`.
    pub teachers: String,
    /// Lessons that could not be learned; the mind of before was asked then.
    pub trainings_failed: BTreeMap<String, usize>,
    #[serde(flatten)]
    pub figures: Figures,
    pub by_action: BTreeMap<String, Figures>,
    /// Why not right, by figure and verdict.
    pub reasons: BTreeMap<String, Reasons>,
    #[serde(skip)]
    pub failures: BTreeMap<String, Vec<Failure>>,
    /// Failures without their sentences, by figure.
    #[serde(skip)]
    pub cases: BTreeMap<&'static str, Vec<Failure>>,
}

/// The figures of some episodes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Figures {
    /// The taught sentence about another thing: right.
    pub same_sentence: Spread,
    /// The teacher's other sentences: right.
    pub same_person: Spread,
    /// Of the next, those of at most ten words without a conjunction.
    pub others_short: Spread,
    /// Other people's sentences: right.
    pub others: Spread,
    /// Other people's sentences: carried out as something else.
    pub others_wrong: Spread,
    /// Sentences for the other actions: taken for this one.
    pub distractors_accepted: Spread,
    /// Of those, the ones of at most ten words without a conjunction.
    pub distractors_short_accepted: Spread,
    /// Sentences for a primitive: still right.
    pub primitives_right: Spread,
    /// Of the sentences of all these kinds that were carried out as the lesson, those that meant
    /// it. What repeats the taught sentence does not count.
    pub lesson_precision: Spread,
}

impl Figures {
    fn of<'e>(episodes: impl Iterator<Item = &'e Episode> + Clone) -> Figures {
        let spread = |share: fn(&Episode) -> Option<f64>| {
            Spread::of(&episodes.clone().filter_map(share).collect::<Vec<f64>>())
        };
        Figures {
            same_sentence: spread(|e| e.same_sentence.right()),
            same_person: spread(|e| e.same_person.right()),
            others_short: spread(|e| e.others.short().right()),
            others: spread(|e| e.others.right()),
            others_wrong: spread(|e| e.others.wrong()),
            distractors_accepted: spread(|e| e.distractors.accepted()),
            distractors_short_accepted: spread(|e| e.distractors.short().accepted()),
            primitives_right: spread(|e| e.primitives.right()),
            lesson_precision: spread(Episode::lesson_precision),
        }
    }
}

/// Runs the protocol.
///
/// - errors: the training without any lesson fails. One that fails with a lesson is counted.
pub fn lessons(
    setting: &Setting<'_>,
    material: &Material<'_>,
) -> Result<LessonsReport, TrainError> {
    let household = Household::new();
    let stages = Stages::new(&household).staged(setting.staging);
    let mut base = Base::new(material.protocol, setting);
    let mut episodes = Vec::new();
    for &seed in setting.seeds {
        let recipe = setting.recipe.reseeded(seed);
        let before = train(&household, &recipe, &[])?;
        let own = seeds_when_needed(&household, &stages, material, seed);
        let primitives: Vec<&Row> = match own.is_empty() {
            true => material.primitives.clone(),
            false => own.iter().collect(),
        };
        let tests = Tests {
            household: &household,
            stages: &stages,
            recipe: &recipe,
            before: &before,
            groups: &material.groups,
            primitives: &primitives,
            seed,
            lessons: setting.lessons,
            teachers: setting.teachers,
        };
        let numbers: Vec<usize> = (0..setting.limit.unwrap_or(EPISODES)).collect();
        let of_seed =
            in_order(setting.threads, setting.progress, &numbers, |number| run(&tests, *number));
        episodes.extend(of_seed.into_iter().flatten());
    }
    let mut trainings_failed = BTreeMap::new();
    let mut reasons: BTreeMap<String, Reasons> = BTreeMap::new();
    let mut failures = BTreeMap::new();
    let mut cases = BTreeMap::new();
    for episode in &episodes {
        if let Some(reason) = &episode.training_failed {
            *trainings_failed.entry(reason.clone()).or_default() += 1;
        }
        for reason in &episode.unstaged {
            base.unstaged.add(reason.clone());
        }
    }
    for (name, figure) in Episode::FIGURES {
        let failed = || episodes.iter().flat_map(|episode| figure(episode).failures());
        let mut counted = Reasons::default();
        failed().for_each(|failure| counted.add(failure.verdict, &failure.reason));
        reasons.insert(name.to_owned(), counted);
        cases.insert(name, Failure::draw(failed(), name, setting.cases));
        failures.insert(name.to_owned(), Failure::choose(failed().cloned(), setting.failures));
    }
    let by_action = material.groups.iter().map(|(group, _)| {
        let of_group = episodes.iter().filter(|episode| episode.group == *group);
        ((*group).to_owned(), Figures::of(of_group))
    });
    Ok(LessonsReport {
        base,
        episodes: episodes.len(),
        lessons: setting.lessons,
        teachers: setting.teachers.to_string(),
        trainings_failed,
        figures: Figures::of(episodes.iter()),
        by_action: by_action.collect(),
        reasons,
        failures,
        cases,
    })
}

fn seeds_when_needed(
    household: &Household,
    stages: &Stages<'_>,
    material: &Material<'_>,
    seed: u64,
) -> Vec<Row> {
    match material.primitives.is_empty() {
        true => seeds::rows(household, stages, seed),
        false => Vec::new(),
    }
}

/// The sentences of each of these labels.
pub fn groups<'a>(labels: &[&'a str], rows: &'a [Row]) -> Vec<(&'a str, Vec<&'a Row>)> {
    let of = |label: &'a str| (label, rows.iter().filter(|row| row.label == label).collect());
    labels.iter().map(|label| of(label)).collect()
}
