//! Which events a command deserves. Pure: it reads the state and asks the mind, and promises
//! nothing; the proposed events become true when the log has them.

use super::apply::apply_event;
use super::dialogue::{self, Decided};
use super::state::{Episode, State, Unexplained};
use super::{Command, Divergence, Rejection, Session};
use crate::client::{self, OnClash, Phase};
use crate::events::{
    DecompositionDeclined, DecompositionTaught, Ending, EpisodeEnded, EpisodeStarted, Event,
    Interpreted, LessonForgotten, MarkedWrong, Report, RetrainCompleted, RetrainFailed,
    RetrainScheduled, SessionClosed, SessionOpened,
};
use crate::grounding::Moment;
use crate::ids::{Digest, Seq, UserId};
use crate::language::{
    Document, Exemplar, LiftedProgram, LiftedUtterance, Outcome, Program, Utterance,
};
use crate::learning::{self, Lesson, Recipe};
use crate::limits::{
    EPISODE_ACTIONS_MAX, EPISODE_UTTERANCES_MAX, LESSONS_MAX, SCENE_FILE_BYTES_MAX,
};
use crate::world::{Domain, Show, Stage, StageError, Words, World};

/// Why a command leads to no event.
pub(super) enum Refusal {
    Rejected(Rejection),
    /// What was decided cannot be applied: decider and fold disagree, which is a defect of ours.
    Defect(Divergence),
}

impl From<Rejection> for Refusal {
    fn from(rejection: Rejection) -> Refusal {
        Refusal::Rejected(rejection)
    }
}

/// The events decided so far, and the state as it will be after them.
///
/// An event enters through [`Draft::add`] alone, and what one event says of those before it is
/// read from the state that they led to. So nothing is proposed that the fold refuses: a record
/// that no fold accepts would lock its user out.
struct Draft<'a, D: World> {
    session: &'a Session<D>,
    state: State<D::Scene, D::Task>,
    events: Vec<Event>,
}

impl<D: World> Draft<'_, D> {
    /// - errors: the event does not follow from those before it.
    fn add(&mut self, event: Event) -> Result<(), Refusal> {
        let seq = self.session.state.head.seq + self.events.len() as u64 + 1;
        let seq = Seq::new(seq).expect("a head's successor is at least 1");
        // The first command of somebody new is decided to know whether it is declined; nothing of it
        // is appended before their session is open, and then it is decided again.
        let opens = matches!(event, Event::SessionOpened(_));
        if self.session.state.opened.is_none() && !opens {
            self.events.push(event);
            return Ok(());
        }
        apply_event(&*self.session.domain, &mut self.state, seq, &event)
            .map_err(Refusal::Defect)?;
        self.events.push(event);
        Ok(())
    }
}

/// - returns: the events, which [`super::apply`] takes in the session's state.
/// - errors: a [`Refusal`]; nothing is then recorded.
pub(super) fn decide<D: Domain>(
    session: &Session<D>,
    command: &Command,
) -> Result<Vec<Event>, Refusal> {
    let mut draft = Draft { session, state: session.state.scratch(), events: Vec::new() };
    match (session.state.phase, command) {
        (Phase::Closed, _) => return Err(Rejection::Closed.into()),
        (_, Command::Open { user, recipe_text, mind }) => {
            draft.add(open(session, user, recipe_text, *mind)?)?;
        }
        (phase, Command::Person(wanted)) => persons(&mut draft, phase, wanted, command.name())?,
        (_, Command::FinishRetrain { recipe, outcome }) => {
            draft.add(finish_retrain(session, *recipe, outcome)?)?;
        }
    }
    Ok(draft.events)
}

