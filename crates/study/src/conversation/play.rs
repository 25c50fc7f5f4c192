//! Plays one transcript. After each utterance the conversation goes on from what was meant, so that
//! one wrong answer is one wrong answer.

use std::sync::Arc;

use apprentice::client::OnClash;
use apprentice::grounding::Moment;
use apprentice::language::{Answer, Outcome, Program, Step, Symbol, Utterance};
use apprentice::learning::{Lesson, Mind, Recipe, train};
use apprentice::limits::SCENE_FILE_BYTES_MAX;
use apprentice::world::household::{Household, Scene, Task};
use apprentice::world::{Show, Stage, Thing, World};

use super::reach::{after, carry_out, path, same_request};
use super::{Case, Class, ConversationError, Counts, OfTranscript, Played, Written};
use crate::transcript::{Act, Kind, Line, Request, Setting};

/// The task that gives tasks back to the seed, as in every transcript.
const DRAWN: &str = "drawn";

/// - `before`: the mind without lessons.
pub(super) fn play(
    household: &Household,
    recipe: &Recipe,
    before: &Mind,
    written: &Written,
) -> Result<Played, ConversationError> {
    let mut player = Player {
        household,
        recipe,
        before,
        lines: &written.transcript.lines,
        written,
        mind: None,
        lessons: Vec::new(),
        seed: 1,
        task: None,
        scene: None,
        episode: None,
        counts: Counts::default(),
        trainings_failed: 0,
        cases: Vec::new(),
    };
    for (index, line) in written.transcript.lines.iter().enumerate() {
        player.line(index, &line.kind).map_err(|Wrong { line, reason }| {
            ConversationError::Line { path: written.path.clone(), line, reason }
        })?;
    }
    Ok(Played {
        of: OfTranscript { name: name(written), counts: player.counts },
        trainings_failed: player.trainings_failed,
        cases: player.cases,
    })
}

fn name(written: &Written) -> String {
    written.path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// A line that asks for what cannot be, counted from 1.
struct Wrong {
    line: usize,
    reason: String,
}

struct Player<'a> {
    household: &'a Household,
    recipe: &'a Recipe,
    before: &'a Mind,
    written: &'a Written,
    lines: &'a [Line],
    /// What the lessons made; none before the first.
    mind: Option<Mind>,
    lessons: Vec<Lesson<Scene, Task>>,
    seed: u64,
    task: Option<String>,
    scene: Option<String>,
    /// The current one, or the last.
    episode: Option<Episode>,
    counts: Counts,
    trainings_failed: usize,
    cases: Vec<Case>,
}

struct Episode {
    scene: Arc<Scene>,
    task: Arc<Task>,
    mentioned: Option<Symbol>,
    /// The steps that were meant, in order.
    actions: Vec<Step>,
    said: Vec<Said>,
    /// The names of the things that were handled, newest first.
    handled: Vec<String>,
    /// How many of the next steps that will be meant were carried out already.
    ahead: usize,
    over: bool,
}

/// What is in the hand, by name.
fn held_after(household: &Household, scene: &Scene) -> Vec<String> {
    let held = |thing: &Thing| thing.states.iter().any(|state| state == "held");
    let things = household.look(scene).things;
    things.into_iter().filter(held).map(|thing| thing.name).collect()
}

struct Said {
    utterance: Utterance,
    scene: Arc<Scene>,
    mentioned: Option<Symbol>,
}

impl<'a> Player<'a> {
    fn line(&mut self, index: usize, kind: &Kind) -> Result<(), Wrong> {
        let result = match kind {
            Kind::Setting(setting) => self.set(setting),
            Kind::Act(Act::Episode { .. }) => self.start(),
            Kind::Act(Act::Say(text)) => return self.say(index, text),
            Kind::Act(Act::Done) => self.done(),
            Kind::Act(Act::Teach { utterance, actions, on_clash }) => match actions {
                Some(actions) => self.teach(utterance, *actions, *on_clash),
                None => Ok(()),
            },
            Kind::Act(Act::Learn { .. }) => {
                self.learn();
                Ok(())
            }
            Kind::Act(Act::Forget(utterance)) => self.forget(utterance),
            // What was meant is played, so nothing was done wrongly.
            Kind::Act(Act::Wrong) => Ok(()),
            Kind::Remark | Kind::Answer(_) | Kind::Meant(_) => Ok(()),
        };
        result.map_err(|reason| Wrong { line: self.lines[index].number, reason })
    }

