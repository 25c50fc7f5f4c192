//! What an event does to the state. Total and pure: it reads the event and the state, runs the
//! recorded program in the world, and nothing else. It can not refuse the past; it can only report
//! that binary and log disagree.

use std::sync::Arc;

use super::state::{Act, Action, Episode, LiveLesson, OpenQuestion, Opened, State, Unexplained};
use crate::client::Phase;
use crate::events::{
    DecompositionTaught, EpisodeEnded, EpisodeStarted, Event, Head, Interpreted, Record,
    RetrainCompleted, SessionOpened,
};
use crate::ids::Seq;
use crate::invariants::Invariant;
use crate::language::{Outcome, Program};
use crate::learning::Lesson;
use crate::world::World;

/// Binary and log disagree about the past. Loud, and never healed silently.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("record {seq}: {field} is recorded as {recorded}, this binary computes {recomputed}")]
pub struct Divergence {
    pub seq: Seq,
    pub field: &'static str,
    pub recorded: String,
    pub recomputed: String,
}

/// The field of the scene that a program leaves behind.
const SCENE: &str = "scene digest";

impl Divergence {
    /// The law that was broken, where it has a name.
    pub fn law(&self) -> Option<Invariant> {
        (self.field == SCENE).then_some(Invariant::SceneAgrees)
    }
}

/// Applies one record to the state.
///
/// - errors: [`Divergence`]; the state is then not to be used any more.
pub fn apply<D: World>(
    domain: &D,
    state: &mut State<D::Scene, D::Task>,
    record: &Record,
) -> Result<(), Divergence> {
    let seq = record.seq;
    agree(seq, "sequence number", seq.get(), state.head.seq + 1)?;
    agree(seq, "predecessor", record.prev, state.head.digest)?;
    apply_event(domain, state, seq, &record.event)?;
    state.head = Head { seq: seq.get(), digest: record.digest };
    state.last_at = record.at;
    state.requests.note(record.request, seq);
    Ok(())
}

/// Applies an event as the record `seq`, which need not be recorded yet: all of [`apply`] but
/// the place in the chain, the time and the request.
///
/// - errors: [`Divergence`]; the state is then not to be used any more.
pub(super) fn apply_event<D: World>(
    domain: &D,
    state: &mut State<D::Scene, D::Task>,
    seq: Seq,
    event: &Event,
) -> Result<(), Divergence> {
    let opens = matches!(event, Event::SessionOpened(_));
    if opens == state.opened.is_some() {
        return Err(outside(seq, "an open session"));
    }
    match event {
        Event::SessionOpened(event) => open(domain, state, seq, event)?,
        Event::EpisodeStarted(event) => start(domain, state, seq, event)?,
        Event::Interpreted(event) => interpret(domain, state, seq, event)?,
        Event::EpisodeEnded(event) => end(state, seq, event)?,
        Event::DecompositionTaught(event) => teach(state, seq, event)?,
        Event::DecompositionDeclined(event) => {
            unexplained(state, seq, event.explains)?.settled = true;
        }
        Event::LessonForgotten(event) => forget(state, seq, event.lesson)?,
        Event::MarkedWrong(event) => mark_wrong(state, seq, event.act)?,
        Event::RetrainScheduled(event) => {
            let live: Vec<Seq> = state.lessons.iter().map(|live| live.seq).collect();
            agree(seq, "live lessons", seqs(&event.lessons), seqs(&live))?;
            state.training = Some(event.clone());
            state.phase = Phase::Learning;
        }
        Event::RetrainCompleted(event) => complete(state, seq, event)?,
        Event::RetrainFailed(_) => {
            state.training = None;
            state.phase = Phase::Idle;
        }
        Event::SessionClosed(_) => {
            state.training = None;
            state.phase = Phase::Closed;
        }
        Event::Tenant(_) => return Err(outside(seq, "a tenant's own stream")),
    }
    Ok(())
}

fn open<D: World>(
    domain: &D,
    state: &mut State<D::Scene, D::Task>,
    seq: Seq,
    event: &SessionOpened,
) -> Result<(), Divergence> {
    agree(seq, "domain", event.domain.as_str(), domain.id())?;
    agree(seq, "domain version", event.domain_version, domain.version())?;
    state.opened = Some(Arc::new(Opened {
        user: event.user.clone(),
        domain: event.domain.clone(),
        domain_version: event.domain_version,
        recipe: event.recipe.clone(),
        recipe_text: event.recipe_text.clone(),
        recipe_digest: event.recipe_digest,
    }));
    state.mind = Some(event.mind);
    Ok(())
}

