//! One user, as a state machine: the decider says which events a command deserves, `apply` says
//! what an event does to the state. Pure: no clock, no entropy, no file, no socket.

mod apply;
mod command;
mod decide;
mod dialogue;
mod rejection;
mod repeat;
mod reply;
mod snapshot;
mod state;
mod views;

use std::sync::Arc;

pub use crate::client::{
    ActionView, KnownExemplar, OnClash, Phase, Query, RejectionCode, Reply, Status, Teachable, Told,
};
pub use apply::Divergence;
pub use command::Command;
pub use dialogue::CALLED_WRONG;
pub use rejection::Rejection;
pub use repeat::command_of;
pub use reply::reply_of;
pub use state::{LiveLesson, State};

use self::decide::Refusal;
use crate::events::{Batch, Head, Record};
use crate::ids::{Digest, RequestId, Seq, Timestamp};
use crate::invariants::Invariant;
use crate::learning::{Lesson, Mind, Recipe};
use crate::store::Durable;
use crate::world::{Domain, World};

/// One person's session: a state that only records change, and the mind that answers.
///
/// Live operation, recovery, audit and simulation all drive this same type:
/// `propose` → (the log makes it durable) → `settle`; or `apply` record by record.
#[derive(Debug, Clone)]
pub struct Session<D: World> {
    domain: Arc<D>,
    state: State<D::Scene, D::Task>,
    recipe: Option<Arc<Recipe>>,
    mind: Option<Arc<Mind>>,
}

/// What a command leads to, if the log agrees.
#[derive(Debug, Clone, PartialEq)]
pub enum Proposed {
    Turn(Turn),
    /// This request id was answered before, by these records; nothing is to be appended. What is to
    /// be answered now, [`Session::repeat`] says.
    Repeat {
        first: Seq,
        last: Seq,
    },
    /// What was decided cannot be applied to the state: a defect of ours. Nothing is to be appended,
    /// since no fold would accept it; the session is as it was and can go on.
    Defect(Divergence),
}

/// Proposed events: not yet true. Becomes a reply through [`Session::settle`] alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Turn {
    /// Where the stream must still end when the batch is appended.
    pub after: Head,
    pub batch: Batch,
}

/// Work that the state says is due.
#[derive(Debug, Clone)]
pub enum Outstanding<D: World> {
    /// Train on these lessons and come back with `Command::FinishRetrain`.
    Retrain { recipe: Arc<Recipe>, lessons: Vec<Lesson<D::Scene, D::Task>> },
}

impl<D: World> Session<D> {
    /// A session before its first record.
    pub fn new(domain: Arc<D>) -> Session<D> {
        Session { domain, state: State::default(), recipe: None, mind: None }
    }

    /// Makes a durable turn true and says what its person is told.
    ///
    /// - errors: [`Divergence`] when the receipt is for other records than the state expects; the
    ///   session must then be dropped and rebuilt.
    pub fn settle(&mut self, durable: &Durable) -> Result<Reply, Divergence> {
        for record in durable.records() {
            self.apply(record)?;
        }
        Ok(reply_of(durable.records()))
    }

    /// Applies one record of the past.
    ///
    /// - errors: [`Divergence`]; the session must then be dropped.
    pub fn apply(&mut self, record: &Record) -> Result<(), Divergence> {
        apply::apply(&*self.domain, &mut self.state, record)?;
        if self.recipe.is_none() {
            self.recipe = parse_recipe(&self.state);
        }
        Ok(())
    }

    /// Gives the session the mind that its state names.
    ///
    /// - panics: when `mind` is another one (invariant `ModelAgrees`).
    pub fn install(&mut self, mind: Arc<Mind>) {
        let law = Invariant::ModelAgrees;
        assert_eq!(Some(mind.digest()), self.state.mind, "{law}: the state names its mind");
        self.mind = Some(mind);
    }

    /// The mind that must be installed before the next command, if it is not yet.
    pub fn mind_wanted(&self) -> Option<Digest> {
        let installed = self.mind.as_ref().map(|mind| mind.digest());
        self.state.mind.filter(|wanted| installed != Some(*wanted))
    }

    /// The mind that answers now.
    pub fn mind(&self) -> Option<&Arc<Mind>> {
        self.mind.as_ref()
    }

