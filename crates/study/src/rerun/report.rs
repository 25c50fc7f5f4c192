//! What a rerun found: differences turn by turn, and what they come to.

use std::collections::{BTreeMap, BTreeSet};

use apprentice::ids::{Digest, TenantId, UserId};
use apprentice::language::{Outcome, Program};
use serde::Serialize;

use super::configuration::{Other, Variant};
use super::minds::MindCounts;
use super::walk::{Episode, Life};

/// What a rerun of thresholds holds fixed.
const HOLDS_MINDS: &str = "the recorded minds; their threshold alone is replaced, and nothing is \
                           trained under another configuration";
/// What a rerun of recipes holds fixed.
const HOLDS_LESSONS: &str = "the recorded lessons; at each moment a mind of the other recipe \
                             answers, trained on those that were live then";

/// Everything a rerun found. Holds no time and no path: equal stores give equal reports.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// What stays as it was recorded.
    pub holds: &'static str,
    pub people: usize,
    pub episodes: usize,
    pub turns: usize,
    pub minds: MindCounts,
    pub left_out: Vec<LeftOut>,
    pub variants: Vec<VariantReport>,
}

/// A person whose records say nothing here.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    pub tenant: TenantId,
    /// None when nobody can tell.
    pub user: Option<UserId>,
    pub why: String,
    /// Whether something is wrong with the records.
    pub is_fault: bool,
}

/// One other configuration against the recorded one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VariantReport {
    pub name: String,
    /// Its recipe, where it has one of its own.
    pub recipe_digest: Option<Digest>,
    /// Turns up to the end of the open loop in each episode, that turn included: their moments are
    /// those that the other configuration would have met, given the recorded lessons.
    pub up_to_the_end: Figures,
    /// All recorded turns, also those whose scene the other configuration would not have met.
    pub over_all_turns: Figures,
    pub episodes: EpisodeFigures,
    pub people: Vec<PersonReport>,
}

/// Counts and measures over some turns.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Figures {
    pub turns: usize,
    pub same: usize,
    pub different: usize,
    pub became_understood: usize,
    pub became_not_sure: usize,
    pub became_impossible: usize,
    pub another_program: usize,
    pub recorded: Side,
    pub other: Side,
    /// Examples at the end of a person's records, seeds included; see `recorded` of the same name
    /// in [`Examples`].
    pub examples_taught: Examples,
}

/// One configuration's answers over some turns.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Side {
    pub understood: usize,
    pub not_sure: usize,
    pub impossible: usize,
    /// Primitives carried out per utterance, on average; what is not understood counts 0.
    pub complexity: f64,
}

/// The measure *examples taught*, as far as recorded turns can tell: nobody knows what a person
/// would have taught who was answered otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Examples {
    /// Seeds and distinct (utterance, program) pairs live at the end, on average over people.
    pub recorded: f64,
    /// The same without the needless ones.
    pub other: f64,
    /// Recorded lessons, distinct pairs, whose utterance the other configuration answers with the
    /// very program that was then taught.
    pub needless: usize,
    /// Utterances carried out in the records that the other configuration would not carry out: they
    /// would have been open to teaching.
    pub newly_open: usize,
}

/// Episodes, and what is known of the measure *normalised episode length* (utterances / fewest
/// primitives).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct EpisodeFigures {
    pub episodes: usize,
    /// Those in which some action differs: there the loop ends, and how many utterances the episode
    /// would have taken is unknown from that turn on.
    pub loop_ends: usize,
    /// The turn at which it ends, on average over these.
    pub loop_end_turn: Option<f64>,
    /// Over all episodes that have a plan.
    pub normalised_length_recorded: Option<f64>,
    /// Over those among them whose loop never ends, in which the other configuration's is the same.
    pub normalised_length_unchanged: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PersonReport {
    pub tenant: TenantId,
    pub user: UserId,
    /// The recipe that was recorded.
    pub recorded_recipe: String,
    /// Episodes with a difference.
    pub episodes: Vec<EpisodeReport>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EpisodeReport {
    pub episode: u32,
    pub goal: String,
    pub turns: usize,
    /// The first turn whose action differs, counted from 1; none when the loop never ends.
    pub loop_ends_at_turn: Option<usize>,
    pub differences: Vec<Difference>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// The record.
    pub seq: u64,
    /// Counted from 1 within the episode.
    pub turn: usize,
    pub utterance: String,
    pub change: Change,
    pub recorded: Outcome,
    pub other: Outcome,
    /// Whether the other configuration would have met this moment.
    pub before_the_loop_ended: bool,
}

/// How an answer differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Change {
    Same,
    BecameUnderstood,
    BecameNotSure,
    BecameImpossible,
    AnotherProgram,
}