    fn set(&mut self, setting: &Setting) -> Result<(), String> {
        match setting {
            // Every recipe is measured on the same files, and nobody's name matters.
            Setting::User(_) | Setting::Recipe(_) => {}
            Setting::Seed(seed) => self.seed = *seed,
            Setting::Task(task) => self.task = (task != DRAWN).then(|| task.clone()),
            Setting::Scene(name) => {
                let path = self.written.path.with_file_name(name);
                let unreadable = |error| format!("scene {}: {error}", path.display());
                let bytes = std::fs::metadata(&path).map_err(unreadable)?.len();
                if bytes > SCENE_FILE_BYTES_MAX as u64 {
                    return Err(format!(
                        "scene {} has {bytes} bytes; at most {SCENE_FILE_BYTES_MAX} are read",
                        path.display()
                    ));
                }
                self.scene = Some(std::fs::read_to_string(&path).map_err(unreadable)?);
            }
        }
        Ok(())
    }

    fn start(&mut self) -> Result<(), String> {
        if self.episode.as_ref().is_some_and(|episode| !episode.over) {
            return Err("the episode above has no end; put done before this line".to_owned());
        }
        let seed = self.seed;
        let stage = match (&self.scene, &self.task) {
            (Some(scene), Some(task)) => Stage::Scene { scene: scene.clone(), task: task.clone() },
            (Some(_), None) => return Err("a scene needs a task line too".to_owned()),
            (None, Some(task)) => Stage::Task { task: task.clone(), seed },
            (None, None) => Stage::Seed { seed },
        };
        let (scene, task) = self.household.stage(&stage).map_err(|error| error.to_string())?;
        self.episode = Some(Episode {
            scene: Arc::new(scene),
            task: Arc::new(task),
            mentioned: None,
            actions: Vec::new(),
            said: Vec::new(),
            handled: Vec::new(),
            ahead: 0,
            over: false,
        });
        Ok(())
    }

    fn done(&mut self) -> Result<(), String> {
        match &mut self.episode {
            Some(episode) if !episode.over => {
                episode.over = true;
                Ok(())
            }
            _ => Err("there is no episode here".to_owned()),
        }
    }

    /// What the utterance at an index meant, each with its line.
    fn lines_of_meaning(
        &self,
        index: usize,
    ) -> impl Iterator<Item = (usize, Option<&'a Request>)> + use<'a> {
        let below = self.lines[index + 1..].iter();
        let own = below.take_while(|line| !matches!(line.kind, Kind::Act(_)));
        own.filter_map(|line| match &line.kind {
            Kind::Meant(request) => Some((line.number, request.as_ref())),
            _ => None,
        })
    }

    /// The requests that the utterance at an index meant, each with its line: the conversation goes
    /// on from the first, others would have been right as well. None where it asked for nothing.
    fn meant(&self, index: usize) -> Result<Vec<(usize, &'a Request)>, Wrong> {
        let meant: Vec<(usize, Option<&Request>)> = self.lines_of_meaning(index).collect();
        if meant.is_empty() {
            let reason = "no ~~ line below says what this utterance meant".to_owned();
            return Err(Wrong { line: self.lines[index].number, reason });
        }
        let requests = meant.iter().filter_map(|(line, request)| Some((*line, (*request)?)));
        let requests: Vec<(usize, &Request)> = requests.collect();
        let mixed = meant.len() > 1 && requests.len() < meant.len();
        match meant.get(1).filter(|_| mixed) {
            Some((line, _)) => {
                let reason = "an utterance that meant nothing has one ~~ line".to_owned();
                Err(Wrong { line: *line, reason })
            }
            None => Ok(requests),
        }
    }

    /// What will be meant in the rest of the episode.
    fn following(&self, index: usize) -> Vec<&'a Request> {
        let ends = |line: &Line| matches!(line.kind, Kind::Act(Act::Episode { .. } | Act::Done));
        let rest = (index + 1..self.lines.len()).take_while(|at| !ends(&self.lines[*at]));
        let said = rest.filter(|at| matches!(self.lines[*at].kind, Kind::Act(Act::Say(_))));
        let first = |at: usize| self.lines_of_meaning(at).next().and_then(|(_, request)| request);
        said.filter_map(first).collect()
    }