    /// Work that is due: re-asked after every settle and every activation, so that a scheduled
    /// training is never forgotten (invariant `NoLostWork`).
    ///
    /// - panics: when the state has lost a lesson of it.
    pub fn outstanding(&self) -> Option<Outstanding<D>> {
        let training = self.state.training.as_ref()?;
        let recipe = self.recipe.clone()?;
        let lessons = self.lessons_of(&training.lessons);
        let (law, due) = (Invariant::NoLostWork, training.lessons.len());
        assert_eq!(lessons.len(), due, "{law}: a scheduled training has all its lessons");
        Some(Outstanding::Retrain { recipe, lessons })
    }

    /// The lessons that the present mind was trained on, for training it again.
    pub fn trained_lessons(&self) -> Vec<Lesson<D::Scene, D::Task>> {
        self.lessons_of(&self.state.trained)
    }

    fn lessons_of(&self, seqs: &[Seq]) -> Vec<Lesson<D::Scene, D::Task>> {
        let kept = || self.state.lessons.iter().chain(&self.state.retired);
        let find = |seq: &Seq| kept().find(|live| live.seq == *seq).map(|live| live.lesson.clone());
        seqs.iter().filter_map(find).collect()
    }

    pub fn domain(&self) -> &Arc<D> {
        &self.domain
    }

    pub fn state(&self) -> &State<D::Scene, D::Task> {
        &self.state
    }

    pub fn head(&self) -> Head {
        self.state.head
    }

    pub fn phase(&self) -> Phase {
        self.state.phase
    }

    pub fn is_open(&self) -> bool {
        self.state.opened.is_some()
    }

    /// The time of the next record: the wall clock, but after the last record.
    pub fn next_at(&self, wall: Timestamp) -> Timestamp {
        self.state.last_at.next(wall)
    }

    /// Whether the recorded recipe is one that this binary can read; a newer one may have written
    /// it. A session without its recipe can be looked at, and decides nothing.
    pub fn knows_its_recipe(&self) -> bool {
        self.recipe.is_some()
    }

    /// - panics: before the session was opened, and when it does not [know its
    ///   recipe](Session::knows_its_recipe).
    pub fn recipe(&self) -> &Arc<Recipe> {
        self.recipe.as_ref().expect("SessionOpened carries the recipe and is the first record")
    }

    fn mind_digest(&self) -> Digest {
        self.state.mind.expect("SessionOpened names the base mind and is the first record")
    }
}

impl<D: Domain> Session<D> {
    /// Decides what `command` deserves. Nothing changes. The events of a turn were applied to a copy
    /// of the state, so [`Session::settle`] will take them.
    ///
    /// - `request`: a repeated id gets [`Proposed::Repeat`] (invariant `ExactlyOnce`).
    /// - `at`: see [`Session::next_at`].
    /// - errors: a [`Rejection`], which is not remembered.
    /// - panics: when the mind that the state names was not [installed](Session::install).
    pub fn propose(
        &self,
        command: &Command,
        request: RequestId,
        at: Timestamp,
    ) -> Result<Proposed, Rejection> {
        self.answer(command, request, at, Command::check_texts)
    }

    /// Decides a recorded command again, as [`Session::propose`] would have, but without the rule
    /// for new texts: older versions recorded texts that it refuses.
    pub fn propose_recorded(
        &self,
        command: &Command,
        request: RequestId,
        at: Timestamp,
    ) -> Result<Proposed, Rejection> {
        self.answer(command, request, at, |_| Ok(()))
    }

    fn answer(
        &self,
        command: &Command,
        request: RequestId,
        at: Timestamp,
        check: impl Fn(&Command) -> Result<(), Rejection>,
    ) -> Result<Proposed, Rejection> {
        if let Some(answered) = self.state.requests.find(request) {
            return Ok(Proposed::Repeat { first: answered.first, last: answered.last });
        }
        check(command)?;
        match decide::decide(self, command) {
            Ok(events) => {
                let batch = Batch { request, at, events };
                Ok(Proposed::Turn(Turn { after: self.head(), batch }))
            }
            Err(Refusal::Rejected(rejection)) => Err(rejection),
            Err(Refusal::Defect(divergence)) => Ok(Proposed::Defect(divergence)),
        }
    }
}

fn parse_recipe<S, T>(state: &State<S, T>) -> Option<Arc<Recipe>> {
    let opened = state.opened.as_ref()?;
    Recipe::parse(&opened.recipe_text).ok().map(Arc::new)
}
