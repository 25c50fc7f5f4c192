//! A history as a transcript: what a person did and what came of it, as
//! `apprentice transcript check` reads it.

use std::io::{self, Write};
use std::sync::Arc;

use apprentice::client::{Command, OnClash, Phase};
use apprentice::events::{Ending, EpisodeStarted, Event, Record, SessionOpened};
use apprentice::ids::Seq;
use apprentice::language::Document;
use apprentice::learning::Recipe;
use apprentice::limits::BATCH_EVENTS_MAX;
use apprentice::plain;
use apprentice::plain::count;
use apprentice::session::{Rejection, Session, command_of};
use apprentice::store::ReadError;
use apprentice::world::{Domain, Stage};

use crate::failure::Failure;
use crate::shown;
use crate::transcript::show_answer;

/// Writes one line, escaped: what was recorded adds no line of its own to a transcript.
macro_rules! say {
    ($out:expr, $($text:tt)*) => {
        $out.write_all(shown::lines([format!($($text)*)]).as_bytes())
    };
}

/// Writes the records up to the one at which `rebuilt` stands.
///
/// - errors: the outer one when the records cannot be read or applied, which rebuilding the session
///   from them would have shown; the inner one when the text cannot be written.
pub fn write<D: Domain>(
    out: &mut impl Write,
    domain: &Arc<D>,
    records: impl Iterator<Item = Result<Record, ReadError>>,
    rebuilt: &Session<D>,
) -> Result<io::Result<()>, Failure> {
    let mut history = History { session: Session::new(domain.clone()), task_was_named: false };
    let mut batch: Vec<Record> = Vec::new();
    let last = rebuilt.head().seq;
    let head = digests(rebuilt).iter().try_for_each(|line| say!(out, "{line}"));
    if head.is_err() {
        return Ok(head);
    }
    let mut written = Ok(());
    for record in records.take(last as usize) {
        let record = record.map_err(Failure::failed)?;
        let another = batch.last().is_some_and(|last| last.request != record.request);
        if another || batch.len() == BATCH_EVENTS_MAX {
            written = written.and_then(|()| history.tell(out, &batch));
            history.apply(&mut batch)?;
        }
        batch.push(record);
        if written.is_err() {
            return Ok(written);
        }
    }
    written = written.and_then(|()| history.tell(out, &batch));
    history.apply(&mut batch)?;
    Ok(written.and_then(|()| match rebuilt.phase() {
        Phase::Learning => say!(out, "# Here it was still learning."),
        _ => Ok(()),
    }))
}

fn digests<D: Domain>(session: &Session<D>) -> Vec<String> {
    let mind = session.state().mind.map_or(String::new(), |mind| mind.to_hex());
    vec![
        format!(
            "# Rebuilt from records 1 to {}, digest {}.",
            session.head().seq,
            session.head().digest
        ),
        format!("# State {}", session.state_digest()),
        format!("# Mind  {mind}"),
    ]
}

/// What was told so far.
struct History<D: Domain> {
    session: Session<D>,
    task_was_named: bool,
}

impl<D: Domain> History<D> {
    fn apply(&mut self, batch: &mut Vec<Record>) -> Result<(), Failure> {
        batch.drain(..).try_for_each(|record| self.session.apply(&record)).map_err(Failure::failed)
    }