    fn say(&mut self, index: usize, text: &str) -> Result<(), Wrong> {
        let number = self.lines[index].number;
        let wrong = |reason: String| Wrong { line: number, reason };
        let utterance = Utterance::new(text).map_err(|error| wrong(error.to_string()))?;
        let (meant, following) = (self.meant(index)?, self.following(index));
        let mind = self.mind.as_ref().unwrap_or(self.before);
        let episode = match &mut self.episode {
            Some(episode) if !episode.over => episode,
            _ => {
                return Err(wrong(
                    "there is no episode here; put an episode line above".to_owned(),
                ));
            }
        };
        let (scene, task) = (episode.scene.clone(), episode.task.clone());
        let said = Said { utterance, scene: scene.clone(), mentioned: episode.mentioned.clone() };
        let handled = episode.handled.clone();
        let domain = self.household;
        let asked = || {
            let mentioned = said.mentioned.as_ref();
            let handled = handled.as_slice();
            let moment = Moment { domain, scene: &scene, task: &task, mentioned, handled };
            mind.interpret(moment, &said.utterance)
        };

        let Some((_, first)) = meant.first() else {
            let answer = asked();
            let class = match answer.outcome {
                Outcome::Understood { .. } => Class::WronglyActed,
                _ => Class::RightlyLeft,
            };
            if answer.mentioned.is_some() {
                episode.mentioned.clone_from(&answer.mentioned);
            }
            episode.said.push(said);
            self.judged(number, text, class, "nothing".to_owned(), &answer);
            return Ok(());
        };

        let done = episode.ahead.min(first.program.steps.len());
        episode.ahead -= done;
        episode.actions.extend(first.program.steps.iter().cloned());
        if done == first.program.steps.len() {
            episode.said.push(said);
            self.counts.spare();
            return Ok(());
        }
        // What was done ahead leaves other ways of doing the same behind.
        let meant = if done > 0 { &meant[..1] } else { &meant[..] };
        let goals = Goals::of(domain, &scene, &task, meant, done)?;
        let answer = asked();
        let (class, ahead) = goals.judge(domain, &scene, &task, &following, &answer.outcome);
        let bound = match &answer.outcome {
            Outcome::Understood { bindings, .. } if class.is_right() => bindings.concat(),
            _ => held_after(domain, &goals.first_after),
        };
        episode.handled.splice(0..0, bound.into_iter().rev());
        episode.scene = Arc::new(ahead.unwrap_or(goals.first_after));
        if let Class::Ahead(steps) = class {
            episode.ahead = steps;
        }
        episode.mentioned = match class {
            // What the robot took the words for is not what "it" will mean.
            Class::SomethingElse | Class::Misread => named_last(first),
            _ => answer.mentioned.clone().or_else(|| said.mentioned.clone()),
        };
        episode.said.push(said);
        let meant: Vec<String> = meant.iter().map(|(_, request)| request.to_string()).collect();
        self.judged(number, text, class, meant.join(" or "), &answer);
        Ok(())
    }

    fn judged(&mut self, line: usize, said: &str, class: Class, meant: String, answer: &Answer) {
        self.counts.count(class);
        if !class.is_right() {
            let (file, utterance) = (name(self.written), said.to_owned());
            let answered = answered(answer);
            self.cases.push(Case { class, file, line, utterance, meant, answered });
        }
    }

    fn teach(
        &mut self,
        text: &str,
        (first, last): (u32, u32),
        on_clash: OnClash,
    ) -> Result<(), String> {
        let nobody = || format!("{text:?} was not said in the episode above");
        let episode = self.episode.as_ref().ok_or_else(nobody)?;
        let said = episode.said.iter().rev().find(|said| said.utterance.as_str() == text.trim());
        let said = said.ok_or_else(nobody)?;
        let run = (first as usize).saturating_sub(1)..last as usize;
        let steps = episode.actions.get(run).filter(|steps| first > 0 && !steps.is_empty());
        let steps = steps.ok_or_else(|| {
            let count = episode.actions.len();
            format!(
                "{count} actions were meant in the episode above; {first}..{last} is not within"
            )
        })?;
        if on_clash == OnClash::Replace {
            let clashing = self.lessons.iter().rposition(|old| old.utterance == said.utterance);
            if let Some(place) = clashing {
                self.lessons.remove(place);
            }
        }
        self.lessons.push(Lesson {
            utterance: said.utterance.clone(),
            program: Program { steps: steps.to_vec() },
            scene: said.scene.clone(),
            task: episode.task.clone(),
            mentioned: said.mentioned.clone(),
        });
        Ok(())
    }

    fn forget(&mut self, text: &str) -> Result<(), String> {
        let place = self.lessons.iter().rposition(|old| old.utterance.as_str() == text.trim());
        let place = place.ok_or_else(|| format!("there is no lesson for {text:?} to forget"))?;
        self.lessons.remove(place);
        Ok(())
    }

