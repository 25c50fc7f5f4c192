//! Reading recorded sentences: one JSON object a line, plain or gzipped. Lines that are no rows are
//! counted and shown, never guessed at.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use apprentice::ids::UserId;
use apprentice::language::{Program, Step, Symbol, Utterance};
use apprentice::world::household::{Kind, Room};
use flate2::read::MultiGzDecoder;
use serde::Deserialize;

/// One recorded sentence with what it was recorded for. Only the sentence ever reaches a parser.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// `trial/annotation/step`, or `trial/annotation` for a whole task.
    pub id: String,
    pub sentence: Utterance,
    /// The action of a step (`CleanObject`), or the kind of a whole task.
    pub label: String,
    /// What was meant, in primitives.
    pub program: Program,
    pub room: Room,
    /// Who wrote it; opaque.
    pub user: String,
    /// Speaks of left, right, straight: nobody types that to a map.
    pub egocentric: bool,
    /// Whether what it toggles is on at first. Recordings do not tell, and lamps are off there.
    pub on: bool,
    /// What the recorded step before it left in the hand, where that step is known and says so.
    pub hand: Option<Symbol>,
    /// What the recorded step after it meant, where that step is known.
    pub next: Option<Program>,
}

/// What a file held: the usable rows, and what was passed over.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Corpus {
    /// Sentences for one step of a task.
    pub steps: Vec<Row>,
    /// Sentences for a whole task.
    pub goals: Vec<Row>,
    /// Rows set aside because what they were recorded for looks shifted.
    pub suspect: usize,
    /// Rows set aside because primitives cannot express them.
    pub inexpressible: usize,
    /// Whole tasks (`trial/annotation`) that lack a step which was set aside or is a bad line.
    pub incomplete: BTreeSet<String>,
    pub bad: Vec<BadLine>,
}

/// A line that is no row: where, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BadLine {
    /// Counted from 1.
    pub line: usize,
    pub reason: String,
}

/// Why a corpus cannot be read at all.
#[derive(Debug, thiserror::Error)]
pub enum CorpusError {
    #[error("the corpus {} cannot be read: {error}", path.display())]
    Read { path: PathBuf, error: std::io::Error },
    #[error("the corpus {} has no usable row ({bad} bad lines); is it the right file?", path.display())]
    Empty { path: PathBuf, bad: usize },
}

/// A line as it stands. The label fields (`next`, `seed`, `verbs`, `says_*`, `core`) are not even
/// read.
#[derive(Deserialize)]
struct Line {
    id: String,
    u: Option<String>,
    act: Option<String>,
    goal: Option<String>,
    task: Option<String>,
    prims: Option<Vec<String>>,
    #[serde(default = "yes")]
    expressible: bool,
    scene: u32,
    user: String,
    #[serde(default)]
    ego: bool,
    #[serde(default)]
    suspect: bool,
}

fn yes() -> bool {
    true
}

impl Corpus {
    /// Reads a file of steps, of whole tasks, or of both.
    ///
    /// - errors: a file that cannot be read, and one without a single usable row.
    pub fn read(path: &Path) -> Result<Corpus, CorpusError> {
        let unreadable = |error| CorpusError::Read { path: path.to_owned(), error };
        let mut file = BufReader::new(File::open(path).map_err(unreadable)?);
        // By the first bytes, not by the name: a renamed file is still what it is.
        let zipped = file.fill_buf().map_err(unreadable)?.starts_with(&[0x1f, 0x8b]);
        let corpus = match zipped {
            true => Corpus::from_lines(BufReader::new(MultiGzDecoder::new(file))),
            false => Corpus::from_lines(file),
        };
        let corpus = corpus.map_err(unreadable)?;
        if corpus.steps.is_empty() && corpus.goals.is_empty() {
            return Err(CorpusError::Empty { path: path.to_owned(), bad: corpus.bad.len() });
        }
        Ok(corpus)
    }

    fn from_lines(lines: impl BufRead) -> std::io::Result<Corpus> {
        let mut corpus = Corpus::default();
        for (index, line) in lines.split(b'\n').enumerate() {
            let line = line?;
            if line.iter().all(u8::is_ascii_whitespace) {
                continue;
            }
            let taken = match serde_json::from_slice::<Line>(&line) {
                Ok(line) => {
                    let task = line.id.rsplit_once('/').map(|(task, _)| task.to_owned());
                    let whole_task = line.u.is_none();
                    let taken = corpus.take(line);
                    if taken != Ok(true) && !whole_task {
                        corpus.incomplete.extend(task);
                    }
                    taken
                }
                Err(error) => Err(error.to_string()),
            };
            if let Err(reason) = taken {
                corpus.bad.push(BadLine { line: index + 1, reason });
            }
        }
        corpus.relate();
        Ok(corpus)
    }

