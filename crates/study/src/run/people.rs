//! Who takes part and what each of them will be asked to do; the same in every condition.

use std::collections::BTreeMap;

use apprentice::language::{Program, Step, Utterance};
use apprentice::parallel::in_order;
use apprentice::world::household::{Household, Kind, Room, Scene, Task};
use apprentice::world::{Stage, World};

use super::scene_text::scene_file;
use crate::corpus::{Corpus, Row};
use crate::draw;
use crate::participant::Said;
use crate::scenes::{Clashes, Stages};

/// Tasks drawn for one episode before the form is given up.
const DRAWS_MAX: usize = 200;
/// Draws after which an episode may be about a thing that an earlier one was about.
const DRAWS_OF_OTHERS: usize = 100;

/// One participant, in every condition.
#[derive(Debug, Clone, PartialEq)]
pub struct Participant {
    /// Counted from 0; names the journal.
    pub number: usize,
    /// The user's name at the service and in the tables.
    pub user: String,
    pub episodes: Vec<Planned>,
}

/// An episode to come.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    pub task_type: String,
    /// In the domain's words.
    pub task: String,
    pub stage: Stage,
    /// Primitives of the recorded demonstration.
    pub recorded: Option<u32>,
    /// What a recorded person says; none for a simulated one.
    pub script: Option<Vec<Said>>,
}

/// Why nobody can take part.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PeopleError {
    #[error("no scene could be drawn for a task of the type {task_type} with seed {seed}")]
    NoTask { task_type: String, seed: u64 },
    #[error(
        "the corpus has no task whose steps are all there (ids are trial/annotation/step, steps \
         count from 0; {torn} tasks lack steps, {unstaged} fit no scene)"
    )]
    Nobody { torn: usize, unstaged: usize },
}

/// Simulated users: each has one task type; its episodes have different scenes and, where the type
/// has enough of them, different things.
///
/// - `users`: for each type where `per_type`, else in all, given to the types in turn.
pub fn simulated_people(
    household: &Household,
    seed: u64,
    task_types: &[String],
    (users, per_type): (usize, bool),
    episodes: u32,
    threads: usize,
) -> Result<Vec<Participant>, PeopleError> {
    let count = if per_type { users * task_types.len() } else { users };
    let numbers: Vec<usize> = (0..count).collect();
    let person = |number: &usize| {
        let (form, place) = match per_type {
            true => (&task_types[number / users], number % users),
            false => (&task_types[number % task_types.len()], number / task_types.len()),
        };
        let user = format!("{form}-{:03}", place + 1);
        let mut used: Vec<String> = Vec::new();
        let drawn = (1..=episodes).map(|episode| {
            let planned = draw_episode(household, seed, form, &user, episode, &used)?;
            used.extend(planned.task.split(' ').nth(1).map(str::to_owned));
            Ok(planned)
        });
        Ok(Participant { number: *number, episodes: drawn.collect::<Result<_, _>>()?, user })
    };
    in_order(threads, &(), &numbers, person).into_iter().collect()
}

fn draw_episode(
    household: &Household,
    seed: u64,
    form: &str,
    user: &str,
    episode: u32,
    used: &[String],
) -> Result<Planned, PeopleError> {
    let mut rng = draw::rng(seed, &["task", user, &episode.to_string()]);
    let tasks = household.recorded_tasks(form);
    for draw in 0..DRAWS_MAX {
        let task = tasks[rng.below(tasks.len())];
        let scene_seed = rng.next_u64();
        let thing = task.split(' ').nth(1).unwrap_or_default();
        if draw < DRAWS_OF_OTHERS && used.iter().any(|other| other == thing) {
            continue;
        }
        let stage = Stage::Task { task: task.to_owned(), seed: scene_seed };
        if household.stage(&stage).is_ok() {
            return Ok(Planned {
                task_type: form.to_owned(),
                task: task.to_owned(),
                stage,
                recorded: None,
                script: None,
            });
        }
    }
    Err(PeopleError::NoTask { task_type: form.to_owned(), seed })
}

/// Recorded people and what had to be left out.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recorded {
    pub people: Vec<Participant>,
    /// Tasks with a step that is missing, set aside or a bad line.
    pub torn: usize,
    /// Tasks that fit no scene.
    pub unstaged: usize,
}

