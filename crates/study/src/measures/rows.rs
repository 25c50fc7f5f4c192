//! One person's records and journal as rows.

use std::collections::{BTreeMap, BTreeSet};

use apprentice::events::{Ending, EpisodeStarted, Event, Interpreted, Record};
use apprentice::language::{Answerer, Outcome, Program, Step, Symbol};
use apprentice::learning::Recipe;
use apprentice::learning::recipe::ParserKind;
use apprentice::world::household::{Household, Scene, Task};
use apprentice::world::{Words, World};
use serde::{Deserialize, Serialize};

use crate::cells::{bit, maybe_bit, maybe_decimal, text};
use crate::participant::{Turn, carried_out_as_meant};

/// One finished episode in a participant's journal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Counted from 1.
    pub episode: u32,
    pub task_type: String,
    /// Primitives of the recorded demonstration, for tasks that the planner has no goal of.
    pub recorded: Option<u32>,
    pub turns: Vec<Turn>,
}

/// One participant in one condition.
pub struct Life<'a> {
    pub condition: &'a str,
    pub user: &'a str,
    /// The person's whole stream.
    pub records: &'a [Record],
    /// Finished episodes from the first on.
    pub journal: &'a [Entry],
}

/// Log and journal do not belong together.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the records of {user} in condition {condition} do not match the journal: {reason}")]
pub struct LifeError {
    pub condition: String,
    pub user: String,
    pub reason: String,
}

/// How an utterance was answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Heard {
    Understood,
    Impossible,
    #[default]
    NotSure,
    /// The robot asked which was meant.
    Asked,
    /// It was a question, or needed no act.
    Told,
}

impl From<&Outcome> for Heard {
    fn from(outcome: &Outcome) -> Heard {
        match outcome {
            Outcome::Understood { .. } => Heard::Understood,
            Outcome::Impossible { .. } => Heard::Impossible,
            Outcome::NotSure => Heard::NotSure,
            Outcome::Asked { .. } => Heard::Asked,
            Outcome::Told { .. } => Heard::Told,
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct UtteranceRow {
    #[serde(with = "text")]
    pub condition: String,
    #[serde(with = "text")]
    pub task_type: String,
    #[serde(with = "text")]
    pub user: String,
    pub episode: u32,
    pub turn: u32,
    #[serde(with = "text")]
    pub utterance: String,
    pub outcome: Heard,
    /// Empty when nobody answered.
    #[serde(with = "text")]
    pub answered_by: String,
    #[serde(with = "bit")]
    pub guessed: bool,
    #[serde(with = "text")]
    pub meant: String,
    /// None where nothing was carried out.
    #[serde(with = "maybe_bit")]
    pub right: Option<bool>,
    pub primitives: u32,
    #[serde(with = "bit")]
    pub taught: bool,
    /// Not because something bigger or said otherwise was not understood. No column of the table.
    #[serde(skip)]
    pub first: bool,
    /// Of the same kind as something taught in an earlier episode. No column of the table.
    #[serde(skip)]
    pub reuses: bool,
}

#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct EpisodeRow {
    #[serde(with = "text")]
    pub condition: String,
    #[serde(with = "text")]
    pub task_type: String,
    #[serde(with = "text")]
    pub user: String,
    pub episode: u32,
    #[serde(with = "text")]
    pub goal: String,
    pub utterances: u32,
    pub understood: u32,
    pub not_sure: u32,
    pub impossible: u32,
    pub wrong: u32,
    pub primitives: u32,
    pub fewest_actions: Option<u32>,
    #[serde(with = "maybe_decimal")]
    pub normalised_length: Option<f64>,
    #[serde(with = "maybe_decimal")]
    pub complexity: Option<f64>,
    pub examples_taught: u32,
    #[serde(with = "bit")]
    pub finished: bool,
    /// Tries of something new, and how many of them were right. No columns of the table.
    #[serde(skip)]
    pub first_tries: (u32, u32),
    /// Requests for what was taught before, and how many were right. No columns of the table.
    #[serde(skip)]
    pub reuses: (u32, u32),
}

/// The rows of the episodes that the journal holds.
///
/// - errors: the journal tells of what the records do not have.
pub fn rows_of(
    household: &Household,
    life: &Life<'_>,
) -> Result<(Vec<UtteranceRow>, Vec<EpisodeRow>), LifeError> {
    let mut reader = Reader::new(household, life);
    for record in life.records {
        reader.read(record).map_err(|reason| LifeError {
            condition: life.condition.to_owned(),
            user: life.user.to_owned(),
            reason,
        })?;
    }
    reader.close();
    match reader.episodes.len() == life.journal.len() {
        true => Ok((reader.utterances, reader.episodes)),
        false => Err(LifeError {
            condition: life.condition.to_owned(),
            user: life.user.to_owned(),
            reason: format!(
                "it has {} finished episodes, the log {}",
                life.journal.len(),
                reader.episodes.len()
            ),
        }),
    }
}

struct Reader<'a> {
    household: &'a Household,
    life: &'a Life<'a>,
    parser: Option<ParserKind>,
    present: Option<Present<'a>>,
    /// Live lessons, by the record that taught them.
    lessons: BTreeMap<u64, (String, Program)>,
    /// What was taught before the present episode.
    known: Vec<Program>,
    utterances: Vec<UtteranceRow>,
    episodes: Vec<EpisodeRow>,
    started: u32,
}

struct Present<'a> {
    entry: &'a Entry,
    started: &'a EpisodeStarted,
    scene: Scene,
    task: Task,
    turn: u32,
    finished: bool,
    /// Where the episode's rows begin.
    first_row: usize,
    /// From the record of an utterance to its row.
    rows: BTreeMap<u64, usize>,
}