    /// Tells each step what stood before and after it in its task.
    fn relate(&mut self) {
        let place = |row: &Row| {
            let (task, number) = row.id.rsplit_once('/')?;
            Some((task.to_owned(), number.parse::<u32>().ok()?))
        };
        let programs: BTreeMap<(String, u32), Program> =
            self.steps.iter().filter_map(|row| Some((place(row)?, row.program.clone()))).collect();
        for row in &mut self.steps {
            let Some((task, number)) = place(row) else { continue };
            let at = |number: Option<u32>| programs.get(&(task.clone(), number?));
            row.hand = at(number.checked_sub(1)).and_then(left_in_hand);
            row.next = at(number.checked_add(1)).cloned();
        }
    }

    /// - returns: whether the row can be used.
    fn take(&mut self, line: Line) -> Result<bool, String> {
        if line.user.trim().is_empty() {
            return Err("its user is empty".to_owned());
        }
        let user = UserId::new(&line.user);
        user.and_then(|user| user.check_new()).map_err(|error| error.to_string())?;
        let room = room(line.scene).ok_or_else(|| {
            format!(
                "scene {} is in no room; kitchens are 1–30, living rooms 201–230, bedrooms \
                 301–330, bathrooms 401–430",
                line.scene
            )
        })?;
        let (text, label, rows) = match (line.u, line.act, line.goal, line.task) {
            (Some(sentence), Some(action), ..) => (sentence, action, &mut self.steps),
            (None, _, Some(goal), Some(task)) => (goal, task, &mut self.goals),
            (Some(_), None, ..) => return Err("it has a sentence (u) and no act".to_owned()),
            (None, _, Some(_), None) => return Err("it has a goal and no task".to_owned()),
            (None, _, None, _) => return Err("it has neither a sentence (u) nor a goal".to_owned()),
        };
        if line.suspect {
            self.suspect += 1;
            return Ok(false);
        }
        let Some(prims) = line.prims.filter(|_| line.expressible) else {
            self.inexpressible += 1;
            return Ok(false);
        };
        let program: Program =
            prims.join("; ").parse().map_err(|error| format!("{error} in {prims:?}"))?;
        program.steps.iter().try_for_each(check_step)?;
        let sentence = Utterance::new(&text).map_err(|error| format!("{text:?}: {error}"))?;
        let (id, user, egocentric) = (line.id, line.user, line.ego);
        let (on, hand, next) = (false, None, None);
        rows.push(Row { id, sentence, label, program, room, user, egocentric, on, hand, next });
        Ok(true)
    }
}

impl Row {
    /// A row for tests.
    #[cfg(test)]
    pub(super) fn about(room: Room, sentence: &str, program: &str) -> Row {
        Row {
            id: "a/0/0".to_owned(),
            sentence: Utterance::new(sentence).unwrap(),
            label: "PickupObject".to_owned(),
            program: program.parse().unwrap(),
            room,
            user: "u1".to_owned(),
            egocentric: false,
            on: false,
            hand: None,
            next: None,
        }
    }
}

/// What a program leaves in the hand; none as well when it does not touch it.
fn left_in_hand(program: &Program) -> Option<Symbol> {
    let handles = |step: &&Step| step.operator == "PICKUP" || step.operator == "PUT";
    let last = program.steps.iter().rev().find(handles)?;
    (last.operator == "PICKUP").then(|| last.args[0].clone())
}

/// - errors: an action that is no primitive, a wrong number of things, or an unknown kind of thing.
fn check_step(step: &Step) -> Result<(), String> {
    let known = [("GOTO", 1), ("PICKUP", 1), ("PUT", 2), ("OPEN", 1), ("CLOSE", 1), ("TOGGLE", 1)];
    let operator = known.iter().find(|(name, _)| step.operator == **name);
    let Some((name, takes)) = operator else {
        let names = known.map(|(name, _)| name).join(", ");
        return Err(format!("{} is not an action; actions are {names}", step.operator));
    };
    if step.args.len() != *takes {
        let found = step.args.len();
        return Err(format!("{name} takes {takes} things, \"{step}\" has {found}"));
    }
    match step.args.iter().find(|kind| Kind::named(kind.as_str()).is_none()) {
        Some(kind) => Err(format!("there is no type of thing called {kind} in \"{step}\"")),
        None => Ok(()),
    }
}

