//! Which events a command deserves. Pure: it reads the state and asks the mind, and promises
//! nothing; the proposed events become true when the log has them.

use super::state::{Episode, State, Unexplained};
use super::{Command, OnClash, Phase, Rejection, Session};
use crate::events::{
    DecompositionDeclined, DecompositionTaught, Ending, EpisodeEnded, EpisodeStarted, Event,
    Interpreted, LessonForgotten, Report, RetrainCompleted, RetrainFailed, RetrainScheduled,
    SessionClosed, SessionOpened,
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
use crate::world::{Domain, Stage};

/// - errors: a [`Rejection`]; nothing is then recorded.
pub(super) fn decide<D: Domain>(
    session: &Session<D>,
    command: &Command,
) -> Result<Vec<Event>, Rejection> {
    match (session.state.phase, command) {
        (Phase::Closed, _) => Err(Rejection::Closed),
        (_, Command::Open { user, recipe_text, mind }) => open(session, user, recipe_text, *mind),
        (Phase::Idle, Command::StartEpisode { stage }) => start(session, stage),
        (Phase::Interacting, Command::Say { utterance }) => say(session, utterance),
        (Phase::Interacting, Command::Done) => {
            Ok(vec![end(session, Ending::Abandoned, &Adds::default())])
        }
        (Phase::Teaching, Command::Teach { explains, actions, on_clash }) => {
            teach(session, *explains, actions, *on_clash)
        }
        (Phase::Teaching, Command::FinishTeaching) => Ok(vec![retrain(session, None)]),
        (Phase::Teaching, Command::Forget { lesson }) => Ok(vec![forget(session, *lesson)?]),
        (Phase::Idle, Command::Forget { lesson }) => {
            Ok(vec![forget(session, *lesson)?, retrain(session, Some(*lesson))])
        }
        // Else whoever mistypes a name would make a person of it, for good.
        (_, Command::Close { .. }) if session.state.opened.is_none() => Err(Rejection::NobodyThere),
        (_, Command::Close { reason }) => {
            Ok(vec![Event::SessionClosed(SessionClosed { reason: reason.clone() })])
        }
        (_, Command::FinishRetrain { recipe, outcome }) => {
            finish_retrain(session, *recipe, outcome)
        }
        (Phase::Learning, _) => Err(Rejection::StillLearning),
        (phase, command) => Err(Rejection::WrongPhase { command: command.name(), phase }),
    }
}

fn open<D: Domain>(
    session: &Session<D>,
    user: &UserId,
    recipe_text: &str,
    mind: Digest,
) -> Result<Vec<Event>, Rejection> {
    if session.state.opened.is_some() {
        return Err(Rejection::AlreadyOpen);
    }
    let recipe = Recipe::parse(recipe_text)
        .map_err(|error| Rejection::Recipe { reason: error.to_string() })?;
    Ok(vec![Event::SessionOpened(SessionOpened {
        user: user.clone(),
        domain: session.domain.id().to_owned(),
        domain_version: session.domain.version(),
        recipe: recipe.name().to_owned(),
        recipe_text: recipe_text.to_owned(),
        recipe_digest: recipe.digest(),
        mind,
    })])
}

fn start<D: Domain>(session: &Session<D>, stage: &Stage) -> Result<Vec<Event>, Rejection> {
    let found = match stage {
        Stage::Seed { .. } => 0,
        Stage::Task { task, .. } => task.len(),
        Stage::Scene { scene, task } => scene.len() + task.len(),
    };
    if found > SCENE_FILE_BYTES_MAX {
        return Err(Rejection::SceneTooLarge { found });
    }
    let domain = &*session.domain;
    let (scene, task) = domain.stage(stage)?;
    let plan = domain.plan(&scene, &task);
    Ok(vec![Event::EpisodeStarted(EpisodeStarted {
        scene: Document::of(&scene),
        scene_digest: domain.digest(&scene),
        task: Document::of(&task),
        goal: domain.goal(&task),
        seed: match stage {
            Stage::Seed { seed } | Stage::Task { seed, .. } => Some(*seed),
            Stage::Scene { .. } => None,
        },
        fewest: plan.map(|program| program.steps.len() as u32),
    })])
}

fn say<D: Domain>(session: &Session<D>, text: &str) -> Result<Vec<Event>, Rejection> {
    // Of what is said now, `Session::propose` has checked more.
    let utterance = Utterance::recorded(text)?;
    let (domain, episode) = (&*session.domain, episode(&session.state));
    if episode.utterances as usize >= EPISODE_UTTERANCES_MAX
        || episode.actions.len() >= EPISODE_ACTIONS_MAX
    {
        return Err(Rejection::EpisodeFull);
    }
    let mind = session.mind.as_ref().expect("the shell installs the state's mind before commands");
    let moment = Moment {
        domain,
        scene: &*episode.scene,
        task: &*episode.task,
        mentioned: episode.mentioned.as_ref(),
    };
    let answer = mind.interpret(moment, &utterance);

    let mut scene = D::Scene::clone(&episode.scene);
    let mut adds = Adds { utterances: 1, ..Adds::default() };
    if let Outcome::Understood { program, .. } = &answer.outcome {
        // A guess may be taught even where it ended the episode: it stands in this very batch.
        adds.guess = answer.guessed().then(|| session.head().next());
        for step in &program.steps {
            domain
                .step(&mut scene, &episode.task, step)
                .expect("the interpreter ran this program on the same scene");
            adds.actions += 1;
        }
    }
    let mut events = vec![Event::Interpreted(Interpreted {
        utterance,
        answer,
        actions_before: episode.actions.len() as u32,
        scene_after: domain.digest(&scene),
        mind: session.mind_digest(),
    })];
    if domain.achieved(&scene, &episode.task) {
        events.push(end(session, Ending::Achieved, &adds));
    }
    Ok(events)
}

/// What the batch that ends an episode itself adds to it.
#[derive(Default)]
struct Adds {
    utterances: u32,
    /// Primitives carried out.
    actions: u32,
    /// The utterance that ended it, where it was a guess.
    guess: Option<Seq>,
}

fn end<D: Domain>(session: &Session<D>, ending: Ending, adds: &Adds) -> Event {
    let episode = episode(&session.state);
    let before = episode.unexplained.iter().map(|unexplained| unexplained.seq);
    Event::EpisodeEnded(EpisodeEnded {
        ending,
        utterances: episode.utterances + adds.utterances,
        actions: episode.actions.len() as u32 + adds.actions,
        to_teach: before.chain(adds.guess).collect(),
    })
}

fn teach<D: Domain>(
    session: &Session<D>,
    explains: Seq,
    actions: &[u32],
    on_clash: OnClash,
) -> Result<Vec<Event>, Rejection> {
    let (state, episode) = (&session.state, episode(&session.state));
    let said = episode
        .unexplained
        .iter()
        .find(|said| said.seq == explains)
        .ok_or(Rejection::NothingToTeach { explains })?;
    if said.settled {
        return Err(Rejection::TaughtAlready { explains });
    }
    let utterance = said.utterance.clone();
    let (Some(&first), Some(&last)) = (actions.first(), actions.last()) else {
        let declined = DecompositionDeclined { explains, utterance };
        return Ok(vec![Event::DecompositionDeclined(declined)]);
    };
    let program = run_of_actions(episode, said, actions, first, last)?;
    if state.lessons.len() >= LESSONS_MAX {
        return Err(Rejection::TooManyLessons);
    }
    let lesson = Lesson {
        utterance: utterance.clone(),
        program: program.clone(),
        scene: said.scene.clone(),
        task: episode.task.clone(),
        mentioned: said.mentioned.clone(),
    };
    let mut events = Vec::new();
    if let Some(clash) = clash(session, &lesson) {
        match (on_clash, clash.lesson) {
            (OnClash::Keep, Some(_)) => {}
            (OnClash::Replace, Some(old)) => events.push(forget(session, old)?),
            // A seed cannot be unlearned, and a mind that lost one is refused in training.
            (OnClash::Ask, _) | (_, None) => {
                return Err(Rejection::Clash {
                    utterance: clash.utterance,
                    known: clash.program,
                    lesson: clash.lesson,
                });
            }
        }
    }
    events.push(Event::DecompositionTaught(DecompositionTaught {
        explains,
        utterance,
        program,
        first,
        last,
    }));
    Ok(events)
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

fn clash<D: Domain>(session: &Session<D>, lesson: &Lesson<D::Scene, D::Task>) -> Option<Clash> {
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

fn forget<D: Domain>(session: &Session<D>, lesson: Seq) -> Result<Event, Rejection> {
    let live = session.state.lessons.iter().find(|live| live.seq == lesson);
    let live = live.ok_or(Rejection::NoSuchLesson { lesson })?;
    Ok(Event::LessonForgotten(LessonForgotten { lesson, utterance: live.lesson.utterance.clone() }))
}

/// A training on the live lessons, less the one that this very batch takes back.
fn retrain<D: Domain>(session: &Session<D>, forgotten: Option<Seq>) -> Event {
    let live = session.state.lessons.iter().map(|live| live.seq);
    Event::RetrainScheduled(RetrainScheduled {
        recipe: session.recipe().digest(),
        lessons: live.filter(|seq| Some(*seq) != forgotten).collect(),
    })
}

fn finish_retrain<D: Domain>(
    session: &Session<D>,
    recipe: Digest,
    outcome: &Result<(Digest, Report), String>,
) -> Result<Vec<Event>, Rejection> {
    match &session.state.training {
        Some(training) if training.recipe == recipe => {}
        _ => return Err(Rejection::NoTraining { recipe: recipe.short() }),
    }
    Ok(vec![match outcome {
        Ok((mind, report)) => Event::RetrainCompleted(RetrainCompleted {
            recipe,
            mind: *mind,
            report: report.clone(),
            code: Some(learning::code_digest()),
        }),
        Err(reason) => Event::RetrainFailed(RetrainFailed { recipe, reason: reason.clone() }),
    }])
}

fn episode<S, T>(state: &State<S, T>) -> &Episode<S, T> {
    state.episode.as_ref().expect("Interacting and Teaching follow an EpisodeStarted")
}
