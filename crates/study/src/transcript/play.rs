use std::path::Path;
use std::time::Duration;

use apprentice::client::{Client, ClientError, RejectionCode, Reply, Told};
use apprentice::events::Ending;
use apprentice::ids::Seq;
use apprentice::language::{Evidence, Outcome};
use apprentice::limits::SCENE_FILE_BYTES_MAX;
use apprentice::plain::count;
use apprentice::world::Stage;

use super::{Act, Answer, Kind, Line, Setting, Transcript};

/// How long one training may take.
const LEARNING_MAX: Duration = Duration::from_secs(600);

/// The task that gives tasks back to the seed. No world has a task of one such word.
const DRAWN: &str = "drawn";

/// Why a transcript could not be played to its end.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PlayError {
    /// The transcript asks for what cannot be asked.
    #[error("line {line}: {reason}")]
    Line { line: usize, reason: String },
    /// The service is gone.
    #[error("line {line}: {reason}")]
    Broken { line: usize, reason: String },
}

/// What really came of one act.
#[derive(Debug, Clone, PartialEq)]
pub struct Played {
    /// The act's own line with its real goal or number; none when the act was refused.
    pub act: Option<RealAct>,
    /// The lines below it.
    pub answers: Vec<(Answer, String)>,
}

/// The part of an act's own line that is an answer.
#[derive(Debug, Clone, PartialEq)]
pub enum RealAct {
    AsWritten,
    Episode { goal: String, line: String },
    Learn { examples: u32, line: String },
    Teach { line: String },
}

/// Plays the acts of a transcript in order, as one person.
pub struct Player<'a> {
    robot: &'a Client,
    /// Scene files are named relative to this directory.
    directory: &'a Path,
    seed: u64,
    task: Option<String>,
    scene: Option<String>,
    /// Every recorded utterance: its record, its text, whether it was carried out, and whether it
    /// was taught since.
    said: Vec<Said>,
    /// Live lessons and what they explain.
    lessons: Vec<(Seq, String)>,
    /// A forgotten lesson started a training in this pause between episodes. It may have ended.
    training: bool,
}

struct Said {
    seq: Seq,
    utterance: String,
    carried_out: bool,
    settled: bool,
}