/// What a person wants, in an open session.
///
/// - `name`: of the command.
fn persons<D: Domain>(
    draft: &mut Draft<D>,
    phase: Phase,
    command: &client::Command,
    name: &'static str,
) -> Result<(), Refusal> {
    use client::Command;
    let session = draft.session;
    match (phase, command) {
        (Phase::Idle, Command::StartEpisode { stage }) => draft.add(start(session, stage)?),
        (Phase::Interacting, Command::Say { utterance }) => say(draft, utterance),
        (Phase::Interacting | Phase::Teaching | Phase::Idle, Command::MarkWrong) => {
            mark_wrong(draft, None)
        }
        (Phase::Interacting, Command::Done) => draft.add(end(&draft.state, Ending::Abandoned)),
        (Phase::Teaching, Command::Teach { explains, actions, on_clash }) => {
            teach(draft, *explains, actions, *on_clash)
        }
        (Phase::Teaching, Command::FinishTeaching) => draft.add(retrain(draft)),
        (Phase::Teaching, Command::Forget { lesson }) => draft.add(forget(session, *lesson)?),
        (Phase::Idle, Command::Forget { lesson }) => {
            draft.add(forget(session, *lesson)?)?;
            draft.add(retrain(draft))
        }
        // A mistyped name must not become a person.
        (_, Command::Close { .. }) if session.state.opened.is_none() => {
            Err(Rejection::NobodyThere.into())
        }
        (_, Command::Close { reason }) => {
            draft.add(Event::SessionClosed(SessionClosed { reason: reason.clone() }))
        }
        (Phase::Learning, _) => Err(Rejection::StillLearning.into()),
        (phase, _) => Err(Rejection::WrongPhase { command: name, phase }.into()),
    }
}

fn open<D: World>(
    session: &Session<D>,
    user: &UserId,
    recipe_text: &str,
    mind: Digest,
) -> Result<Event, Rejection> {
    if session.state.opened.is_some() {
        return Err(Rejection::AlreadyOpen);
    }
    let recipe = Recipe::parse(recipe_text)
        .map_err(|error| Rejection::Recipe { reason: error.to_string() })?;
    Ok(Event::SessionOpened(SessionOpened {
        user: user.clone(),
        domain: session.domain.id().to_owned(),
        domain_version: session.domain.version(),
        recipe: recipe.name().to_owned(),
        recipe_text: recipe_text.to_owned(),
        recipe_digest: recipe.digest(),
        mind,
    }))
}

fn start<D: Show>(session: &Session<D>, stage: &Stage) -> Result<Event, Rejection> {
    let domain = &*session.domain;
    let (scene, task) = set(domain, stage)?;
    if domain.achieved(&scene, &task) {
        return Err(StageError::Achieved { goal: domain.goal(&task) }.into());
    }
    let plan = domain.plan(&scene, &task);
    Ok(Event::EpisodeStarted(EpisodeStarted {
        scene: Document::of(&scene),
        scene_digest: domain.digest(&scene),
        task: Document::of(&task),
        goal: domain.goal(&task),
        seed: match stage {
            Stage::Seed { seed } | Stage::Task { seed, .. } => Some(*seed),
            Stage::Scene { .. } => None,
        },
        fewest: plan.map(|program| program.steps.len() as u32),
    }))
}

/// The scene and the task that a stage asks for, unless it is longer than is read.
pub(super) fn set<D: World>(domain: &D, stage: &Stage) -> Result<(D::Scene, D::Task), Rejection> {
    let found = match stage {
        Stage::Seed { .. } => 0,
        Stage::Task { task, .. } => task.len(),
        Stage::Scene { scene, task } => scene.len() + task.len(),
    };
    match found > SCENE_FILE_BYTES_MAX {
        true => Err(Rejection::SceneTooLarge { found }),
        false => Ok(domain.stage(stage)?),
    }
}

