//! One episode of one person at the wire: what they say, what they see of it, and what they could
//! teach afterwards.
//!
//! Every command goes out under an id that follows from who says it and when, so that a study that
//! was killed asks again and gets the answers that the log holds.

use std::time::Duration;

use apprentice::client::Command;
use apprentice::client::{Client, ClientError, OnClash, RejectionCode, Reply, Told};
use apprentice::ids::{Digest, RequestId, Seq};
use apprentice::language::{Outcome, Program, Step};
use apprentice::world::household::{Household, Scene, Task};
use apprentice::world::{Stage, StageError, World};

use super::meaning::{Aim, aim, carried_out_as_meant, run_for};

/// The longest that a training may take.
const TRAINING_MAX: Duration = Duration::from_secs(3_600);

/// Why an episode cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum TalkError {
    #[error(transparent)]
    Client(#[from] ClientError),
    #[error("the stage cannot be set: {0}")]
    Stage(#[from] StageError),
    #[error("the service did not do what it said: {0}")]
    Puzzling(String),
}

/// What a person keeps of one thing that they said, for their journal.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Turn {
    /// The record that answers it.
    pub seq: u64,
    pub meant: Program,
    /// Asked for anew, not because something bigger or said otherwise was not understood.
    pub first: bool,
}

/// What came of one utterance, as the person sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Heard {
    Right,
    Wrong,
    /// The words were known, and the world forbids it.
    Impossible,
    NotSure,
    /// No more is listened to.
    Refused,
}

/// Something said that could be taught afterwards.
#[derive(Debug, Clone)]
pub struct Open<T> {
    /// What the person wants to remember with it.
    pub note: T,
    seq: Seq,
    meant: Program,
    /// Actions before the first that can explain it.
    after: usize,
    /// It did what was meant: there is nothing to teach, even where it was a guess.
    settled: bool,
}

/// The wire as a participant has it: patient as long as the service lives.
pub struct Wire<'a> {
    pub client: &'a Client,
    /// Whether it is worth asking again.
    pub alive: &'a dyn Fn() -> bool,
}

/// How often a living service is asked the same, each time as long as the client has patience.
const ASKED_MAX: usize = 30;

impl Wire<'_> {
    fn ask<R>(&self, ask: impl Fn(&Client) -> Result<R, ClientError>) -> Result<R, ClientError> {
        let mut asked = 1;
        loop {
            match ask(self.client) {
                Err(ClientError::NoAnswer { .. } | ClientError::Busy { .. })
                    if asked < ASKED_MAX && (self.alive)() =>
                {
                    asked += 1;
                }
                answer => return answer,
            }
        }
    }

    /// Waits until nothing is trained.
    fn wait(&self) -> Result<(), ClientError> {
        self.ask(|client| client.wait_until_learned(TRAINING_MAX)).map(|_| ())
    }
}

/// A person's end of an episode.
pub struct Talk<'a, T> {
    wire: &'a Wire<'a>,
    household: &'a Household,
    /// Who and when, which all request ids of the episode follow from.
    place: String,
    asked: u32,
    task: Task,
    scene: Scene,
    actions: Vec<Step>,
    /// Where the actions of the last thing said begin.
    last_from: usize,
    turns: Vec<Turn>,
    open: Vec<Open<T>>,
    /// What may be taught, once the episode has ended.
    ended: Option<Vec<Seq>>,
    said_max: usize,
}