fn start<D: World>(
    domain: &D,
    state: &mut State<D::Scene, D::Task>,
    seq: Seq,
    event: &EpisodeStarted,
) -> Result<(), Divergence> {
    let unreadable = |field, reason: String| Divergence {
        seq,
        field,
        recorded: "a document".to_owned(),
        recomputed: format!("nothing: {reason}"),
    };
    let scene: D::Scene = event.scene.decode().map_err(|reason| unreadable("scene", reason))?;
    let task: D::Task = event.task.decode().map_err(|reason| unreadable("task", reason))?;
    agree(seq, SCENE, event.scene_digest, domain.digest(&scene))?;
    state.episode = Some(Episode {
        scene: Arc::new(scene),
        task: Arc::new(task),
        goal: event.goal.clone(),
        fewest: event.fewest,
        mentioned: None,
        utterances: 0,
        actions: Vec::new(),
        unexplained: Vec::new(),
        last_act: None,
        question: None,
        wrong: Vec::new(),
    });
    state.episodes += 1;
    state.phase = Phase::Interacting;
    Ok(())
}

fn interpret<D: World>(
    domain: &D,
    state: &mut State<D::Scene, D::Task>,
    seq: Seq,
    event: &Interpreted,
) -> Result<(), Divergence> {
    let episode = state.episode.as_mut().ok_or_else(|| outside(seq, "an episode"))?;
    agree(seq, "actions before", event.actions_before as usize, episode.actions.len())?;
    episode.utterances += 1;
    let guessed = event.answer.guessed();
    let open = episode.question.take();
    let answered = event.answer.evidence.replies_to;
    if answered.is_some() && answered != open.as_ref().map(|open| open.seq) {
        return Err(outside(seq, "an open question"));
    }
    let unexplained = |not_sure: bool| {
        Arc::new(Unexplained {
            seq,
            utterance: event.utterance.clone(),
            not_sure,
            guessed,
            actions_before: event.actions_before,
            scene: episode.scene.clone(),
            mentioned: episode.mentioned.clone(),
            settled: false,
        })
    };
    match &event.answer.outcome {
        Outcome::Understood { program, bindings } => {
            let said = unexplained(false);
            carry_out(domain, episode, seq, event, program, bindings)?;
            // Only the person knows whether a guess was right: wrong ones can be taught.
            episode.unexplained.extend(guessed.then(|| said.clone()));
            // An answered question was understood after all.
            let asked = answered.and_then(|asked| take_unexplained(episode, asked));
            note_act(episode, event, program, asked.unwrap_or(said));
        }
        Outcome::Asked { question } => {
            let question = question.clone();
            episode.unexplained.push(unexplained(true));
            episode.question = Some(Arc::new(OpenQuestion { seq, question }));
        }
        Outcome::Told { .. } => {}
        // A question or a prohibition is not there to be taught.
        Outcome::NotSure if !event.answer.asks() => {}
        outcome @ (Outcome::Impossible { .. } | Outcome::NotSure) => {
            let said = unexplained(matches!(outcome, Outcome::NotSure));
            episode.unexplained.push(said);
        }
    }
    if event.answer.mentioned.is_some() {
        episode.mentioned = event.answer.mentioned.clone();
    }
    agree(seq, SCENE, event.scene_after, domain.digest(&episode.scene))
}

/// Runs a program that was carried out, and compares what it acted on with the record.
fn carry_out<D: World>(
    domain: &D,
    episode: &mut Episode<D::Scene, D::Task>,
    seq: Seq,
    event: &Interpreted,
    program: &Program,
    bindings: &[Vec<String>],
) -> Result<(), Divergence> {
    let mut scene = D::Scene::clone(&episode.scene);
    for (index, step) in program.steps.iter().enumerate() {
        let on = event.answer.chosen_for(index);
        let bound = domain.step_on(&mut scene, &episode.task, step, on);
        let bound = bound.map_err(|error| Divergence {
            seq,
            field: "a carried-out step",
            recorded: step.to_string(),
            recomputed: format!("infeasible: {error}"),
        })?;
        let recorded = bindings.get(index).cloned().unwrap_or_default();
        agree(seq, "binding", recorded.join(", "), bound.join(", "))?;
        episode.actions.push(Arc::new(Action { step: step.clone(), binding: bound }));
    }
    episode.scene = Arc::new(scene);
    Ok(())
}

/// Remembers what was done last; a program without steps did nothing.
fn note_act<S: Clone, T>(
    episode: &mut Episode<S, T>,
    event: &Interpreted,
    program: &Program,
    said: Arc<Unexplained<S>>,
) {
    if program.steps.is_empty() {
        return;
    }
    let nearest = event.answer.evidence.nearest.first();
    let taken_for = nearest.map(|near| near.exemplar.clone());
    let said = Unexplained { not_sure: false, ..Unexplained::clone(&said) };
    episode.last_act = Some(Arc::new(Act { said, program: program.clone(), taken_for }));
}

/// Takes the utterance of an answered question off what may be taught.
fn take_unexplained<S, T>(episode: &mut Episode<S, T>, asked: Seq) -> Option<Arc<Unexplained<S>>> {
    let place = episode.unexplained.iter().position(|said| said.seq == asked)?;
    Some(episode.unexplained.remove(place))
}

