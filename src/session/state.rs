use std::collections::VecDeque;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::client::Phase;
use crate::events::{Head, RetrainScheduled};
use crate::ids::{Digest, RequestId, Seq, Timestamp, UserId};
use crate::language::{LiftedUtterance, Program, Question, Step, Symbol, Utterance};
use crate::learning::Lesson;
use crate::limits::REQUEST_RING;

/// Everything a person's history has led to. Made by `apply` alone; `S` and `T` are the domain's
/// scene and task.
///
/// What grows with a history stands behind `Arc`s: each command is folded into a copy.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State<S, T> {
    pub head: Head,
    pub last_at: Timestamp,
    pub phase: Phase,
    pub opened: Option<Arc<Opened>>,
    pub episodes: u32,
    /// The present episode, or the last one while there is none.
    pub episode: Option<Episode<S, T>>,
    /// Lessons that were not taken back, in the order they were taught.
    pub lessons: Vec<Arc<LiveLesson<S, T>>>,
    /// Lessons that were taken back while the present mind still knows them: needed should that
    /// mind have to be trained again.
    pub retired: Vec<Arc<LiveLesson<S, T>>>,
    /// The mind that answers now.
    pub mind: Option<Digest>,
    /// The lessons that mind was trained on.
    pub trained: Vec<Seq>,
    /// A training that is scheduled and neither completed nor failed.
    pub training: Option<RetrainScheduled>,
    pub requests: RequestRing,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Opened {
    pub user: UserId,
    pub domain: String,
    pub domain_version: u16,
    pub recipe: String,
    pub recipe_text: String,
    pub recipe_digest: Digest,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Episode<S, T> {
    pub scene: Arc<S>,
    pub task: Arc<T>,
    pub goal: String,
    pub fewest: Option<u32>,
    /// The type named last.
    pub mentioned: Option<Symbol>,
    pub utterances: u32,
    pub actions: Vec<Arc<Action>>,
    /// The utterances that were not carried out, guessed, or carried out wrongly, in the order they
    /// were said.
    pub unexplained: Vec<Arc<Unexplained<S>>>,
    /// What was done last for an utterance.
    #[serde(default = "none", skip_serializing_if = "Option::is_none")]
    pub last_act: Option<Arc<Act<S>>>,
    /// The question that the next utterance may answer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub question: Option<Arc<OpenQuestion>>,
    /// Acts that the person called wrong. The same words are not taken for the same program again in
    /// this episode.
    #[serde(default = "Vec::new", skip_serializing_if = "Vec::is_empty")]
    pub wrong: Vec<Arc<Act<S>>>,
}

fn none<T>() -> Option<T> {
    None
}

/// What was done for an utterance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Act<S> {
    /// The utterance, as it would be taught.
    pub said: Unexplained<S>,
    pub program: Program,
    /// The request that the words were taken for.
    pub taken_for: Option<LiftedUtterance>,
}

/// A question to the person, and the record that asks it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OpenQuestion {
    pub seq: Seq,
    pub question: Question,
}

impl<S, T> Episode<S, T> {
    /// Whether the person has called an act wrong.
    pub fn is_wrong(&self, act: &Act<S>) -> bool {
        self.wrong.iter().any(|wrong| wrong.said.seq == act.said.seq)
    }

    /// The names of the things that were acted on, newest first; one may come again.
    pub fn handled(&self) -> Vec<String> {
        self.actions.iter().rev().flat_map(|action| action.binding.iter().rev()).cloned().collect()
    }
}

/// A primitive that was carried out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Action {
    pub step: Step,
    pub binding: Vec<String>,
}

/// An utterance that was not carried out, or only by guess, with all that a lesson made of it would need.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Unexplained<S> {
    pub seq: Seq,
    pub utterance: Utterance,
    pub not_sure: bool,
    /// Whether it was taken for something that nobody taught; see [`Answer::guessed`].
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub guessed: bool,
    pub actions_before: u32,
    pub scene: Arc<S>,
    pub mentioned: Option<Symbol>,
    /// Whether it was taught or declined since.
    pub settled: bool,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LiveLesson<S, T> {
    /// Its `DecompositionTaught` event.
    pub seq: Seq,
    pub lesson: Lesson<S, T>,
}

impl<S, T> Default for State<S, T> {
    fn default() -> Self {
        State {
            head: Head::EMPTY,
            last_at: Timestamp::default(),
            phase: Phase::Idle,
            opened: None,
            episodes: 0,
            episode: None,
            lessons: Vec::new(),
            retired: Vec::new(),
            mind: None,
            trained: Vec::new(),
            training: None,
            requests: RequestRing::default(),
        }
    }
}

impl<S: Clone, T: Clone> State<S, T> {
    /// A copy to fold proposed events into: everything that an event reads, so without the requests.
    ///
    /// One reference is counted for each lesson, action and unexplained utterance; nothing else is
    /// copied that grows.
    pub(super) fn scratch(&self) -> State<S, T> {
        State {
            head: self.head,
            last_at: self.last_at,
            phase: self.phase,
            opened: self.opened.clone(),
            episodes: self.episodes,
            episode: self.episode.clone(),
            lessons: self.lessons.clone(),
            retired: self.retired.clone(),
            mind: self.mind,
            trained: self.trained.clone(),
            training: self.training.clone(),
            requests: RequestRing::default(),
        }
    }
}

/// The last [`REQUEST_RING`] request ids and the records each of them led to: longer than any
/// client's retry window (invariant `ExactlyOnce`).
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct RequestRing(VecDeque<Answered>);

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Answered {
    pub request: RequestId,
    pub first: Seq,
    pub last: Seq,
}

impl RequestRing {
    pub fn find(&self, request: RequestId) -> Option<Answered> {
        self.0.iter().rev().find(|answered| answered.request == request).copied()
    }

    /// Notes that `request` led to the record `seq`; the records of one request follow each other.
    pub fn note(&mut self, request: RequestId, seq: Seq) {
        match self.0.back_mut() {
            Some(answered) if answered.request == request => answered.last = seq,
            _ => {
                if self.0.len() == REQUEST_RING {
                    self.0.pop_front();
                }
                self.0.push_back(Answered { request, first: seq, last: seq });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taught(lessons: u64) -> State<(), ()> {
        let live = |seq| {
            let lesson = Lesson {
                utterance: Utterance::new("wash the mug").unwrap(),
                program: Program { steps: Vec::new() },
                scene: Arc::new(()),
                task: Arc::new(()),
                mentioned: None,
            };
            Arc::new(LiveLesson { seq: Seq::new(seq).unwrap(), lesson })
        };
        let mut state = State { lessons: (1..=lessons).map(live).collect(), ..State::default() };
        state.requests.note(RequestId([7; 16]), Seq::FIRST);
        state
    }

    #[test]
    fn a_scratch_copy_shares_what_grows_and_knows_no_request() {
        let state = taught(100);
        let scratch = state.scratch();
        let pairs = state.lessons.iter().zip(&scratch.lessons);
        assert!(pairs.into_iter().all(|(one, other)| Arc::ptr_eq(one, other)));
        assert_eq!(scratch.requests, RequestRing::default());
        assert_eq!(State { requests: state.requests.clone(), ..scratch }, state);
    }
}
