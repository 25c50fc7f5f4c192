//! Writes one person's history into any store, as an actor would, without actors.

use std::sync::Arc;

use apprentice::client::{Command, OnClash, Phase, Reply, Told};
use apprentice::events::{Batch, Event, Head, Record};
use apprentice::ids::{RequestId, Seq, StreamId, TenantId, Timestamp, UserId};
use apprentice::learning::{Mind, Recipe, train};
use apprentice::session::{self, Outstanding, Proposed, Rejection, Session};
use apprentice::store::Store;
use apprentice::world::{Domain, Stage};

/// One person's session, and where its records are.
pub struct Diary<D: Domain> {
    pub session: Session<D>,
    pub store: Store,
    pub stream: StreamId,
    /// All minds, the base mind first.
    pub minds: Vec<Arc<Mind>>,
    requests: u64,
}

impl<D: Domain> Diary<D> {
    /// Opens the session of a new person.
    pub fn new(domain: &Arc<D>, store: &Store, user: &str, recipe_text: &str) -> Diary<D> {
        Diary::new_in(domain, store, &TenantId::local(), user, recipe_text)
    }

    /// Opens the session of a new person in an existing lab.
    pub fn new_in(
        domain: &Arc<D>,
        store: &Store,
        tenant: &TenantId,
        user: &str,
        recipe_text: &str,
    ) -> Diary<D> {
        let user = UserId::new(user).unwrap();
        let stream = store.keys.stream_id(tenant, &user).unwrap();
        let recipe = Recipe::parse(recipe_text).unwrap();
        let mind = Arc::new(train(&**domain, &recipe, &[]).unwrap());
        let session = Session::new(domain.clone());
        let mut diary =
            Diary { session, store: store.clone(), stream, minds: vec![mind.clone()], requests: 0 };
        let recipe_text = recipe_text.to_owned();
        diary.perform(&session::Command::Open { user, recipe_text, mind: mind.digest() });
        diary.session.install(mind);
        diary
    }

    /// Decides a command, appends its records and applies them.
    ///
    /// - errors: the command is declined; nothing was recorded.
    pub fn give(&mut self, command: &Command) -> Result<Reply, Rejection> {
        self.decided_by(Session::propose, &command.clone().into())
    }

    /// Gives a command of any kind, such as one from inside the service.
    ///
    /// - panics: if the command is declined.
    pub fn perform(&mut self, command: &session::Command) -> Reply {
        let decided = self.decided_by(Session::propose, command);
        decided.unwrap_or_else(|refused| panic!("{command:?} was refused: {refused}"))
    }

    /// As [`Diary::give`], by the rules of older versions, which accepted more characters.
    pub fn give_as_of_old(&mut self, command: &Command) -> Result<Reply, Rejection> {
        self.decided_by(Session::propose_recorded, &command.clone().into())
    }

    fn decided_by(
        &mut self,
        propose: fn(
            &Session<D>,
            &session::Command,
            RequestId,
            Timestamp,
        ) -> Result<Proposed, Rejection>,
        command: &session::Command,
    ) -> Result<Reply, Rejection> {
        self.requests += 1;
        let mut request = [0; 16];
        request[..8].copy_from_slice(&self.requests.to_be_bytes());
        let at = self.session.next_at(Timestamp(1_000));
        let turn = match propose(&self.session, command, RequestId(request), at)? {
            Proposed::Turn(turn) => turn,
            Proposed::Repeat { .. } => panic!("a fresh request id was answered before"),
            Proposed::Defect(divergence) => panic!("{command:?}: {divergence}"),
        };
        let durable = self.store.log.append(&self.stream, turn.after, turn.batch).wait().unwrap();
        Ok(self.session.settle(&durable).unwrap())
    }

    /// As [`Diary::give`].
    ///
    /// - panics: if the command is declined.
    pub fn accept(&mut self, command: &Command) -> Reply {
        self.give(command).unwrap_or_else(|refused| panic!("{command:?} was refused: {refused}"))
    }

    /// Begins an episode with this task.
    pub fn start(&mut self, task: &str) {
        let stage = Stage::Task { task: task.to_owned(), seed: 1 };
        self.accept(&Command::StartEpisode { stage });
    }

    /// Says something.
    pub fn say(&mut self, utterance: &str) -> Reply {
        self.accept(&Command::Say { utterance: utterance.to_owned() })
    }

    /// Ends the episode.
    pub fn done(&mut self) {
        self.accept(&Command::Done);
    }

    /// Teaches the first utterance that can still be taught.
    ///
    /// - returns: the record of the lesson.
    pub fn teach(&mut self, actions: &[u32]) -> Seq {
        let explains = self.session.status().to_teach[0].seq;
        let (actions, on_clash) = (actions.to_vec(), OnClash::Ask);
        let reply = self.accept(&Command::Teach { explains, actions, on_clash });
        let lesson = reply.told.iter().find_map(|told| match told {
            Told::Taught { lesson, .. } => Some(*lesson),
            _ => None,
        });
        lesson.expect("a lesson was taught")
    }

    /// Ends teaching if that is due, and trains.
    pub fn learn(&mut self) -> Arc<Mind> {
        if self.session.phase() == Phase::Teaching {
            self.accept(&Command::FinishTeaching);
        }
        let Some(Outstanding::Retrain { recipe, lessons }) = self.session.outstanding() else {
            panic!("nothing is due");
        };
        let mind = Arc::new(train(&**self.session.domain(), &recipe, &lessons).unwrap());
        let outcome = Ok((mind.digest(), mind.report().clone()));
        self.perform(&session::Command::FinishRetrain { recipe: recipe.digest(), outcome });
        self.session.install(mind.clone());
        self.minds.push(mind.clone());
        mind
    }

    /// All records of the person, in their order.
    pub fn records(&self) -> Vec<Record> {
        let records = self.store.log.read(&self.stream, Seq::FIRST).unwrap();
        records.map(Result::unwrap).collect()
    }

    /// Another store with these records. `change` may alter each event first. The seals and the
    /// chain of the copy are valid, like those of the original.
    pub fn doctored(&self, store: Store, mut change: impl FnMut(Seq, &mut Event)) -> Store {
        let user = self.session.state().opened.as_ref().unwrap().user.clone();
        let stream = store.keys.stream_id(&self.stream.tenant, &user).unwrap();
        let mut head = Head::EMPTY;
        for Record { seq, at, request, mut event, .. } in self.records() {
            change(seq, &mut event);
            let batch = Batch { request, at, events: vec![event] };
            head = store.log.append(&stream, head, batch).wait().unwrap().head();
        }
        store
    }
}