fn say<D: Domain>(draft: &mut Draft<D>, text: &str) -> Result<(), Refusal> {
    // Of what is said now, `Session::propose` has checked more.
    let utterance = Utterance::recorded(text).map_err(Rejection::from)?;
    let session = draft.session;
    let (domain, episode) = (&*session.domain, episode(&session.state));
    if episode.utterances as usize >= EPISODE_UTTERANCES_MAX
        || episode.actions.len() >= EPISODE_ACTIONS_MAX
    {
        return Err(Rejection::EpisodeFull.into());
    }
    let mind = session.mind.as_ref().expect("the shell installs the state's mind before commands");
    let handled = episode.handled();
    let moment = Moment {
        domain,
        scene: &*episode.scene,
        task: &*episode.task,
        mentioned: episode.mentioned.as_ref(),
        handled: &handled,
    };
    let answer = match dialogue::decide(session, episode, &utterance) {
        Decided::Interpret => {
            dialogue::unless_wrong(episode, &utterance, mind.interpret(moment, &utterance))
        }
        Decided::MarkWrong => return mark_wrong(draft, Some(utterance)),
        Decided::Answer(answer) => *answer,
    };

    let mut scene = D::Scene::clone(&episode.scene);
    if let Outcome::Understood { program, .. } = &answer.outcome {
        for (index, step) in program.steps.iter().enumerate() {
            domain
                .step_on(&mut scene, &episode.task, step, answer.chosen_for(index))
                .expect("the interpreter ran this program on the same scene");
        }
    }
    draft.add(Event::Interpreted(Interpreted {
        utterance,
        answer,
        actions_before: episode.actions.len() as u32,
        scene_after: domain.digest(&scene),
        mind: session.mind_digest(),
    }))?;
    match domain.achieved(&scene, &episode.task) {
        true => draft.add(end(&draft.state, Ending::Achieved)),
        false => Ok(()),
    }
}

/// Marks the last act of the present or last episode as wrong.
///
/// - `utterance`: the words that say so, if words did.
fn mark_wrong<D: World>(draft: &mut Draft<D>, utterance: Option<Utterance>) -> Result<(), Refusal> {
    let episode = draft.state.episode.as_ref().ok_or(Rejection::NothingToMark)?;
    let last = episode.last_act.as_ref().ok_or(Rejection::NothingToMark)?;
    if episode.is_wrong(last) {
        let utterance = last.said.utterance.to_string();
        return Err(Rejection::MarkedAlready { utterance }.into());
    }
    let act = last.said.seq;
    draft.add(Event::MarkedWrong(MarkedWrong { act, utterance }))
}

/// The end of the present episode, right after everything that `state` knows.
fn end<S, T>(state: &State<S, T>, ending: Ending) -> Event {
    let episode = episode(state);
    Event::EpisodeEnded(EpisodeEnded {
        ending,
        utterances: episode.utterances,
        actions: episode.actions.len() as u32,
        to_teach: episode.unexplained.iter().map(|said| said.seq).collect(),
    })
}

fn teach<D: Words>(
    draft: &mut Draft<D>,
    explains: Seq,
    actions: &[u32],
    on_clash: OnClash,
) -> Result<(), Refusal> {
    let session = draft.session;
    let (state, episode) = (&session.state, episode(&session.state));
    let said = episode
        .unexplained
        .iter()
        .find(|said| said.seq == explains)
        .ok_or(Rejection::NothingToTeach { explains })?;
    if said.settled {
        return Err(Rejection::TaughtAlready { explains }.into());
    }
    let utterance = said.utterance.clone();
    let (Some(&first), Some(&last)) = (actions.first(), actions.last()) else {
        let declined = DecompositionDeclined { explains, utterance };
        return draft.add(Event::DecompositionDeclined(declined));
    };
    let program = run_of_actions(episode, said, actions, first, last)?;
    if state.lessons.len() >= LESSONS_MAX {
        return Err(Rejection::TooManyLessons.into());
    }
    let lesson = Lesson {
        utterance: utterance.clone(),
        program: program.clone(),
        scene: said.scene.clone(),
        task: episode.task.clone(),
        mentioned: said.mentioned.clone(),
    };
    if let Some(clash) = clash(session, &lesson) {
        match (on_clash, clash.lesson) {
            (OnClash::Keep, Some(_)) => {}
            (OnClash::Replace, Some(old)) => draft.add(forget(session, old)?)?,
            // A seed cannot be unlearned, and a mind that lost one is refused in training.
            (OnClash::Ask, _) | (_, None) => {
                return Err(Rejection::Clash {
                    utterance: clash.utterance,
                    known: clash.program,
                    lesson: clash.lesson,
                }
                .into());
            }
        }
    }
    draft.add(Event::DecompositionTaught(DecompositionTaught {
        explains,
        utterance,
        program,
        first,
        last,
    }))
}

