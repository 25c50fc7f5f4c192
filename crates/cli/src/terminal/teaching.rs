use apprentice::client::{ClientError, OnClash, RejectionCode, Status, Teachable, Told};
use apprentice::ids::Seq;

use super::conversation::{Conversation, Flow, unreadable};
use super::input::{self, ClashLine, Command, TeachLine};
use super::lines::Typed;
use super::print;
use crate::failure::Failure;

impl Conversation<'_> {
    /// Asks about the next utterance that was not carried out, or ends teaching when none is left.
    pub(super) fn teaching(&mut self, status: &Status) -> Result<Flow, Failure> {
        let open = |said: &&Teachable| !self.skipped.contains(&said.seq);
        let Some(said) = status.to_teach.iter().find(open).cloned() else {
            return self.finish_teaching();
        };
        self.tell(&print::teaching_question(&said, &status.actions))?;
        let text = match self.lines.read("teach> ").map_err(unreadable)? {
            Typed::End => return Ok(Flow::Quit),
            Typed::Unreadable(sentence) => return self.tell_one(&sentence),
            Typed::Line(text) => text,
        };
        match input::teach_line(&text) {
            TeachLine::Actions(actions) => self.teach(&said, actions),
            TeachLine::Nothing => self.teach(&said, Vec::new()),
            TeachLine::All => {
                let after = print::after(&said, &status.actions);
                match after.is_empty() {
                    true => self.tell_one("I did nothing after that. Type none or skip."),
                    false => self.teach(&said, after.iter().map(|a| a.number).collect()),
                }
            }
            TeachLine::Skip => {
                self.skipped.insert(said.seq);
                Ok(Flow::On)
            }
            TeachLine::OneMove { utterance, actions } => {
                // The last occurrence, as in a transcript.
                let mut named = status.to_teach.iter().rev();
                match named.find(|teachable| teachable.utterance == utterance).cloned() {
                    Some(named) => self.teach(&named, actions.unwrap_or_default()),
                    None => self.tell_one(&format!(
                        "You cannot teach \"{utterance}\" now. You can teach {}.",
                        quoted_list(&status.to_teach)
                    )),
                }
            }
            TeachLine::Command(Command::Done) => self.finish_teaching(),
            TeachLine::Command(Command::Help) => self.report(&print::teaching_help()),
            TeachLine::Command(command) => self.command(command),
            TeachLine::Bad(sentence) => self.tell_one(&print::sentence(&sentence)),
        }
    }

    fn teach(&mut self, said: &Teachable, actions: Vec<u32>) -> Result<Flow, Failure> {
        match self.robot.teach(said.seq, actions.clone(), OnClash::Ask) {
            Err(ClientError::Rejected { code: RejectionCode::Clash, message }) => {
                self.settle_clash(said.seq, &actions, &message)
            }
            result => {
                let taught = self.or_tell(result)?;
                for told in taught.iter().flat_map(|reply| &reply.told) {
                    self.tell_lesson(told)?;
                }
                Ok(Flow::On)
            }
        }
    }

    fn settle_clash(
        &mut self,
        explains: Seq,
        actions: &[u32],
        sentence: &str,
    ) -> Result<Flow, Failure> {
        loop {
            self.tell_one(&print::sentence(sentence))?;
            let text = match self.lines.read("replace, keep or cancel> ").map_err(unreadable)? {
                Typed::End => return Ok(Flow::Quit),
                Typed::Unreadable(sentence) => {
                    self.tell_one(&sentence)?;
                    continue;
                }
                Typed::Line(text) => text,
            };
            let on_clash = match input::clash_line(&text) {
                Ok(ClashLine::Cancel) => return Ok(Flow::On),
                Ok(ClashLine::Replace) => OnClash::Replace,
                Ok(ClashLine::Keep) => OnClash::Keep,
                Err(sentence) => {
                    self.tell_one(&print::sentence(&sentence))?;
                    continue;
                }
            };
            let result = self.robot.teach(explains, actions.to_vec(), on_clash);
            let taught = self.or_tell(result)?;
            for told in taught.iter().flat_map(|reply| &reply.told) {
                self.tell_lesson(told)?;
            }
            return Ok(Flow::On);
        }
    }

    fn tell_lesson(&mut self, told: &Told) -> Result<(), Failure> {
        let sentence = match told {
            Told::Taught { utterance, program, .. } => {
                format!("Understood: \"{utterance}\" means {program}.")
            }
            Told::Declined { utterance, .. } => {
                format!("Understood: none of these actions means \"{utterance}\".")
            }
            Told::Forgotten { utterance, .. } => {
                format!("Forgotten: what \"{utterance}\" meant before.")
            }
            _ => return Ok(()),
        };
        self.tell_one(&sentence).map(|_| ())
    }

    fn finish_teaching(&mut self) -> Result<Flow, Failure> {
        self.skipped.clear();
        // A refusal here would be refused for ever: better one sentence than a loop.
        self.robot.finish_teaching().map_err(Failure::failed)?;
        // A small training may be over before anybody asks: its end is waited for here, not where
        // the phase is looked at.
        self.learning()
    }
}

fn quoted_list(said: &[Teachable]) -> String {
    said.iter().map(|said| format!("\"{}\"", said.utterance)).collect::<Vec<_>>().join(", ")
}
