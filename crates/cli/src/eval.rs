use std::io::Write;
use std::path::{Path, PathBuf};

use apprentice::learning::Recipe;
use apprentice::plain;
use apprentice_study::ablation::{Ablation, Variant, ablate};
use apprentice_study::conversation::{ConversationError, conversation};
use apprentice_study::corpus::{BadLine, Corpus};
use apprentice_study::goals::goals;
use apprentice_study::one_shot::one_shot;
use apprentice_study::people::People;
use apprentice_study::primitives::primitives;
use apprentice_study::report::{Setting, Teachers};
use apprentice_study::scenes::Staging;
use clap::{Args, ValueEnum};
use serde::Serialize;

use super::bar::Bar;
use super::failure::Failure;
use super::{recipe, shown};

/// Bad lines shown; all are counted.
const BAD_LINES_SHOWN: usize = 5;
/// The seeds that run when none is named.
const SEEDS: [u64; 3] = [1, 2, 3];
/// Episodes and rows of one seed, at most: what a slip of the finger should not start.
const LIMIT_MAX: u64 = 1_000_000;

/// Measure how many recorded human sentences the robot understands.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice eval --corpus utterances.jsonl.gz --protocol primitives
  apprentice eval --corpus utterances.jsonl.gz --protocol one-shot --recipe paper --limit 6
  apprentice eval --corpus goals.jsonl.gz --protocol goals --seed 1 --json
  apprentice eval --corpus utterances.jsonl.gz --protocol one-shot --lessons 3 --teachers several
  apprentice eval --corpus utterances.jsonl.gz --protocol primitives --cases 10
  apprentice eval --corpus utterances.jsonl.gz --ablation tools/ablation.toml --people choosing
  apprentice eval --corpus utterances.jsonl.gz --ablation tools/additions.toml --recipe paper
  apprentice eval --protocol conversation crates/study/data/conversations/look --cases 20

docs/evaluation.md describes the corpus, the protocols and every number.