impl Change {
    pub fn of(recorded: &Outcome, other: &Outcome) -> Change {
        match (recorded, other) {
            _ if recorded == other => Change::Same,
            (Outcome::Understood { .. }, Outcome::Understood { .. })
            | (Outcome::Impossible { .. }, Outcome::Impossible { .. }) => Change::AnotherProgram,
            (_, Outcome::Understood { .. }) => Change::BecameUnderstood,
            (_, Outcome::NotSure | Outcome::Asked { .. } | Outcome::Told { .. }) => {
                Change::BecameNotSure
            }
            (_, Outcome::Impossible { .. }) => Change::BecameImpossible,
        }
    }

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Change::Same => "same",
            Change::BecameUnderstood => "became_understood",
            Change::BecameNotSure => "became_not_sure",
            Change::BecameImpossible => "became_impossible",
            Change::AnotherProgram => "another_program",
        }
    }
}

impl Report {
    /// - `seeds`: exemplars that everybody starts with.
    pub(super) fn of(
        variants: &[Variant],
        lives: &[Life],
        left_out: Vec<LeftOut>,
        seeds: usize,
    ) -> Report {
        let mut minds = MindCounts::default();
        lives.iter().for_each(|life| minds.add(&life.minds));
        let episodes = || lives.iter().flat_map(|life| &life.episodes);
        let thresholds = variants.iter().all(|v| matches!(v.other, Other::Threshold(_)));
        let numbered = variants.iter().enumerate();
        Report {
            holds: if thresholds { HOLDS_MINDS } else { HOLDS_LESSONS },
            people: lives.len(),
            episodes: episodes().count(),
            turns: episodes().map(|episode| episode.turns.len()).sum(),
            minds,
            left_out,
            variants: numbered
                .map(|(number, variant)| VariantReport {
                    name: variant.name.clone(),
                    recipe_digest: match &variant.other {
                        Other::Recipe(recipe) => Some(recipe.digest()),
                        Other::Threshold(_) => None,
                    },
                    up_to_the_end: Figures::of(lives, number, Scope::UpToTheEnd, seeds),
                    over_all_turns: Figures::of(lives, number, Scope::AllTurns, seeds),
                    episodes: EpisodeFigures::of(episodes(), number),
                    people: lives.iter().map(|life| person(life, number)).collect(),
                })
                .collect(),
        }
    }
}

/// Which turns count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Scope {
    UpToTheEnd,
    AllTurns,
}

impl Figures {
    fn of(lives: &[Life], variant: usize, scope: Scope, seeds: usize) -> Figures {
        let mut figures = Figures::default();
        let (mut done, mut would) = (0, 0);
        let (mut examples, mut fewer) = (0, 0);
        for life in lives {
            // What each utterance would have been answered, by its record.
            let mut answers: BTreeMap<u64, &Outcome> = BTreeMap::new();
            for episode in &life.episodes {
                for (place, turn) in episode.turns.iter().enumerate() {
                    if scope == Scope::UpToTheEnd && !episode.is_closed(variant, place) {
                        continue;
                    }
                    let other = &turn.others[variant];
                    answers.insert(turn.seq.get(), other);
                    figures.count(Change::of(&turn.recorded, other));
                    figures.recorded.count(&turn.recorded);
                    figures.other.count(other);
                    done += primitives(&turn.recorded);
                    would += primitives(other);
                    let carried_out = |outcome: &Outcome| carried_out(outcome).is_some();
                    figures.examples_taught.newly_open +=
                        usize::from(carried_out(&turn.recorded) && !carried_out(other));
                }
            }
            let needless = |taught: &&super::walk::Taught| {
                let answer = answers.get(&taught.explains.get());
                answer.and_then(|outcome| carried_out(outcome)) == Some(&taught.program)
            };
            let pairs = |needed_only: bool| {
                let kept = life.live.iter().filter(|taught| !needed_only || !needless(taught));
                let pairs = kept.map(|taught| (&taught.utterance, &taught.program));
                pairs.collect::<BTreeSet<(&String, &Program)>>().len()
            };
            let (all, needed) = (pairs(false), pairs(true));
            figures.examples_taught.needless += all - needed;
            examples += seeds + all;
            fewer += seeds + needed;
        }
        figures.recorded.complexity = mean(done, figures.turns);
        figures.other.complexity = mean(would, figures.turns);
        figures.examples_taught.recorded = mean(examples, lives.len());
        figures.examples_taught.other = mean(fewer, lives.len());
        figures
    }