    /// As a service does, it goes on with the mind it has where a training fails.
    fn learn(&mut self) {
        match train(self.household, self.recipe, &self.lessons) {
            Ok(mind) => self.mind = Some(mind),
            Err(_) => self.trainings_failed += 1,
        }
    }
}

/// Where a request leads, in each of the ways that are right.
struct Goals<'a> {
    /// What is left of each way to do.
    steps: Vec<&'a [Step]>,
    first_after: Scene,
    others_after: Vec<Scene>,
}

impl<'a> Goals<'a> {
    /// - `meant`: not empty; each with its line.
    /// - `done`: steps of the first that were carried out already.
    /// - errors: one that cannot be carried out.
    fn of(
        household: &Household,
        scene: &Scene,
        task: &Task,
        meant: &[(usize, &'a Request)],
        done: usize,
    ) -> Result<Goals<'a>, Wrong> {
        let mut steps = Vec::new();
        let mut reached = Vec::new();
        for (place, (line, request)) in meant.iter().enumerate() {
            let all = &request.program.steps;
            let left = if place == 0 { &all[done..] } else { &all[..] };
            let after = after(household, scene, task, request, left);
            reached.push(after.map_err(|(place, infeasible)| {
                let step = &left[place];
                let reason = format!("{request} cannot be carried out here: {step}: {infeasible}");
                Wrong { line: *line, reason }
            })?);
            steps.push(left);
        }
        let first_after = reached.remove(0);
        Ok(Goals { steps, first_after, others_after: reached })
    }

    /// - returns: the class, and the scene from which the conversation goes on where that is not
    ///   the first goal.
    fn judge(
        &self,
        household: &Household,
        scene: &Scene,
        task: &Task,
        following: &[&Request],
        outcome: &Outcome,
    ) -> (Class, Option<Scene>) {
        let (program, bindings) = match outcome {
            Outcome::Understood { program, bindings } => (program, bindings),
            Outcome::Impossible { program, .. } => {
                return match self.steps.iter().any(|steps| same_request(steps, program)) {
                    true => (Class::Impossible, None),
                    false => (Class::Misread, None),
                };
            }
            Outcome::NotSure | Outcome::Asked { .. } | Outcome::Told { .. } => {
                return (Class::NotSure, None);
            }
        };
        let mut way = path(household, scene, task, program, bindings);
        // Else a wrong answer could be taken for a right one that skipped something.
        let through = way.contains(&self.first_after);
        let end = way.pop().expect("a path has at least its start");
        if end == self.first_after {
            return (Class::Right, None);
        }
        let ahead = || steps_ahead(household, &self.first_after, task, following, &end);
        match through.then(ahead).flatten() {
            Some(steps) => (Class::Ahead(steps), Some(end)),
            None if self.others_after.contains(&end) => (Class::Right, None),
            None => (Class::SomethingElse, None),
        }
    }
}

/// How many of the steps that will be meant lead from one scene to another; none when none do.
fn steps_ahead(
    household: &Household,
    from: &Scene,
    task: &Task,
    following: &[&Request],
    to: &Scene,
) -> Option<usize> {
    let mut scene = from.clone();
    let steps = following
        .iter()
        .flat_map(|request| request.program.steps.iter().map(move |step| (*request, step)));
    for (place, (request, step)) in steps.enumerate() {
        // It is reported when its turn comes.
        carry_out(household, &mut scene, task, request, step).ok()?;
        if scene == *to {
            return Some(place + 1);
        }
    }
    None
}

/// The type that a request names last.
fn named_last(request: &Request) -> Option<Symbol> {
    request.program.steps.last()?.args.last().cloned()
}

/// An answer in one line, with the things it chose among several of a type.
fn answered(answer: &Answer) -> String {
    match &answer.outcome {
        Outcome::Understood { program, bindings } => {
            let mut on: Vec<String> = Vec::new();
            for name in bindings.iter().flatten() {
                if Request::kind(name) != name && !on.contains(name) {
                    on.push(name.clone());
                }
            }
            Request { program: program.clone(), on }.to_string()
        }
        Outcome::Impossible { program, reason, .. } => format!("impossible: {program} ({reason})"),
        Outcome::NotSure => "not sure".to_owned(),
        Outcome::Asked { question } => format!("asked: {}", question.text),
        Outcome::Told { text } => format!("told: {text}"),
    }
}