Exit codes: 0 the results are on standard output; 1 a training failed; 2 the corpus, a transcript or
the recipe cannot be used, or --strict found a bad line.")]
pub struct Arguments {
    /// For --protocol conversation: a directory of transcripts (*.txt) and their scene files.
    #[arg(value_name = "DIR", conflicts_with_all = ["corpus", "ablation", "limit", "lessons",
        "teachers", "people", "staging", "failures", "strict"])]
    conversations: Option<PathBuf>,
    /// The recorded sentences, one JSON object per line. The file may be gzipped.
    #[arg(long, value_name = "FILE", required_unless_present = "conversations")]
    corpus: Option<PathBuf>,
    /// What to measure.
    #[arg(long, value_enum, required_unless_present = "ablation")]
    protocol: Option<Protocol>,
    /// Instead of a protocol: remove, or add, the listed settings of the recipe one at a time, and show
    /// how primitives and one-shot change. --limit counts rows; there are 24 episodes per seed.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["protocol", "failures", "cases", "lessons", "teachers"])]
    ablation: Option<PathBuf>,
    /// The recipe to train with: default, default-1, default-2, paper, grammar, seq2seq, seq2seq-grammar, or
    /// a file.
    #[arg(long, value_name = "NAME|FILE", default_value = "default")]
    recipe: String,
    /// The random seed for rows, scenes and training [default: seeds 1, 2 and 3]. For conversation:
    /// the training seed, instead of the recipe's own.
    #[arg(long)]
    seed: Option<u64>,
    /// Rows per seed, or episodes for one-shot and goals [default: all rows, or 24 episodes]
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..=LIMIT_MAX))]
    limit: Option<u64>,
    /// Sentences to teach in each episode of one-shot or goals.
    #[arg(long, value_name = "COUNT", default_value_t = 1,
        value_parser = clap::value_parser!(u64).range(1..=50))]
    lessons: u64,
    /// Whether one person said all the sentences of an episode, or several people.
    #[arg(long, value_name = "one|several", default_value = "one")]
    teachers: Teachers,
    /// What is in the scenes. plain: only what the meaning needs. held: also what the words imply,
    /// for example a mug in the hand for "take the mug to the sink", or a lamp that is on for "turn
    /// off the lamp".
    #[arg(long, value_name = "plain|held", default_value = "plain")]
    staging: Staging,
    /// Which people: two thirds for choosing settings, the held-out rest, or all.
    #[arg(long, value_name = "choosing|held-out|all", default_value = "all")]
    people: People,
    /// Also show this many failures of each kind (not with --json).
    #[arg(long, value_name = "COUNT", default_value_t = 0, conflicts_with = "json")]
    failures: usize,
    /// Also list this many random failures of each verdict, as Markdown without the recorded
    /// sentences. For conversation: the first lines of each class (not with --json).
    #[arg(long, value_name = "COUNT", default_value_t = 0, conflicts_with = "json")]
    cases: usize,
    /// Stop at the first bad line of the corpus.
    #[arg(long)]
    strict: bool,
    /// The number of threads.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u64).range(1..=64))]
    threads: u64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Protocol {
    /// Sentences for one primitive, before any lesson.
    Primitives,
    /// One sentence for washing, heating or cooling is taught.
    OneShot,
    /// One sentence for a whole task is taught.
    Goals,
    /// Transcripts that say what each utterance meant; the arguments name their directory.
    Conversation,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let text = recipe::load(&arguments.recipe)?;
    let recipe = Recipe::parse(&text).map_err(Failure::bad_input)?;
    if let Some(directory) = &arguments.conversations {
        return converse(&arguments, &recipe, directory);
    }
    let Some(path) = arguments.corpus.as_deref().filter(|_| !arguments.asks_for_conversations())
    else {
        return Err(Failure::bad_input(
            "--protocol conversation needs a directory of transcripts, not a corpus",
        ));
    };
    let variants = arguments.ablation.as_deref().map(|path| variants(path, &text)).transpose()?;
    let mut corpus = Corpus::read(path).map_err(Failure::bad_input)?;
    tell_bad_lines(&corpus.bad, arguments.strict)?;
    let bad_lines = corpus.bad.len();
    let people = arguments.people;
    corpus.steps.retain(|row| people.include(&row.user));
    corpus.goals.retain(|row| people.include(&row.user));
    check_rows(&arguments, path, &corpus)?;

    let one = arguments.seed.map(|seed| [seed]);
    let seeds = one.as_ref().map_or(&SEEDS[..], |one| &one[..]);
    let bar = Bar::new("");
    let setting = arguments.setting(&recipe, seeds, &bar);
    let report = match (arguments.protocol, variants) {
        (_, Some((variants, adds))) => ablate(&setting, &corpus, &variants, adds)
            .map(|report| printed(&report, &arguments, bad_lines)),
        (Some(Protocol::Primitives), None) => primitives(&setting, &corpus.steps)
            .map(|report| printed(&report, &arguments, bad_lines)),
        (Some(Protocol::Goals), None) => {
            goals(&setting, &corpus).map(|report| printed(&report, &arguments, bad_lines))
        }
        (Some(Protocol::OneShot | Protocol::Conversation) | None, None) => {
            one_shot(&setting, &corpus).map(|report| printed(&report, &arguments, bad_lines))
        }
    };
    bar.finish();
    let report =
        report.map_err(|error| Failure::failed(format!("recipe {}: {error}", arguments.recipe)))?;
    write(&report)
}

/// Runs the protocol on transcripts, which needs no corpus.
fn converse(arguments: &Arguments, recipe: &Recipe, directory: &Path) -> Result<(), Failure> {
    if !arguments.asks_for_conversations() {
        return Err(Failure::bad_input(
            "use --protocol conversation with a directory of transcripts",
        ));
    }
    let bar = Bar::new("");
    let one = arguments.seed.map(|seed| [seed]);
    let seeds = one.as_ref().map_or(&[][..], |one| &one[..]);
    let report = conversation(&arguments.setting(recipe, seeds, &bar), directory);
    bar.finish();
    let report = report.map_err(|error| match error {
        ConversationError::Training(error) => {
            Failure::failed(format!("recipe {}: {error}", arguments.recipe))
        }
        error => Failure::bad_input(error),
    })?;
    match arguments.json {
        true => write(&(shown::json_pretty(&report) + "\n")),
        false => write(&plain::escape_lines(&report.to_string())),
    }
}