    /// One command's records as lines.
    fn tell(&mut self, out: &mut impl Write, batch: &[Record]) -> io::Result<()> {
        let Some(first) = batch.first() else { return Ok(()) };
        match command_of(batch) {
            Some(Command::Say { utterance }) => {
                let seq = first.seq;
                if plain::check(&utterance).is_err() {
                    let said = plain::escape(&utterance);
                    say!(
                        out,
                        "# Said at record {seq}, with � in place of each special character: {said}"
                    )?;
                }
                say!(out, "> {}", plain::replace(&utterance))?;
            }
            Some(Command::Done) => say!(out, "done")?,
            Some(Command::Teach { explains, actions, on_clash }) => {
                return self.teach(out, batch, explains, &actions, on_clash);
            }
            Some(Command::MarkWrong) => say!(out, "wrong")?,
            Some(Command::Forget { lesson }) => return self.forget(out, lesson),
            _ => {}
        }
        for record in batch {
            match &record.event {
                Event::SessionOpened(event) => header(out, event)?,
                Event::EpisodeStarted(event) => self.stage(out, event)?,
                Event::Interpreted(event) => {
                    let answer = &event.answer;
                    let text = show_answer(&answer.outcome, &answer.evidence, event.actions_before);
                    say!(out, "{text}")?;
                }
                Event::EpisodeEnded(event) if event.ending == Ending::Achieved => {
                    let (said, done) =
                        (count(event.utterances, "utterance"), count(event.actions, "action"));
                    say!(out, "achieved ({said}, {done})")?;
                }
                Event::MarkedWrong(_) => say!(out, "w marked")?,
                Event::RetrainCompleted(event) => {
                    let examples = event.report.exemplars;
                    say!(out, "learn {examples} examples (mind {})", event.mind.short())?;
                }
                Event::RetrainFailed(event) => {
                    say!(out, "learn")?;
                    say!(out, "x learning_failed ({})", event.reason)?;
                }
                Event::SessionClosed(event) => {
                    say!(out, "# Closed at record {}: {}", first.seq, event.reason)?;
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn teach(
        &self,
        out: &mut impl Write,
        batch: &[Record],
        explains: Seq,
        actions: &[u32],
        on_clash: OnClash,
    ) -> io::Result<()> {
        let said = self.session.state().episode.iter().flat_map(|episode| &episode.unexplained);
        let said: Vec<_> = said.filter(|said| !said.settled).collect();
        let Some(this) = said.iter().find(|said| said.seq == explains) else { return Ok(()) };
        let later = said.iter().any(|other| {
            let (other_words, words) = (other.utterance.as_str(), this.utterance.as_str());
            other.seq > explains && plain::replace(other_words) == plain::replace(words)
        });
        if later {
            say!(
                out,
                "# This taught the earlier utterance with the same words, at record {explains}."
            )?;
        }
        let quoted = quoted(&plain::replace(this.utterance.as_str()));
        let (Some(first), Some(last)) = (actions.first(), actions.last()) else {
            return say!(out, "teach {quoted} := nothing");
        };
        // A person who was not asked about a clash need not have said `keep`.
        let asked = Command::Teach { explains, actions: actions.to_vec(), on_clash: OnClash::Ask };
        let batch = &batch[0];
        let clash = match self.session.propose_recorded(&asked.into(), batch.request, batch.at) {
            Err(Rejection::Clash { .. }) if on_clash == OnClash::Replace => " replace",
            Err(Rejection::Clash { .. }) => " keep",
            _ => "",
        };
        say!(out, "teach {quoted} := actions {first}..{last}{clash}")
    }

    fn forget(&self, out: &mut impl Write, lesson: Seq) -> io::Result<()> {
        let live = &self.session.state().lessons;
        let Some(this) = live.iter().find(|live| live.seq == lesson) else { return Ok(()) };
        let words = plain::replace(this.lesson.utterance.as_str());
        if live.iter().any(|other| {
            other.seq > lesson && plain::replace(other.lesson.utterance.as_str()) == words
        }) {
            say!(out, "# This forgot the earlier lesson with the same words, at record {lesson}.")?;
        }
        say!(out, "forget {}", quoted(&words))
    }

    /// The settings that give the episode's stage again, and the episode.
    fn stage(&mut self, out: &mut impl Write, event: &EpisodeStarted) -> io::Result<()> {
        say!(out, "")?;
        let words = event.task.as_json().as_str().unwrap_or_default();
        let drawn = |stage: &Stage| match self.session.domain().stage(stage) {
            Ok((scene, task)) => {
                self.session.domain().digest(&scene) == event.scene_digest
                    && Document::of(&task) == event.task
            }
            Err(_) => false,
        };
        match event.seed {
            Some(seed) if drawn(&Stage::Seed { seed }) => {
                if self.task_was_named {
                    say!(out, "task drawn")?;
                }
                self.task_was_named = false;
                say!(out, "seed {seed}")?;
            }
            seed => {
                let again =
                    |seed: &u64| drawn(&Stage::Task { task: words.to_owned(), seed: *seed });
                if !seed.as_ref().is_some_and(again) {
                    say!(out, "# The scene came from a file. Add a scene line here to play this.")?;
                }
                say!(out, "task {words}")?;
                self.task_was_named = true;
                if let Some(seed) = seed {
                    say!(out, "seed {seed}")?;
                }
            }
        }
        let fewest = event.fewest.map(|n| format!(" (fewest actions: {n})"));
        say!(out, "episode {}{}", event.goal, fewest.unwrap_or_default())
    }
}

fn header(out: &mut impl Write, event: &SessionOpened) -> io::Result<()> {
    let name = event.user.as_str();
    // A bracket would end the name, as it ends every setting.
    match name.starts_with('(') || name.contains(" (") {
        true => say!(out, "# user {name}")?,
        false => say!(out, "user {name}")?,
    }
    let ships = Recipe::builtin(&event.recipe).and_then(|text| Recipe::parse(text).ok());
    match ships.is_some_and(|recipe| recipe.digest() == event.recipe_digest) {
        true => say!(out, "recipe {}", event.recipe),
        false => say!(
            out,
            "# The recipe {:?} is not built in. Save its text from record 1 as a file and name the file here.",
            event.recipe
        ),
    }
}

fn quoted(words: &str) -> String {
    format!("\"{}\"", words.replace('\\', "\\\\").replace('"', "\\\""))
}