    fn count(&mut self, change: Change) {
        self.turns += 1;
        self.different += usize::from(change != Change::Same);
        *match change {
            Change::Same => &mut self.same,
            Change::BecameUnderstood => &mut self.became_understood,
            Change::BecameNotSure => &mut self.became_not_sure,
            Change::BecameImpossible => &mut self.became_impossible,
            Change::AnotherProgram => &mut self.another_program,
        } += 1;
    }
}

impl Side {
    fn count(&mut self, outcome: &Outcome) {
        *match outcome {
            Outcome::Understood { .. } => &mut self.understood,
            Outcome::Impossible { .. } => &mut self.impossible,
            Outcome::NotSure | Outcome::Asked { .. } | Outcome::Told { .. } => &mut self.not_sure,
        } += 1;
    }
}

impl EpisodeFigures {
    fn of<'a>(episodes: impl Iterator<Item = &'a Episode>, variant: usize) -> EpisodeFigures {
        let mut figures = EpisodeFigures::default();
        let (mut ends, mut lengths, mut unchanged) = (Vec::new(), Vec::new(), Vec::new());
        for episode in episodes {
            figures.episodes += 1;
            let end = episode.ends[variant];
            ends.extend(end.map(|index| index as f64 + 1.0));
            if let Some(fewest) = episode.fewest.filter(|fewest| *fewest > 0) {
                let length = episode.turns.len() as f64 / f64::from(fewest);
                lengths.push(length);
                unchanged.extend(end.is_none().then_some(length));
            }
        }
        let mean = |values: &[f64]| {
            (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
        };
        figures.loop_ends = ends.len();
        figures.loop_end_turn = mean(&ends);
        figures.normalised_length_recorded = mean(&lengths);
        figures.normalised_length_unchanged = mean(&unchanged);
        figures
    }
}

fn person(life: &Life, variant: usize) -> PersonReport {
    let episode = |episode: &Episode| {
        let numbered = episode.turns.iter().enumerate();
        let differences = numbered.filter_map(|(place, turn)| {
            let other = &turn.others[variant];
            let change = Change::of(&turn.recorded, other);
            (change != Change::Same).then(|| Difference {
                seq: turn.seq.get(),
                turn: place + 1,
                utterance: turn.utterance.clone(),
                change,
                recorded: turn.recorded.clone(),
                other: other.clone(),
                before_the_loop_ended: episode.is_closed(variant, place),
            })
        });
        EpisodeReport {
            episode: episode.number,
            goal: episode.goal.clone(),
            turns: episode.turns.len(),
            loop_ends_at_turn: episode.ends[variant].map(|index| index + 1),
            differences: differences.collect(),
        }
    };
    let episodes = life.episodes.iter().map(episode);
    PersonReport {
        tenant: life.tenant.clone(),
        user: life.user.clone(),
        recorded_recipe: life.recipe.clone(),
        episodes: episodes.filter(|episode| !episode.differences.is_empty()).collect(),
    }
}

fn carried_out(outcome: &Outcome) -> Option<&Program> {
    match outcome {
        Outcome::Understood { program, .. } => Some(program),
        _ => None,
    }
}

fn primitives(outcome: &Outcome) -> usize {
    carried_out(outcome).map_or(0, |program| program.steps.len())
}

/// 0 of nothing.
fn mean(sum: usize, count: usize) -> f64 {
    if count == 0 { 0.0 } else { sum as f64 / count as f64 }
}