impl Arguments {
    fn asks_for_conversations(&self) -> bool {
        self.protocol == Some(Protocol::Conversation)
    }

    fn setting<'a>(&self, recipe: &'a Recipe, seeds: &'a [u64], bar: &'a Bar) -> Setting<'a> {
        Setting {
            recipe,
            seeds,
            limit: self.limit.map(|limit| limit as usize),
            people: self.people,
            threads: self.threads as usize,
            progress: bar,
            lessons: self.lessons as usize,
            teachers: self.teachers,
            staging: self.staging,
            failures: self.failures,
            cases: self.cases,
        }
    }
}

fn write(report: &str) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(report.as_bytes()).and_then(|()| stdout.flush()).map_err(|error| {
        Failure::failed(format!("the report cannot be written to standard output: {error}"))
    })
}

/// The recipes that an ablation compares, and whether they add to the first.
fn variants(path: &Path, recipe: &str) -> Result<(Vec<Variant>, bool), Failure> {
    let fail = |reason: String| {
        Failure::bad_input(format!("the ablation {} cannot be used: {reason}", path.display()))
    };
    let text = std::fs::read_to_string(path).map_err(|error| fail(error.to_string()))?;
    let ablation = Ablation::parse(&text).map_err(fail)?;
    Ok((ablation.variants(recipe).map_err(fail)?, ablation.adds()))
}

/// A report with what reading the corpus found.
#[derive(Serialize)]
struct WithCorpus<'a, R> {
    #[serde(flatten)]
    report: &'a R,
    bad_lines: usize,
}

fn printed<R: Serialize + std::fmt::Display>(
    report: &R,
    arguments: &Arguments,
    bad_lines: usize,
) -> String {
    if !arguments.json {
        return match bad_lines {
            0 => plain::escape_lines(&report.to_string()).into_owned(),
            count => {
                let report = format!("{report}\n{count} bad lines in the corpus\n");
                plain::escape_lines(&report).into_owned()
            }
        };
    }
    shown::json_pretty(&WithCorpus { report, bad_lines }) + "\n"
}

/// Shows the first bad lines of a corpus on standard error.
///
/// - errors: with `strict` the first one.
pub fn tell_bad_lines(bad: &[BadLine], strict: bool) -> Result<(), Failure> {
    if let Some(BadLine { line, reason }) = bad.first().filter(|_| strict) {
        return Err(Failure::bad_input(format!("line {line} of the corpus is bad: {reason}")));
    }
    for BadLine { line, reason } in bad.iter().take(BAD_LINES_SHOWN) {
        let reason = plain::escape(reason);
        eprintln!("apprentice: line {line} of the corpus is left out: {reason}");
    }
    if bad.len() > BAD_LINES_SHOWN {
        let more = bad.len() - BAD_LINES_SHOWN;
        eprintln!(
            "apprentice: {more} more lines are left out; --strict stops at the first bad line"
        );
    }
    Ok(())
}

/// - errors: a corpus that has nothing for the protocol.
fn check_rows(arguments: &Arguments, path: &Path, corpus: &Corpus) -> Result<(), Failure> {
    let (needed, found, other) = match arguments.protocol {
        Some(Protocol::Primitives | Protocol::OneShot | Protocol::Conversation) | None => {
            ("sentences for single steps (u)", corpus.steps.len(), corpus.goals.len())
        }
        Some(Protocol::Goals) => {
            ("sentences for whole tasks (goal)", corpus.goals.len(), corpus.steps.len())
        }
    };
    if found > 0 {
        return Ok(());
    }
    Err(Failure::bad_input(format!(
        "the corpus {} has no {needed} for --people {}; it has {other} sentences of the other kind",
        path.display(),
        arguments.people
    )))
}