/// Every annotator of the corpus who has a whole task, with at most so many, in the order of the
/// file.
pub fn recorded_people(
    household: &Household,
    seed: u64,
    corpus: &Corpus,
    episodes_max: u32,
    threads: usize,
) -> Result<Recorded, PeopleError> {
    let mut tasks: Vec<(&str, Vec<(usize, &Row)>)> = Vec::new();
    let mut places: BTreeMap<&str, usize> = BTreeMap::new();
    let mut torn = corpus.incomplete.len();
    for row in &corpus.steps {
        let Some((task, step)) = row.id.rsplit_once('/') else { continue };
        let Ok(step) = step.parse() else { continue };
        if corpus.incomplete.contains(task) {
            continue;
        }
        let place = *places.entry(task).or_insert_with(|| {
            tasks.push((task, Vec::new()));
            tasks.len() - 1
        });
        tasks[place].1.push((step, row));
    }
    let mut by_user: BTreeMap<&str, Vec<(&str, Vec<&Row>)>> = BTreeMap::new();
    for (task, mut steps) in tasks {
        steps.sort_by_key(|(number, _)| *number);
        let whole = steps.iter().enumerate().all(|(place, (number, _))| place == *number);
        let user = steps[0].1.user.as_str();
        if !whole || steps.iter().any(|(_, row)| row.user != user) {
            torn += 1;
            continue;
        }
        let rows = steps.into_iter().map(|(_, row)| row).collect();
        by_user.entry(user).or_default().push((task, rows));
    }
    let stages = Stages::new(household);
    let people: Vec<_> = by_user.into_iter().enumerate().collect();
    let made = in_order(threads, &(), &people, |(number, (user, tasks))| {
        let (mut episodes, mut unstaged) = (Vec::new(), 0);
        for (task, rows) in tasks {
            if episodes.len() == episodes_max as usize {
                break;
            }
            match plan_recorded(household, &stages, seed, task, rows) {
                Ok(planned) => episodes.push(planned),
                Err(_) => unstaged += 1,
            }
        }
        (Participant { number: *number, user: (*user).to_owned(), episodes }, unstaged)
    });
    let unstaged = made.iter().map(|(_, unstaged)| unstaged).sum();
    let people = made.into_iter().map(|(person, _)| person);
    let people: Vec<Participant> = people.filter(|person| !person.episodes.is_empty()).collect();
    match people.is_empty() {
        true => Err(PeopleError::Nobody { torn, unstaged }),
        false => Ok(Recorded { people, torn, unstaged }),
    }
}

fn plan_recorded(
    household: &Household,
    stages: &Stages<'_>,
    seed: u64,
    id: &str,
    rows: &[&Row],
) -> Result<Planned, String> {
    let steps: Vec<Step> = rows.iter().flat_map(|row| row.program.steps.clone()).collect();
    let recorded = steps.len() as u32;
    let whole = Row {
        id: id.to_owned(),
        sentence: rows[0].sentence.clone(),
        label: String::new(),
        program: Program { steps },
        room: rows[0].room,
        user: rows[0].user.clone(),
        egocentric: false,
        on: false,
        hand: None,
        next: None,
    };
    let mut rng = draw::rng(seed, &["study scene", id]);
    let scene = stages.set(&whole, Clashes::Avoided, &mut rng)?;
    let labels: Vec<&str> = rows.iter().map(|row| row.label.as_str()).collect();
    let (task, stage) = match goal(&labels, &whole.program) {
        Some(task) => with_goal(household, &scene, &whole.program, task)
            .map_or_else(|| without_goal(household, &scene, whole.room, &whole.program), Ok)?,
        None => without_goal(household, &scene, whole.room, &whole.program)?,
    };
    let said = |row: &&Row| Said {
        sentence: (!row.egocentric).then(|| Utterance::clone(&row.sentence)),
        program: row.program.clone(),
    };
    Ok(Planned {
        task_type: task.split(' ').next().unwrap_or_default().to_owned(),
        task,
        stage,
        recorded: Some(recorded),
        script: Some(rows.iter().map(said).collect()),
    })
}