impl<'a> Player<'a> {
    pub fn new(robot: &'a Client, directory: &'a Path) -> Player<'a> {
        let (said, lessons) = (Vec::new(), Vec::new());
        Player {
            robot,
            directory,
            seed: 1,
            task: None,
            scene: None,
            said,
            lessons,
            training: false,
        }
    }

    /// Plays every act.
    ///
    /// - returns: for each line that is an act, its index in the transcript and what came of it.
    pub fn play(&mut self, transcript: &Transcript) -> Result<Vec<(usize, Played)>, PlayError> {
        let mut played = Vec::new();
        for (index, line) in transcript.lines.iter().enumerate() {
            match &line.kind {
                Kind::Setting(setting) => self.set(setting, line.number)?,
                Kind::Act(act) => played.push((index, self.act(act, line)?)),
                Kind::Remark | Kind::Answer(_) | Kind::Meant(_) => {}
            }
        }
        Ok(played)
    }

    fn set(&mut self, setting: &Setting, line: usize) -> Result<(), PlayError> {
        match setting {
            // Whoever started the service has read these two.
            Setting::User(_) | Setting::Recipe(_) => {}
            Setting::Seed(seed) => self.seed = *seed,
            Setting::Task(task) if task == DRAWN => self.task = None,
            Setting::Task(task) => self.task = Some(task.clone()),
            Setting::Scene(name) => {
                let path = self.directory.join(name);
                let wrong = |reason: String| PlayError::Line { line, reason };
                let unreadable = |error| wrong(format!("scene {}: {error}", path.display()));
                let bytes = std::fs::metadata(&path).map_err(unreadable)?.len();
                if bytes > SCENE_FILE_BYTES_MAX as u64 {
                    return Err(wrong(format!(
                        "scene {} has {bytes} bytes; the limit is {SCENE_FILE_BYTES_MAX}",
                        path.display()
                    )));
                }
                self.scene = Some(std::fs::read_to_string(&path).map_err(unreadable)?);
            }
        }
        Ok(())
    }

    fn act(&mut self, act: &Act, line: &Line) -> Result<Played, PlayError> {
        let number = line.number;
        let result = match act {
            Act::Episode { .. } => {
                let stage = self.stage(number)?;
                self.robot.start(stage)
            }
            Act::Say(utterance) => self.robot.say(utterance),
            Act::Done => self.robot.done(),
            Act::Teach { utterance, actions, on_clash } => {
                let explains = self.last_untaught(utterance, number)?;
                let actions = actions.map(|(first, last)| run(first, last)).unwrap_or_default();
                self.robot.teach(explains, actions, *on_clash)
            }
            Act::Wrong => self.robot.mark_wrong(),
            Act::Learn { .. } => return self.learn(line),
            Act::Forget(utterance) => {
                let lesson = self.lessons.iter().rev().find(|(_, taught)| taught == utterance);
                let Some((lesson, _)) = lesson else {
                    let reason = format!("there is no lesson for {utterance:?} to forget");
                    return Err(PlayError::Line { line: number, reason });
                };
                self.robot.forget(*lesson)
            }
        };
        match result {
            Ok(reply) => Ok(self.told(act, &reply)),
            Err(error) => refused(error, number),
        }
    }

    fn stage(&self, line: usize) -> Result<Stage, PlayError> {
        match (&self.scene, &self.task) {
            (Some(scene), Some(task)) => {
                Ok(Stage::Scene { scene: scene.clone(), task: task.clone() })
            }
            (Some(_), None) => Err(PlayError::Line {
                line,
                reason: "a scene file needs a task line before the episode".to_owned(),
            }),
            (None, Some(task)) => Ok(Stage::Task { task: task.clone(), seed: self.seed }),
            (None, None) => Ok(Stage::Seed { seed: self.seed }),
        }
    }

    /// The record of the last occurrence that was neither carried out nor taught; else the last
    /// occurrence, so that the service says what is wrong.
    fn last_untaught(&self, utterance: &str, line: usize) -> Result<Seq, PlayError> {
        let wanted = utterance.trim();
        let named = || self.said.iter().rev().filter(|said| said.utterance == wanted);
        let open = named().find(|said| !said.carried_out && !said.settled);
        open.or_else(|| named().next()).map(|said| said.seq).ok_or_else(|| PlayError::Line {
            line,
            reason: format!("{utterance:?} was not said above this line"),
        })
    }

    fn told(&mut self, act: &Act, reply: &Reply) -> Played {
        let mut played = Played { act: Some(RealAct::AsWritten), answers: Vec::new() };
        for told in &reply.told {
            match told {
                Told::EpisodeStarted { goal, fewest } => {
                    self.training = false;
                    let fewest = fewest.map(|n| format!(" (fewest actions: {n})"));
                    let line = format!("episode {goal}{}", fewest.unwrap_or_default());
                    played.act = Some(RealAct::Episode { goal: goal.clone(), line });
                }
                Told::Answered { seq, utterance, answer, actions_before } => {
                    self.said.push(Said {
                        seq: *seq,
                        utterance: utterance.clone(),
                        carried_out: matches!(answer.outcome, Outcome::Understood { .. }),
                        settled: false,
                    });
                    let shown = show(&answer.outcome, &answer.evidence, *actions_before);
                    played.answers.push(shown);
                }
                Told::EpisodeEnded { ending: Ending::Achieved, utterances, actions, .. } => {
                    let line = format!(
                        "achieved ({}, {})",
                        count(*utterances, "utterance"),
                        count(*actions, "action")
                    );
                    played.answers.push((Answer::Achieved, line));
                }
                Told::Taught { lesson, explains, utterance, program, .. } => {
                    self.settle(*explains);
                    self.lessons.push((*lesson, utterance.clone()));
                    if let Act::Teach { .. } = act {
                        played.act = Some(RealAct::Teach { line: format!("({program})") });
                    }
                }
                Told::MarkedWrong { act, .. } => {
                    if let Some(said) = self.said.iter_mut().find(|said| said.seq == *act) {
                        said.carried_out = false;
                    }
                    played.answers.push((Answer::Marked, "w marked".to_owned()));
                }
                Told::Declined { explains, .. } => self.settle(*explains),
                Told::Forgotten { lesson, .. } => {
                    self.lessons.retain(|(live, _)| live != lesson);
                }
                Told::Learning { .. } => self.training = true,
                Told::EpisodeEnded { ending: Ending::Abandoned, .. }
                | Told::Opened { .. }
                | Told::Learned { .. }
                | Told::LearningFailed { .. }
                | Told::Closed { .. } => {}
            }
        }
        played
    }

    fn settle(&mut self, explains: Seq) {
        if let Some(said) = self.said.iter_mut().find(|said| said.seq == explains) {
            said.settled = true;
        }
    }

    /// Ends teaching, unless a forgotten lesson already started a training, and waits.
    fn learn(&mut self, line: &Line) -> Result<Played, PlayError> {
        let number = line.number;
        if !std::mem::take(&mut self.training)
            && let Err(error) = self.robot.finish_teaching()
        {
            return refused(error, number);
        }
        let waited = match self.robot.wait_until_learned(LEARNING_MAX) {
            Ok(waited) => waited,
            Err(error) => return refused(error, number),
        };
        let failed = waited.told.iter().find_map(|told| match told {
            Told::LearningFailed { reason } => Some(reason),
            _ => None,
        });
        if let Some(reason) = failed {
            let code = "learning_failed".to_owned();
            let line = format!("x {code} ({reason})");
            return Ok(Played { act: None, answers: vec![(Answer::Refused(code), line)] });
        }
        let examples = waited.status.exemplars;
        let line = format!("learn {examples} examples");
        Ok(Played { act: Some(RealAct::Learn { examples, line }), answers: Vec::new() })
    }
}

