use std::collections::BTreeSet;
use std::io;
use std::time::Duration;

use apprentice::client::{Client, ClientError, Phase, Reply, Status, Told};
use apprentice::events::Ending;
use apprentice::ids::Seq;
use apprentice::language::Answer;
use apprentice::plain::count;
use indicatif::ProgressBar;

use super::input::{self, Command, Line};
use super::lines::{Lines, Typed};
use super::print;
use super::screen::{Screen, Style};
use super::stages::Stages;
use crate::failure::Failure;

/// How long the conversation waits for a training. The training goes on in the service, and the
/// person finds it done when they come back.
const LEARNING_MAX: Duration = Duration::from_secs(600);

/// One person talking to the service, from start to `:quit`.
pub struct Conversation<'a> {
    pub(super) robot: &'a Client,
    pub(super) lines: &'a mut dyn Lines,
    pub(super) screen: Screen<'a>,
    stages: Stages,
    /// The last answer, for `:why`.
    last: Option<(String, Answer)>,
    /// Utterances that the person does not want to explain in this round of teaching.
    pub(super) skipped: BTreeSet<Seq>,
    /// Lessons to take back as soon as the present task is over.
    to_forget: Vec<Seq>,
}

/// Whether the conversation goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Flow {
    On,
    Quit,
}