/// The task that the labels and the program of a recording come to, in the domain's words.
fn goal(labels: &[&str], program: &Program) -> Option<String> {
    let puts: Vec<&Step> = program.steps.iter().filter(|step| step.operator == "PUT").collect();
    let has = |label: &str| labels.contains(&label);
    if has("ToggleObject") {
        let last = |operator: &str| {
            program.steps.iter().rev().find(|step| step.operator == operator)?.args.first()
        };
        return Some(format!("look {} {}", last("PICKUP")?, last("TOGGLE")?));
    }
    let last = puts.last()?;
    let [thing, place] = last.args.as_slice() else { return None };
    for (label, form) in [("CleanObject", "clean"), ("HeatObject", "heat"), ("CoolObject", "cool")]
    {
        if has(label) {
            return Some(format!("{form} {thing} {place}"));
        }
    }
    let inner = puts.iter().find(|put| put.args.get(1) == Some(thing));
    if let Some(inner) = inner.and_then(|put| put.args.first()) {
        return Some(format!("nested {inner} {thing} {place}"));
    }
    let same = puts.iter().filter(|put| put.args == last.args).count();
    Some(format!("{} {thing} {place}", if same > 1 { "two" } else { "place" }))
}

/// The stage with that goal, if it does not hold there yet, and what was recorded achieves it.
fn with_goal(
    household: &Household,
    scene: &Scene,
    program: &Program,
    task: String,
) -> Option<(String, Stage)> {
    let mut words = task.split(' ');
    let dirty = match (words.next(), words.next()) {
        (Some("clean"), Some(thing)) => Kind::named(thing),
        _ => None,
    };
    let stage = Stage::Scene { scene: scene_file(scene, dirty).ok()?, task: task.clone() };
    let (mut scene, goal) = household.stage(&stage).ok()?;
    if household.achieved(&scene, &goal) {
        return None;
    }
    household.plan(&scene, &goal)?;
    for step in &program.steps {
        household.step(&mut scene, &goal, step).ok()?;
    }
    household.achieved(&scene, &goal).then_some((task, stage))
}

/// The stage without a goal: the person goes through their steps and ends the episode.
fn without_goal(
    household: &Household,
    scene: &Scene,
    room: Room,
    program: &Program,
) -> Result<(String, Stage), String> {
    let task = format!("free {}", room.key());
    let stage = Stage::Scene { scene: scene_file(scene, None)?, task: task.clone() };
    let (mut scene, goal): (Scene, Task) =
        household.stage(&stage).map_err(|error| error.to_string())?;
    for step in &program.steps {
        household.step(&mut scene, &goal, step).map_err(|error| format!("{step}: {error}"))?;
    }
    Ok((task, stage))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn simulated_users_meet_other_scenes_and_things_in_each_episode() {
        let household = Household::new();
        let types = ["cool".to_owned(), "look".to_owned()];
        let people = simulated_people(&household, 3, &types, (2, true), 4, 2).unwrap();
        assert_eq!(people.len(), 4);
        let names: Vec<&str> = people.iter().map(|person| person.user.as_str()).collect();
        assert_eq!(names, ["cool-001", "cool-002", "look-001", "look-002"]);
        for person in &people {
            let mut things: Vec<&str> =
                person.episodes.iter().map(|e| e.task.split(' ').nth(1).unwrap()).collect();
            things.sort_unstable();
            things.dedup();
            assert_eq!(things.len(), 4, "{:?}", person.episodes);
        }
        assert_eq!(people, simulated_people(&household, 3, &types, (2, true), 4, 1).unwrap());
        let other = simulated_people(&household, 4, &types, (2, true), 4, 2).unwrap();
        assert_ne!(people, other);
        let spread = simulated_people(&household, 3, &types, (3, false), 1, 2).unwrap();
        let names: Vec<&str> = spread.iter().map(|person| person.user.as_str()).collect();
        assert_eq!(names, ["cool-001", "look-001", "cool-002"]);
    }

    #[test]
    fn a_recording_has_the_goal_that_its_labels_and_steps_say() {
        let check = |labels: &[&str], program: &str, expected: &str| {
            let found = goal(labels, &program.parse().unwrap());
            assert_eq!(found.as_deref(), Some(expected), "{program}");
        };
        check(&["PickupObject", "PutObject"], "PICKUP Mug; PUT Mug Shelf", "place Mug Shelf");
        check(
            &["CoolObject"],
            "PICKUP Egg; PUT Egg Fridge; PICKUP Egg; PUT Egg CounterTop",
            "cool Egg CounterTop",
        );
        check(&["PutObject"], "PUT Egg Bowl; PICKUP Bowl; PUT Bowl Shelf", "nested Egg Bowl Shelf");
        check(&["PutObject"], "PUT CD Drawer; PICKUP CD; PUT CD Drawer", "two CD Drawer");
        check(&["ToggleObject"], "PICKUP Book; TOGGLE DeskLamp", "look Book DeskLamp");
    }
}