fn run_of_actions<S, T>(
    episode: &Episode<S, T>,
    said: &Unexplained<S>,
    actions: &[u32],
    first: u32,
    last: u32,
) -> Result<Program, Rejection> {
    if !actions.windows(2).all(|pair| pair[0].checked_add(1) == Some(pair[1])) {
        return Err(Rejection::NotContiguous { actions: actions.to_vec() });
    }
    let have = episode.actions.len() as u32;
    if first < 1 || last > have {
        return Err(Rejection::NoSuchAction { first, last, have });
    }
    if first <= said.actions_before {
        return Err(Rejection::NotAfter {
            first,
            before: said.actions_before,
            utterance: said.utterance.to_string(),
        });
    }
    let run = &episode.actions[first as usize - 1..last as usize];
    Ok(Program { steps: run.iter().map(|action| action.step.clone()).collect() })
}

/// The exemplar that a new lesson collides with: the same lifted form, another program.
struct Clash {
    utterance: LiftedUtterance,
    program: LiftedProgram,
    /// None for a seed.
    lesson: Option<Seq>,
}

fn clash<D: Words>(session: &Session<D>, lesson: &Lesson<D::Scene, D::Task>) -> Option<Clash> {
    let domain = &*session.domain;
    let new = learning::lift(domain, session.recipe(), lesson);
    let seeds = domain.seeds().exemplars.iter().map(|seed| (seed.clone(), None));
    let lessons = session.state.lessons.iter().map(|live| {
        let exemplar = learning::lift(domain, session.recipe(), &live.lesson);
        (exemplar, Some(live.seq))
    });
    let collides = |old: &Exemplar| {
        // Numbering counts here: of the same words, "put 1 in 2" and "put 2 in 1" are two meanings.
        old.utterance == new.utterance && old.program != new.program
    };
    let (old, lesson) = seeds.chain(lessons).find(|(old, _)| collides(old))?;
    Some(Clash { utterance: old.utterance, program: old.program, lesson })
}

fn forget<D: World>(session: &Session<D>, lesson: Seq) -> Result<Event, Rejection> {
    let live = session.state.lessons.iter().find(|live| live.seq == lesson);
    let live = live.ok_or(Rejection::NoSuchLesson { lesson })?;
    Ok(Event::LessonForgotten(LessonForgotten { lesson, utterance: live.lesson.utterance.clone() }))
}

/// A training on the lessons that are live after the draft.
fn retrain<D: World>(draft: &Draft<D>) -> Event {
    Event::RetrainScheduled(RetrainScheduled {
        recipe: draft.session.recipe().digest(),
        lessons: draft.state.lessons.iter().map(|live| live.seq).collect(),
    })
}

fn finish_retrain<D: World>(
    session: &Session<D>,
    recipe: Digest,
    outcome: &Result<(Digest, Report), String>,
) -> Result<Event, Rejection> {
    match &session.state.training {
        Some(training) if training.recipe == recipe => {}
        _ => return Err(Rejection::NoTraining { recipe: recipe.short() }),
    }
    Ok(match outcome {
        Ok((mind, report)) => Event::RetrainCompleted(RetrainCompleted {
            recipe,
            mind: *mind,
            report: report.clone(),
            code: Some(learning::code_digest()),
        }),
        Err(reason) => Event::RetrainFailed(RetrainFailed { recipe, reason: reason.clone() }),
    })
}

fn episode<S, T>(state: &State<S, T>) -> &Episode<S, T> {
    state.episode.as_ref().expect("Interacting and Teaching follow an EpisodeStarted")
}