impl<'a, T> Talk<'a, T> {
    /// Begins an episode.
    ///
    /// - `place`: names person and episode; two talks of one person never have the same.
    /// - `said_max`: utterances before it is to be given up.
    pub fn begin(
        wire: &'a Wire<'a>,
        household: &'a Household,
        place: String,
        stage: &Stage,
        said_max: usize,
    ) -> Result<Talk<'a, T>, TalkError> {
        let (scene, task) = household.stage(stage)?;
        let mut talk = Talk {
            wire,
            household,
            place,
            asked: 0,
            task,
            scene,
            actions: Vec::new(),
            last_from: 0,
            turns: Vec::new(),
            open: Vec::new(),
            ended: None,
            said_max,
        };
        // A study that was killed while this person's mind was trained comes back in the middle.
        wire.wait()?;
        talk.command(Command::StartEpisode { stage: stage.clone() })?;
        Ok(talk)
    }

    pub fn household(&self) -> &'a Household {
        self.household
    }

    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    pub fn task(&self) -> &Task {
        &self.task
    }

    /// What the robot did upon the last thing said.
    pub fn did(&self) -> &[Step] {
        &self.actions[self.last_from..]
    }

    pub fn said(&self) -> usize {
        self.turns.len()
    }

    /// Whether there is nothing more to say: the goal holds, or it was said enough.
    pub fn over(&self) -> bool {
        self.ended.is_some() || self.turns.len() >= self.said_max
    }

    pub fn aim(&self, steps: &[Step]) -> Option<Aim> {
        aim(self.household, &self.scene, &self.task, steps)
    }

    /// Says something that means `meant`.
    pub fn say(
        &mut self,
        words: &str,
        meant: &Program,
        first: bool,
        note: T,
    ) -> Result<Heard, TalkError> {
        let reply = match self.command(Command::Say { utterance: words.to_owned() }) {
            Err(TalkError::Client(ClientError::Rejected { code, .. }))
                if !matches!(
                    code,
                    RejectionCode::StillLearning | RejectionCode::RequestIdReused
                ) =>
            {
                self.said_max = self.turns.len();
                return Ok(Heard::Refused);
            }
            reply => reply?,
        };
        let (mut heard, mut note) = (Heard::Refused, Some(note));
        for told in reply.told {
            match told {
                Told::Answered { seq, answer, actions_before, .. } => {
                    if actions_before as usize != self.actions.len() {
                        return Err(TalkError::Puzzling(format!(
                            "it counts {actions_before} actions, the person {}",
                            self.actions.len()
                        )));
                    }
                    let before = self.scene.clone();
                    self.last_from = self.actions.len();
                    heard = match &answer.outcome {
                        Outcome::Understood { program, bindings } => {
                            self.watch(program, bindings)?;
                            match carried_out_as_meant(
                                self.household,
                                &self.task,
                                &before,
                                meant,
                                &self.scene,
                            ) {
                                true => Heard::Right,
                                false => Heard::Wrong,
                            }
                        }
                        Outcome::Impossible { .. } => Heard::Impossible,
                        Outcome::NotSure | Outcome::Asked { .. } | Outcome::Told { .. } => {
                            Heard::NotSure
                        }
                    };
                    self.turns.push(Turn { seq: seq.get(), meant: meant.clone(), first });
                    let (after, settled) = (self.actions.len(), heard == Heard::Right);
                    if let Some(note) = note.take() {
                        self.open.push(Open { note, seq, meant: meant.clone(), after, settled });
                    }
                }
                Told::EpisodeEnded { to_teach, .. } => {
                    self.ended = Some(to_teach);
                }
                other => return Err(TalkError::Puzzling(format!("{other:?} after an utterance"))),
            }
        }
        Ok(heard)
    }

    /// The robot does what it said it does, before the person's eyes.
    fn watch(&mut self, program: &Program, bindings: &[Vec<String>]) -> Result<(), TalkError> {
        for (place, step) in program.steps.iter().enumerate() {
            // What it acted on is seen, too: words may have chosen another thing than the nearest.
            let names = bindings.get(place).into_iter().flatten();
            let on: Vec<Option<String>> = names.cloned().map(Some).collect();
            self.household
                .step_on(&mut self.scene, &self.task, step, &on)
                .map_err(|error| TalkError::Puzzling(format!("it did {step}, but {error}")))?;
            self.actions.push(step.clone());
        }
        Ok(())
    }

    /// Ends the episode if it has not ended, then teaches what `willing` says, in the order it was
    /// said; what did what was meant, and what the person then did nothing for, is passed over.
    ///
    /// - returns: the notes of what was taught, and what was said.
    pub fn end(
        mut self,
        mut willing: impl FnMut(&T) -> bool,
    ) -> Result<(Vec<T>, Vec<Turn>), TalkError> {
        let to_teach = match self.ended.take() {
            Some(to_teach) => to_teach,
            None => {
                let reply = self.command(Command::Done)?;
                let ended = reply.told.into_iter().find_map(|told| match told {
                    Told::EpisodeEnded { to_teach, .. } => Some(to_teach),
                    _ => None,
                });
                ended.ok_or_else(|| TalkError::Puzzling("done did not end it".to_owned()))?
            }
        };
        let mut taught = Vec::new();
        for open in std::mem::take(&mut self.open) {
            if open.settled || !to_teach.contains(&open.seq) || !willing(&open.note) {
                continue;
            }
            let Some((first, last)) = run_for(&open.meant, &self.actions, open.after) else {
                continue;
            };
            let teach = Command::Teach {
                explains: open.seq,
                actions: (first..=last).collect(),
                on_clash: OnClash::Keep,
            };
            match self.command(teach) {
                Ok(_) => taught.push(open.note),
                // A seed that means something else, or a question that was answered before the
                // study was killed: not taught, either way.
                Err(TalkError::Client(ClientError::Rejected { .. })) => {}
                Err(error) => return Err(error),
            }
        }
        if !to_teach.is_empty() {
            self.command(Command::FinishTeaching)?;
            self.wire.wait()?;
        }
        Ok((taught, self.turns))
    }

    fn command(&mut self, command: Command) -> Result<Reply, TalkError> {
        let name = format!("apprentice study request {} {}", self.place, self.asked);
        self.asked += 1;
        let digest = Digest::of(name.as_bytes());
        let id = RequestId(std::array::from_fn(|index| digest.0[index]));
        Ok(self.wire.ask(|client| client.command_again(id, command.clone()))?)
    }
}