fn mark_wrong<S: Clone, T>(state: &mut State<S, T>, seq: Seq, act: Seq) -> Result<(), Divergence> {
    let episode = state.episode.as_mut().ok_or_else(|| outside(seq, "an episode"))?;
    let last = episode.last_act.clone().filter(|last| last.said.seq == act);
    let last = last.filter(|last| !episode.is_wrong(last));
    let last = last.ok_or_else(|| outside(seq, "an act that can be marked"))?;
    let said = Arc::new(last.said.clone());
    episode.wrong.push(last);
    if episode.unexplained.iter().all(|other| other.seq != said.seq) {
        let place = episode.unexplained.iter().take_while(|other| other.seq < said.seq).count();
        episode.unexplained.insert(place, said);
    }
    episode.utterances += 1;
    episode.question = None;
    if state.phase == Phase::Idle {
        state.phase = Phase::Teaching;
    }
    Ok(())
}

fn end<S, T>(state: &mut State<S, T>, seq: Seq, event: &EpisodeEnded) -> Result<(), Divergence> {
    let episode = state.episode.as_ref().ok_or_else(|| outside(seq, "an episode"))?;
    let unexplained: Vec<Seq> = episode.unexplained.iter().map(|said| said.seq).collect();
    agree(seq, "utterances", event.utterances, episode.utterances)?;
    agree(seq, "actions", event.actions as usize, episode.actions.len())?;
    if !event.leaves_out_its_own(seq, &unexplained) {
        agree(seq, "utterances to teach", seqs(&event.to_teach), seqs(&unexplained))?;
    }
    state.phase = if unexplained.is_empty() { Phase::Idle } else { Phase::Teaching };
    Ok(())
}

fn teach<S: Clone, T>(
    state: &mut State<S, T>,
    seq: Seq,
    event: &DecompositionTaught,
) -> Result<(), Divergence> {
    let said = unexplained(state, seq, event.explains)?;
    said.settled = true;
    let (scene, mentioned) = (said.scene.clone(), said.mentioned.clone());
    let episode = state.episode.as_ref().ok_or_else(|| outside(seq, "an episode"))?;
    let run = (event.first as usize).saturating_sub(1)..event.last as usize;
    let done = episode.actions.get(run).unwrap_or_default().iter().map(|action| &action.step);
    if !event.program.steps.iter().eq(done.clone()) {
        let done = Program { steps: done.cloned().collect() };
        return agree(seq, "taught program", event.program.to_string(), done.to_string());
    }
    let lesson = Lesson {
        utterance: event.utterance.clone(),
        program: event.program.clone(),
        scene,
        task: episode.task.clone(),
        mentioned,
    };
    state.lessons.push(Arc::new(LiveLesson { seq, lesson }));
    Ok(())
}

fn forget<S, T>(state: &mut State<S, T>, seq: Seq, lesson: Seq) -> Result<(), Divergence> {
    let place = state.lessons.iter().position(|live| live.seq == lesson);
    let place = place.ok_or_else(|| Divergence {
        seq,
        field: "forgotten lesson",
        recorded: format!("record {lesson}"),
        recomputed: "no such live lesson".to_owned(),
    })?;
    let gone = state.lessons.remove(place);
    if state.trained.contains(&lesson) {
        state.retired.push(gone);
    }
    Ok(())
}

fn complete<S, T>(
    state: &mut State<S, T>,
    seq: Seq,
    event: &RetrainCompleted,
) -> Result<(), Divergence> {
    let training = state.training.take().ok_or_else(|| outside(seq, "a training"))?;
    agree(seq, "recipe", event.recipe, training.recipe)?;
    state.mind = Some(event.mind);
    state.trained = training.lessons;
    state.retired.clear();
    state.phase = Phase::Idle;
    Ok(())
}

fn unexplained<S: Clone, T>(
    state: &mut State<S, T>,
    seq: Seq,
    explains: Seq,
) -> Result<&mut Unexplained<S>, Divergence> {
    let episode = state.episode.as_mut().ok_or_else(|| outside(seq, "an episode"))?;
    let found = episode.unexplained.iter_mut().find(|said| said.seq == explains);
    found.map(Arc::make_mut).ok_or_else(|| Divergence {
        seq,
        field: "explained utterance",
        recorded: format!("record {explains}"),
        recomputed: "no such utterance in this episode".to_owned(),
    })
}

fn outside(seq: Seq, what: &str) -> Divergence {
    Divergence {
        seq,
        field: "place in history",
        recorded: format!("within {what}"),
        recomputed: format!("outside {what}"),
    }
}

fn agree<A: PartialEq<B> + ToString, B: ToString>(
    seq: Seq,
    field: &'static str,
    recorded: A,
    recomputed: B,
) -> Result<(), Divergence> {
    match recorded == recomputed {
        true => Ok(()),
        false => Err(Divergence {
            seq,
            field,
            recorded: recorded.to_string(),
            recomputed: recomputed.to_string(),
        }),
    }
}

fn seqs(list: &[Seq]) -> String {
    list.iter().map(Seq::to_string).collect::<Vec<_>>().join(", ")
}