/// The actions `first..last`; one that runs backwards keeps both ends, so that the service says
/// what is wrong with it.
fn run(first: u32, last: u32) -> Vec<u32> {
    let longest = apprentice::limits::EPISODE_ACTIONS_MAX as u32;
    match first <= last && last - first < longest {
        true => (first..=last).collect(),
        false => vec![first, last],
    }
}

fn refused(error: ClientError, line: usize) -> Result<Played, PlayError> {
    match error {
        ClientError::Rejected { code, message } => {
            let code = code_name(code);
            let text = format!("x {code} ({message})");
            Ok(Played { act: None, answers: vec![(Answer::Refused(code), text)] })
        }
        broken => Err(PlayError::Broken { line, reason: broken.to_string() }),
    }
}

/// The code as it stands on the wire: `wrong_phase`.
fn code_name(code: RejectionCode) -> String {
    match serde_json::to_value(code) {
        Ok(serde_json::Value::String(name)) => name,
        other => unreachable!("a rejection code is a plain word, not {other:?}"),
    }
}

pub fn show(outcome: &Outcome, evidence: &Evidence, before: u32) -> (Answer, String) {
    match outcome {
        Outcome::Understood { program, .. } => {
            let (first, last) = (before + 1, before + program.steps.len() as u32);
            let actions = match first == last {
                true => format!("action {first}"),
                false => format!("actions {first}..{last}"),
            };
            let text = format!("= {program} ({actions})");
            (Answer::Understood(program.clone()), text)
        }
        Outcome::Impossible { program, step, reason } => {
            let step = step + 1;
            let text = format!("! impossible {program} step {step} ({reason})");
            (Answer::Impossible(Some((program.clone(), step))), text)
        }
        Outcome::Asked { question } => {
            let labels: Vec<String> =
                question.options.iter().map(|option| option.label.clone()).collect();
            let text = format!("~ asked {} ({})", labels.join(", "), question.text);
            (Answer::Asked(labels), text)
        }
        Outcome::Told { text } => (Answer::Told, format!("i told ({text})")),
        Outcome::NotSure => {
            let remark = evidence.passed_over().or_else(|| nearest(evidence));
            let text = match remark {
                Some(remark) => format!("? not sure ({remark})"),
                None => "? not sure".to_owned(),
            };
            (Answer::NotSure, text)
        }
    }
}

fn nearest(evidence: &Evidence) -> Option<String> {
    let near = evidence.nearest.first()?;
    Some(match near.distance > evidence.threshold {
        true => format!(
            "nearest \"{}\", {:.2} > {:.2}",
            near.exemplar, near.distance, evidence.threshold
        ),
        // Near enough, and still no program: a slot of it had no mention to fill it.
        false => format!("nearest \"{}\", but not all it needs was named", near.exemplar),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use apprentice::language::{Accounted, LiftedUtterance, Mood, Near, Use};

    #[test]
    fn not_sure_says_why_in_a_few_words_that_a_transcript_reads_over() {
        let shown = |evidence: &Evidence| {
            let (answer, text) = show(&Outcome::NotSure, evidence, 0);
            assert_eq!(answer, Answer::NotSure);
            let written = format!("task free\n> did you wash the mug?\n{text}\n");
            let read = Transcript::parse(&written).unwrap();
            let answers =
                read.lines.iter().filter(|line| line.kind == Kind::Answer(Answer::NotSure));
            assert_eq!(answers.count(), 1, "{text}");
            text
        };
        let near = |distance| Near {
            exemplar: LiftedUtterance::parse("open the <obj>"),
            program: "OPEN <obj:1>".parse().unwrap(),
            distance,
            number: 3,
        };
        let mut evidence = Evidence { threshold: 0.5, ..Evidence::default() };
        assert_eq!(shown(&evidence), "? not sure");
        evidence.nearest = vec![near(0.75)];
        assert_eq!(shown(&evidence), "? not sure (nearest \"open the <obj>\", 0.75 > 0.50)");
        evidence.nearest = vec![near(0.25)];
        let text = shown(&evidence);
        assert!(text.ends_with("\"open the <obj>\", but not all it needs was named)"), "{text}");
        let used = |word: &str, used| Accounted { word: word.to_owned(), used };
        evidence.accounting = vec![used("open", Use::Verb), used("banana", Use::Nothing)];
        assert_eq!(shown(&evidence), "? not sure (nothing for \"banana\")");
        evidence.accounting.push(used("kiwi", Use::Nothing));
        assert_eq!(shown(&evidence), "? not sure (nothing for \"banana\", \"kiwi\")");
        for (mood, wanted) in [
            (Mood::Asked { word: "did".into() }, "a question: \"did\""),
            (Mood::Told { word: "i".into() }, "a statement: \"i\""),
            (Mood::Forbidden { word: "not".into() }, "forbidden: \"not\""),
            (Mood::Conditional { word: "until".into() }, "a condition: \"until\""),
            (Mood::Later { word: "tomorrow".into() }, "not now: \"tomorrow\""),
            (Mood::Reordered { word: "before".into() }, "another order: \"before\""),
        ] {
            evidence.mood = Some(mood);
            assert_eq!(shown(&evidence), format!("? not sure ({wanted})"));
        }
    }
}