impl<'a> Reader<'a> {
    fn new(household: &'a Household, life: &'a Life<'a>) -> Reader<'a> {
        Reader {
            household,
            life,
            parser: None,
            present: None,
            lessons: BTreeMap::new(),
            known: Vec::new(),
            utterances: Vec::new(),
            episodes: Vec::new(),
            started: 0,
        }
    }

    fn read(&mut self, record: &'a Record) -> Result<(), String> {
        match &record.event {
            Event::SessionOpened(event) => {
                let recipe = Recipe::parse(&event.recipe_text).map_err(|e| e.to_string())?;
                self.parser = Some(recipe.settings().parser.kind);
            }
            Event::EpisodeStarted(event) => {
                self.close();
                self.started += 1;
                // What follows the last finished episode is not part of the study yet.
                let number = self.started;
                let entry = self.life.journal.iter().find(|entry| entry.episode == number);
                let Some(entry) = entry else { return Ok(()) };
                self.present = Some(Present {
                    entry,
                    started: event,
                    scene: event.scene.decode()?,
                    task: event.task.decode()?,
                    turn: 0,
                    finished: false,
                    first_row: self.utterances.len(),
                    rows: BTreeMap::new(),
                });
            }
            Event::Interpreted(event) => self.interpreted(record.seq.get(), event)?,
            Event::EpisodeEnded(event) => {
                if let Some(present) = &mut self.present {
                    present.finished = event.ending == Ending::Achieved;
                }
            }
            Event::DecompositionTaught(event) => {
                let utterance = event.utterance.to_string();
                self.lessons.insert(record.seq.get(), (utterance, event.program.clone()));
                let row = self.present.as_ref().and_then(|p| p.rows.get(&event.explains.get()));
                if let Some(row) = row {
                    self.utterances[*row].taught = true;
                }
            }
            Event::LessonForgotten(event) => {
                self.lessons.remove(&event.lesson.get());
            }
            _ => {}
        }
        Ok(())
    }

    fn interpreted(&mut self, seq: u64, event: &Interpreted) -> Result<(), String> {
        let Some(present) = &mut self.present else { return Ok(()) };
        let turn = present.entry.turns.iter().find(|turn| turn.seq == seq);
        let turn = turn.ok_or_else(|| format!("it lacks the utterance of record {seq}"))?;
        present.turn += 1;
        let before = present.scene.clone();
        let mut right = None;
        let outcome = Heard::from(&event.answer.outcome);
        let mut primitives = 0;
        let mut answered_by = String::new();
        if let Outcome::Understood { program, .. } | Outcome::Impossible { program, .. } =
            &event.answer.outcome
        {
            let parser = self.parser.ok_or("the stream has no recipe")?;
            answered_by = answerer(parser, &event.answer.evidence.answered_by);
            if outcome == Heard::Understood {
                primitives = program.steps.len() as u32;
                for (index, step) in program.steps.iter().enumerate() {
                    let on = event.answer.chosen_for(index);
                    self.household
                        .step_on(&mut present.scene, &present.task, step, on)
                        .map_err(|error| format!("record {seq} did {step}, but {error}"))?;
                }
                right = Some(carried_out_as_meant(
                    self.household,
                    &present.task,
                    &before,
                    &turn.meant,
                    &present.scene,
                ));
            }
        }
        present.rows.insert(seq, self.utterances.len());
        let reuses = turn.first && self.known.iter().any(|lesson| alike(lesson, &turn.meant));
        self.utterances.push(UtteranceRow {
            condition: self.life.condition.to_owned(),
            task_type: present.entry.task_type.clone(),
            user: self.life.user.to_owned(),
            episode: present.entry.episode,
            turn: present.turn,
            utterance: event.utterance.to_string(),
            outcome,
            answered_by,
            guessed: event.answer.guessed(),
            meant: turn.meant.to_string(),
            right,
            primitives,
            taught: false,
            first: turn.first,
            reuses,
        });
        Ok(())
    }

    /// The row of the episode that is over, teaching included.
    fn close(&mut self) {
        let Some(present) = self.present.take() else { return };
        let rows = &self.utterances[present.first_row..];
        let count = |wanted: &dyn Fn(&UtteranceRow) -> bool| {
            rows.iter().filter(|row| wanted(row)).count() as u32
        };
        let heard = |how: Heard| count(&|row| row.outcome == how);
        let right = |row: &UtteranceRow| row.right == Some(true);
        let utterances = rows.len() as u32;
        let primitives = rows.iter().map(|row| row.primitives).sum();
        let fewest = present.started.fewest.or(present.entry.recorded);
        let ratio = |part: u32, whole: u32| (whole > 0).then(|| f64::from(part) / f64::from(whole));
        let unique: BTreeSet<&(String, Program)> = self.lessons.values().collect();
        let seeds = self.household.seeds().exemplars.len();
        self.episodes.push(EpisodeRow {
            condition: self.life.condition.to_owned(),
            task_type: present.entry.task_type.clone(),
            user: self.life.user.to_owned(),
            episode: present.entry.episode,
            goal: present.started.goal.clone(),
            utterances,
            understood: heard(Heard::Understood),
            not_sure: heard(Heard::NotSure),
            impossible: heard(Heard::Impossible),
            wrong: count(&|row| row.right == Some(false)),
            primitives,
            fewest_actions: fewest,
            normalised_length: fewest.and_then(|fewest| ratio(utterances, fewest)),
            complexity: ratio(primitives, utterances),
            examples_taught: (seeds + unique.len()) as u32,
            finished: present.finished,
            first_tries: (count(&|row| row.first), count(&|row| row.first && right(row))),
            reuses: (count(&|row| row.reuses), count(&|row| row.reuses && right(row))),
        });
        self.known = self.lessons.values().map(|(_, program)| program.clone()).collect();
    }
}

/// Which part of the parser gave a program; of several clauses each part once.
fn answerer(parser: ParserKind, parts: &[Answerer]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for part in parts {
        let name = match part {
            Answerer::Grammar => "grammar",
            Answerer::Seq2seq => "model",
        };
        if !names.contains(&name) {
            names.push(name);
        }
    }
    if !names.is_empty() {
        return names.join("+");
    }
    match parser {
        ParserKind::Exemplar => "exemplar",
        ParserKind::Features => "features",
        ParserKind::Grammar => "grammar",
        ParserKind::Seq2seq | ParserKind::Backed => "model",
    }
    .to_owned()
}

/// Whether something meant is what a lesson stands for, with other things: the same picking up,
/// putting and switching in the same order, one thing wherever the lesson has one thing. Lessons for
/// a single primitive do not count: seeds say those.
fn alike(lesson: &Program, meant: &Program) -> bool {
    let handled = |program: &Program| -> Vec<Step> {
        let handles = |step: &&Step| matches!(step.operator.as_str(), "PICKUP" | "PUT" | "TOGGLE");
        program.steps.iter().filter(handles).cloned().collect()
    };
    let (lesson, meant) = (handled(lesson), handled(meant));
    let mut pairs: Vec<(&Symbol, &Symbol)> = Vec::new();
    lesson.len() >= 2
        && lesson.len() == meant.len()
        && lesson.iter().zip(&meant).all(|(one, other)| {
            one.operator == other.operator
                && one.args.iter().zip(&other.args).all(|(from, to)| {
                    match pairs.iter().find(|(known, _)| *known == from) {
                        Some((_, also)) => *also == to,
                        None => {
                            pairs.push((from, to));
                            true
                        }
                    }
                })
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lesson_is_alike_with_other_things_and_not_with_other_deeds() {
        let wash = "PUT Mug SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Mug";
        let check = |meant: &str, expected: bool| {
            let (lesson, meant) = (wash.parse().unwrap(), meant.parse().unwrap());
            assert_eq!(alike(&lesson, &meant), expected, "{meant}");
        };
        check(wash, true);
        check("GOTO SinkBasin; PUT Egg SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Egg", true);
        check("PUT Egg SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Mug", false);
        check("PUT Egg SinkBasin; TOGGLE Faucet; PICKUP Egg", false);
        let one: Program = "GOTO Mug; PICKUP Mug".parse().unwrap();
        assert!(!alike(&one, &one));
    }

    #[test]
    fn several_parts_are_named_once_each() {
        use Answerer::{Grammar, Seq2seq};
        assert_eq!(answerer(ParserKind::Backed, &[Grammar, Seq2seq, Grammar]), "grammar+model");
        assert_eq!(answerer(ParserKind::Exemplar, &[]), "exemplar");
    }
}