impl<'a> Conversation<'a> {
    pub fn new(
        robot: &'a Client,
        lines: &'a mut dyn Lines,
        screen: Screen<'a>,
        stages: Stages,
    ) -> Conversation<'a> {
        Conversation {
            robot,
            lines,
            screen,
            stages,
            last: None,
            skipped: BTreeSet::new(),
            to_forget: Vec::new(),
        }
    }

    /// Goes on where the person was, until they leave or the input ends.
    ///
    /// - errors: the service or the screen is gone, or a task of the command line is impossible.
    pub fn run(&mut self, user: &str) -> Result<(), Failure> {
        let status = self.status()?;
        self.screen.hint(&print::welcome(user, &status)).map_err(unwritable)?;
        if let (Phase::Interacting, Some(goal)) = (status.phase, &status.goal) {
            self.tell(&[print::goal(goal, None)])?;
            self.show_state(&status)?;
        }
        loop {
            let status = self.status()?;
            let flow = match status.phase {
                Phase::Idle => self.between_tasks(&status)?,
                Phase::Interacting => self.one_line()?,
                Phase::Teaching => self.teaching(&status)?,
                Phase::Learning => self.learning()?,
                Phase::Closed => {
                    self.tell_one("This session is closed and cannot be opened again.")?;
                    Flow::Quit
                }
            };
            if flow == Flow::Quit {
                return self.farewell();
            }
        }
    }

    fn between_tasks(&mut self, status: &Status) -> Result<Flow, Failure> {
        self.skipped.clear();
        if let Some(lesson) = self.to_forget.pop() {
            self.forget_now(lesson)?;
            return Ok(Flow::On);
        }
        // A file that ends here asks for no further task, and none shall stand in the log.
        if status.episodes > 0 && self.lines.at_end().map_err(unreadable)? {
            return Ok(Flow::Quit);
        }
        let stage = self.stages.next(status.episodes);
        let reply = match self.robot.start(stage) {
            Ok(reply) => reply,
            Err(ClientError::Rejected { message, .. }) => return Err(Failure::bad_input(message)),
            Err(broken) => return Err(Failure::failed(broken)),
        };
        for told in &reply.told {
            if let Told::EpisodeStarted { goal, fewest } = told {
                self.screen.hint("").map_err(unwritable)?;
                self.tell(&[print::goal(goal, *fewest)])?;
            }
        }
        if self.screen.style() == Style::Screen {
            let view = self.robot.look().map_err(Failure::failed)?;
            self.tell_one(&print::summary(&view))?;
        }
        Ok(Flow::On)
    }

    /// Reads one line of an episode and acts on it.
    fn one_line(&mut self) -> Result<Flow, Failure> {
        let text = match self.lines.read("you> ").map_err(unreadable)? {
            Typed::End => return Ok(Flow::Quit),
            Typed::Unreadable(sentence) => return self.tell_one(&sentence),
            Typed::Line(text) => text,
        };
        match input::line(&text) {
            // At a screen an empty line is a slip of the hand; in a file each line is meant.
            Line::Empty if self.screen.style() == Style::Screen => Ok(Flow::On),
            Line::Empty => self.say(""),
            Line::Bad(sentence) => self.tell_one(&print::sentence(&sentence)),
            Line::Utterance(utterance) => self.say(&utterance),
            Line::Command(command) => self.command(command),
        }
    }

    fn say(&mut self, utterance: &str) -> Result<Flow, Failure> {
        let said = self.robot.say(utterance);
        let Some(reply) = self.or_tell(said)? else { return Ok(Flow::On) };
        self.tell_marked(&reply)?;
        let status = self.status()?;
        for told in &reply.told {
            if let Told::Answered { utterance, answer, actions_before, .. } = told {
                let done = status.actions.iter().filter(|action| action.number > *actions_before);
                let done: Vec<_> = done.cloned().collect();
                self.tell(&print::answer(utterance, answer, &done))?;
                if !done.is_empty() && status.phase == Phase::Interacting {
                    self.show_state(&status)?;
                }
                self.last = Some((utterance.clone(), answer.clone()));
            }
        }
        self.tell_ending(&reply)
    }

    fn done(&mut self) -> Result<Flow, Failure> {
        let done = self.robot.done();
        match self.or_tell(done)? {
            Some(reply) => self.tell_ending(&reply),
            None => Ok(Flow::On),
        }
    }

    fn tell_ending(&mut self, reply: &Reply) -> Result<Flow, Failure> {
        for told in &reply.told {
            if let Told::EpisodeEnded { ending, utterances, actions, .. } = told {
                let how = match ending {
                    Ending::Achieved => "Done! The goal is reached",
                    Ending::Abandoned => "The task is over. The goal is not reached",
                };
                let said = count(*utterances, "utterance");
                let did = count(*actions, "action");
                self.tell_one(&format!("{how}: {said}, {did}."))?;
            }
        }
        Ok(Flow::On)
    }

    /// Acts on a command; also while teaching.
    pub(super) fn command(&mut self, command: Command) -> Result<Flow, Failure> {
        match command {
            Command::Look => {
                let view = self.robot.look().map_err(Failure::failed)?;
                self.report(&print::look(&view))
            }
            Command::Why => match &self.last {
                Some((utterance, answer)) => {
                    let lines = print::why(utterance, answer);
                    self.report(&lines)
                }
                None => self.tell_one("There is no answer to explain yet. Say something first."),
            },
            Command::Known => {
                let known = self.robot.known().map_err(Failure::failed)?;
                self.report(&print::known(&known))
            }
            Command::Status => {
                let status = self.status()?;
                self.report(&print::status(&status))
            }
            Command::Help => self.report(&print::help()),
            Command::Done => self.done(),
            Command::Forget(number) => self.forget(number),
            Command::Wrong => self.mark_wrong(),
            Command::Task(task) => {
                self.tell_one(&format!("The next task will be: {task}."))?;
                self.stages.put_first(task);
                Ok(Flow::On)
            }
            Command::Quit => Ok(Flow::Quit),
        }
    }

    fn mark_wrong(&mut self) -> Result<Flow, Failure> {
        let marked = self.robot.mark_wrong();
        match self.or_tell(marked)? {
            Some(reply) => self.tell_marked(&reply),
            None => Ok(Flow::On),
        }
    }

    fn tell_marked(&mut self, reply: &Reply) -> Result<Flow, Failure> {
        for told in &reply.told {
            if let Told::MarkedWrong { .. } = told {
                self.tell_one(
                    "I'm sorry. I won't take it for that again in this task. Do it in small steps, \
                     then teach me.",
                )?;
            }
        }
        Ok(Flow::On)
    }

    /// A lesson is taken back at once where that is possible, else when the task is over.
    fn forget(&mut self, number: u64) -> Result<Flow, Failure> {
        let known = self.robot.known().map_err(Failure::failed)?;
        let lesson = Seq::new(number).filter(|seq| known.iter().any(|k| k.lesson == Some(*seq)));
        let Some(lesson) = lesson else {
            return self
                .tell_one(&format!("There is no lesson #{number}. :known shows your lessons."));
        };
        match self.status()?.phase {
            Phase::Interacting => {
                if !self.to_forget.contains(&lesson) {
                    self.to_forget.push(lesson);
                }
                self.tell_one(&format!("I will forget #{number} when this task is over."))
            }
            _ => self.forget_now(lesson),
        }
    }

    fn forget_now(&mut self, lesson: Seq) -> Result<Flow, Failure> {
        let forgotten = self.robot.forget(lesson);
        let reply = self.or_tell(forgotten)?;
        for told in reply.iter().flat_map(|reply| &reply.told) {
            if let Told::Forgotten { lesson, utterance } = told {
                self.tell_one(&format!("Forgotten: #{lesson}, \"{utterance}\"."))?;
            }
        }
        let trains = |told: &Told| matches!(told, Told::Learning { .. });
        match reply.iter().flat_map(|reply| &reply.told).any(trains) {
            true => self.learning(),
            false => Ok(Flow::On),
        }
    }

    /// Waits for the new mind.
    pub(super) fn learning(&mut self) -> Result<Flow, Failure> {
        let spinner = match self.screen.style() {
            Style::Screen => ProgressBar::new_spinner().with_message("learning ..."),
            Style::Lines => ProgressBar::hidden(),
        };
        spinner.enable_steady_tick(Duration::from_millis(100));
        let waited = self.robot.wait_until_learned(LEARNING_MAX);
        spinner.finish_and_clear();
        let waited = waited.map_err(Failure::failed)?;
        let failed = waited.told.iter().find_map(|told| match told {
            Told::LearningFailed { reason } => Some(reason.trim_end_matches('.')),
            _ => None,
        });
        match failed {
            None => self.tell_one(&print::learned(waited.status.exemplars)),
            Some(reason) => self.tell_one(&format!(
                "I could not learn that: {reason}. I still know what I knew before."
            )),
        }
    }

    fn farewell(&mut self) -> Result<(), Failure> {
        let left = std::mem::take(&mut self.to_forget);
        for lesson in left {
            self.tell_one(&format!(
                "Lesson #{lesson} is not forgotten, because the task is not over. Type :forget \
                 {lesson} again when you come back."
            ))?;
        }
        self.screen.hint("Goodbye. Everything is saved.").map_err(unwritable)
    }

    /// Progress and hand, for a person at a screen.
    fn show_state(&mut self, status: &Status) -> Result<(), Failure> {
        if self.screen.style() == Style::Screen {
            let view = self.robot.look().map_err(Failure::failed)?;
            let line =
                format!("     {}  ({})", print::progress(&status.progress), print::holding(&view));
            self.screen.hint(&line).map_err(unwritable)?;
        }
        Ok(())
    }

    pub(super) fn status(&mut self) -> Result<Status, Failure> {
        self.robot.status().map_err(Failure::failed)
    }

    /// A refusal is told and over; a broken service ends the conversation.
    pub(super) fn or_tell<T>(
        &mut self,
        result: Result<T, ClientError>,
    ) -> Result<Option<T>, Failure> {
        match result {
            Ok(value) => Ok(Some(value)),
            Err(ClientError::Rejected { message, .. }) => {
                self.tell_one(&print::sentence(&message))?;
                Ok(None)
            }
            Err(broken) => Err(Failure::failed(broken)),
        }
    }

    pub(super) fn tell_one(&mut self, sentence: &str) -> Result<Flow, Failure> {
        self.tell(&[sentence.to_owned()])
    }

    pub(super) fn tell(&mut self, lines: &[String]) -> Result<Flow, Failure> {
        self.screen.tell(lines).map_err(unwritable)?;
        Ok(Flow::On)
    }

    pub(super) fn report(&mut self, lines: &[String]) -> Result<Flow, Failure> {
        self.screen.report(lines).map_err(unwritable)?;
        Ok(Flow::On)
    }
}

pub(super) fn unwritable(error: io::Error) -> Failure {
    Failure::failed(format!("the answer cannot be written to standard output: {error}"))
}

pub(super) fn unreadable(error: io::Error) -> Failure {
    Failure::failed(format!("standard input cannot be read: {error}"))
}