/// The room of a recorded scene, by its number.
fn room(scene: u32) -> Option<Room> {
    match scene {
        1..=30 => Some(Room::Kitchen),
        201..=230 => Some(Room::LivingRoom),
        301..=330 => Some(Room::Bedroom),
        401..=430 => Some(Room::Bathroom),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    const GOOD: &str = r#"{"id":"a/0/1","u":"take the pan","act":"PickupObject","args":["Pan"],"prims":["PICKUP Pan"],"scene":3,"user":"u1","core":7}"#;

    fn corpus(lines: &[&str]) -> Corpus {
        Corpus::from_lines(lines.join("\n").as_bytes()).unwrap()
    }

    #[test]
    fn bad_lines_are_counted_with_their_reasons_and_labels_are_not_read() {
        let suspect = GOOD.replace("\"scene\"", "\"suspect\":true,\"scene\"");
        let nowhere = GOOD.replace(":3,", ":100,");
        let empty = GOOD.replace("take the pan", "  ");
        let corpus = corpus(&[GOOD, "not json", "", &suspect, "{\"id\":3}", &nowhere, &empty]);
        assert_eq!(corpus.steps.len(), 1);
        assert_eq!(corpus.suspect, 1);
        assert_eq!(corpus.bad.iter().map(|bad| bad.line).collect::<Vec<_>>(), [2, 5, 6, 7]);
        assert!(corpus.bad[2].reason.contains("scene 100 is in no room"), "{:?}", corpus.bad);
        assert!(corpus.bad[3].reason.contains("empty"), "{:?}", corpus.bad);
    }

    #[test]
    fn a_step_knows_what_stood_before_and_after_it() {
        let walk = GOOD.replace("a/0/1", "a/0/2").replace("PICKUP Pan", "GOTO SinkBasin");
        let put = GOOD.replace("a/0/1", "a/0/3").replace("PICKUP Pan", "PUT Pan SinkBasin");
        let other = walk.replace("a/0/2", "b/0/2");
        let corpus = corpus(&[GOOD, &put, &walk, &other]);
        let known = |row: &Row| (row.hand.clone(), row.next.as_ref().map(Program::to_string));
        let known: Vec<_> = corpus.steps.iter().map(known).collect();
        let pan = Some(Symbol::new("Pan"));
        assert_eq!(known[0], (None, Some("GOTO SinkBasin".to_owned())));
        assert_eq!(known[1], (None, None));
        assert_eq!(known[2], (pan, Some("PUT Pan SinkBasin".to_owned())));
        assert_eq!(known[3], (None, None));
    }

    #[test]
    fn steps_and_whole_tasks_may_stand_in_one_file() {
        let goal = r#"{"id":"a/0","goal":"wash a pan","task":"clean","prims":["PICKUP Pan"],"expressible":true,"scene":3,"user":"u1"}"#;
        let hard = goal.replace(":true", ":false");
        let corpus = corpus(&[GOOD, goal, &hard]);
        assert_eq!((corpus.steps.len(), corpus.goals.len(), corpus.inexpressible), (1, 1, 1));
        assert_eq!(corpus.goals[0].label, "clean");
        assert_eq!(corpus.goals[0].room, Room::Kitchen);
    }

    #[test]
    fn a_zipped_file_reads_like_a_plain_one() {
        let mut plain = tempfile::NamedTempFile::new().unwrap();
        writeln!(plain, "{GOOD}\nnot json").unwrap();
        let zipped = tempfile::NamedTempFile::new().unwrap();
        let mut encoder = flate2::write::GzEncoder::new(&zipped, flate2::Compression::fast());
        writeln!(encoder, "{GOOD}\nnot json").unwrap();
        encoder.finish().unwrap();
        let read = Corpus::read(plain.path()).unwrap();
        assert_eq!(read, Corpus::read(zipped.path()).unwrap());
        assert_eq!((read.steps.len(), read.bad.len()), (1, 1));
    }

    #[test]
    fn a_file_without_rows_is_refused() {
        let file = tempfile::NamedTempFile::new().unwrap();
        assert!(matches!(Corpus::read(file.path()), Err(CorpusError::Empty { bad: 0, .. })));
        let absent = Corpus::read(Path::new("no/such/file")).unwrap_err();
        assert!(absent.to_string().contains("no/such/file cannot be read"), "{absent}");
    }
}
