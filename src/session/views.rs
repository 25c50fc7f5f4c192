//! Questions that change nothing and are never recorded.

use super::Session;
use super::state::Episode;
use crate::client::{ActionView, KnownExemplar, Status, Teachable};
use crate::ids::Digest;
use crate::learning::{Mind, Recipe};
use crate::world::{Show, View, Words, World};

impl<D: World> Session<D> {
    /// The exemplars of the present mind, seeds first.
    pub fn known(&self) -> Vec<KnownExemplar> {
        self.mind.as_ref().map(|mind| self.known_to(mind)).unwrap_or_default()
    }

    fn known_to(&self, mind: &Mind) -> Vec<KnownExemplar> {
        let known = mind.exemplars().into_iter().map(|(exemplar, lesson)| KnownExemplar {
            exemplar,
            lesson: lesson.and_then(|index| self.state.trained.get(index).copied()),
        });
        known.collect()
    }

    /// [`Session::known`], as [`Session::status_before`].
    pub fn known_before(&self, mind: &Mind) -> Vec<KnownExemplar> {
        self.known_to(mind)
    }
}

impl<D: Show> Session<D> {
    /// What the robot sees and holds; none before the first episode.
    pub fn look(&self) -> Option<View> {
        let episode = self.state.episode.as_ref()?;
        Some(self.domain.look(&episode.scene))
    }

    fn actions(&self, episode: &Episode<D::Scene, D::Task>) -> Vec<ActionView> {
        let numbered = episode.actions.iter().zip(1..);
        numbered
            .map(|(action, number)| ActionView {
                number,
                step: action.step.to_string(),
                sentence: self.domain.narrate(&action.step, &action.binding),
            })
            .collect()
    }
}

impl<D: Words + Show> Session<D> {
    /// - panics: before the session was opened.
    pub fn status(&self) -> Status {
        self.status_with(self.recipe(), self.mind_digest())
    }

    /// [`Session::status`] of a name that has no record: what its bearer would start with. It says
    /// record 0.
    ///
    /// - `recipe`, `mind`: those that new people start with.
    pub fn status_before(&self, recipe: &Recipe, mind: &Mind) -> Status {
        self.status_with(recipe, mind.digest())
    }

    fn status_with(&self, recipe: &Recipe, mind: Digest) -> Status {
        let (state, episode) = (&self.state, self.state.episode.as_ref());
        Status {
            phase: state.phase,
            seq: state.head.seq,
            episodes: state.episodes,
            recipe: recipe.name().to_owned(),
            mind,
            exemplars: (self.domain.seeds().exemplars.len() + state.trained.len()) as u32,
            lessons: state.lessons.len() as u32,
            goal: episode.map(|episode| episode.goal.clone()),
            progress: episode
                .map(|episode| self.domain.progress(&episode.scene, &episode.task))
                .unwrap_or_default(),
            utterances: episode.map_or(0, |episode| episode.utterances),
            actions: episode.map(|episode| self.actions(episode)).unwrap_or_default(),
            to_teach: match state.phase {
                super::Phase::Teaching => episode.map(to_teach).unwrap_or_default(),
                _ => Vec::new(),
            },
        }
    }
}

fn to_teach<S, T>(episode: &Episode<S, T>) -> Vec<Teachable> {
    let open = episode.unexplained.iter().filter(|said| !said.settled);
    open.map(|said| Teachable {
        seq: said.seq,
        utterance: said.utterance.to_string(),
        actions_before: said.actions_before,
        not_sure: said.not_sure,
        guessed: said.guessed,
    })
    .collect()
}
