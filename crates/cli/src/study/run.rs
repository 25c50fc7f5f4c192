use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use apprentice::ids::Digest;
use apprentice::learning::Recipe;
use apprentice::world::household::{Household, Task};
use apprentice_study::corpus::Corpus;
use apprentice_study::measures::{ALL, SummaryRow, Tables};
use apprentice_study::participant::Teacher;
use apprentice_study::people::People;
use apprentice_study::run::{
    Condition, Design, MeasureError, Participant, Run, RunError, Who, make_tables, recorded_people,
    simulated_people,
};
use clap::Args;
use serde_json::{Value, json};

use super::super::bar::Bar;
use super::super::embedded;
use super::super::eval::tell_bad_lines;
use super::super::failure::Failure;
use super::super::recipe;
use super::super::shown;
use super::report;

/// Users of one study, at most: what a slip of the finger should not start.
const USERS_MAX: u64 = 10_000;
/// Episodes of one user, at most.
const EPISODES_MAX: u64 = 100;
/// Bytes of a teacher file.
const TEACHER_BYTES_MAX: u64 = 64 * 1024;

/// Run or continue a study, and write its tables.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice study run --conditions paper,default,seq2seq-grammar --users 20 --seed 1 --out paper-study
  apprentice study run --conditions default --users-per-type 20 --task-types cool,heat --seed 1 --out crossed
  apprentice study run --conditions paper --corpus utterances.jsonl.gz --seed 1 --out recorded

The study writes utterances.csv, episodes.csv, summary.csv, answered.csv and study.toml to DIR.
docs/study.md describes them and the simulated teachers. To continue a study that stopped, run the same
command again.

Exit codes: 0 the tables are written; 1 the study stopped (the message says how to continue); 2 an
argument, the corpus, the teacher or the directory cannot be used, or --strict found a bad line.")]
pub struct Arguments {
    /// The recipes to compare, separated by commas: built-in names or files.
    #[arg(long, value_name = "NAME,…", default_value = "default", value_delimiter = ',')]
    conditions: Vec<String>,
    /// Simulated users per condition, divided among the task types [default: 20]
    #[arg(long, value_name = "COUNT", conflicts_with_all = ["users_per_type", "corpus"],
        value_parser = clap::value_parser!(u64).range(1..=USERS_MAX))]
    users: Option<u64>,
    /// Instead of --users: simulated users per condition and task type.
    #[arg(long, value_name = "COUNT", conflicts_with = "corpus",
        value_parser = clap::value_parser!(u64).range(1..=USERS_MAX))]
    users_per_type: Option<u64>,
    /// Task types, separated by commas, or all: look, place, nested, two, clean, heat, cool.
    #[arg(long, value_name = "all|TYPE,…", value_delimiter = ',', conflicts_with = "corpus")]
    task_types: Vec<String>,
    /// Episodes per simulated user [default: 5]
    #[arg(long, value_name = "COUNT", conflicts_with = "corpus",
        value_parser = clap::value_parser!(u64).range(1..=EPISODES_MAX))]
    episodes: Option<u64>,
    /// The random seed for tasks, scenes and simulated users.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The directory of the study.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Instead of simulated users: people who use these recorded sentences, one JSON object per line.
    /// The file may be gzipped.
    #[arg(long, value_name = "FILE")]
    corpus: Option<PathBuf>,
    /// The most episodes per recorded person [default: 20]
    #[arg(long, value_name = "COUNT", requires = "corpus",
        value_parser = clap::value_parser!(u64).range(1..=EPISODES_MAX))]
    episodes_max: Option<u64>,
    /// Which people: two thirds for choosing settings, the held-out rest, or all.
    #[arg(long, value_name = "choosing|held-out|all", requires = "corpus")]
    people: Option<People>,
    /// Stop at the first bad line of the corpus.
    #[arg(long, requires = "corpus")]
    strict: bool,
    /// The simulated teacher's settings and words: teacher, teacher-2 (polite, tells things apart and
    /// makes two requests at once), or a TOML file [default: teacher]
    #[arg(long, value_name = "NAME|FILE")]
    teacher: Option<PathBuf>,
    /// How many people talk at the same time. The tables do not depend on it.
    #[arg(long, value_name = "COUNT", default_value_t = 8,
        value_parser = clap::value_parser!(u64).range(1..=256))]
    workers: u64,
    /// Print the summary as one JSON object.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let start = Instant::now();
    let conditions = conditions(&arguments.conditions)?;
    let task_types = task_types(&arguments.task_types)?;
    let teacher = teacher(&arguments)?;
    let household = Arc::new(Household::new());
    let threads = arguments.workers as usize;
    let bar = Bar::new("episodes");
    let mut bad_lines = 0;
    let (who, people) = match &arguments.corpus {
        None => {
            let (users, per_type) = match arguments.users_per_type {
                Some(count) => (count as usize, true),
                None => (arguments.users.unwrap_or(20) as usize, false),
            };
            let episodes = arguments.episodes.unwrap_or(5) as u32;
            let (seed, each) = (arguments.seed, (users, per_type));
            let people = simulated_people(&household, seed, &task_types, each, episodes, threads)
                .map_err(Failure::bad_input)?;
            (Who::Simulated { task_types, users, per_type, episodes }, people)
        }
        Some(path) => {
            let bytes = std::fs::read(path).map_err(|error| {
                let path = path.display();
                Failure::bad_input(format!("the corpus {path} cannot be read: {error}"))
            })?;
            let mut corpus = Corpus::read(path).map_err(Failure::bad_input)?;
            tell_bad_lines(&corpus.bad, arguments.strict)?;
            bad_lines = corpus.bad.len();
            let chosen = arguments.people.unwrap_or(People::All);
            corpus.steps.retain(|row| chosen.include(&row.user));
            let episodes_max = arguments.episodes_max.unwrap_or(20) as u32;
            let recorded =
                recorded_people(&household, arguments.seed, &corpus, episodes_max, threads)
                    .map_err(Failure::bad_input)?;
            tell_left_out(&corpus, recorded.torn, recorded.unstaged);
            let (corpus, people) = (Digest::of(&bytes), chosen.to_string());
            (Who::Recorded { corpus, episodes_max, people }, recorded.people)
        }
    };
    let design = Design { seed: arguments.seed, conditions, who, teacher };
    let study = Run {
        out: &arguments.out,
        design: &design,
        household: household.clone(),
        people: &people,
        workers: threads,
        progress: &bar,
    };
    let finished = study.go();
    bar.finish();
    let finished = finished.map_err(failure)?;
    let tables = make_tables(&arguments.out, &design, &household, &people)
        .map_err(|error| no_tables(error, finished.episodes))?;
    let drawn = report::draw_all(&arguments.out)?;
    let report = match arguments.json {
        true => json_report(&design, &people, &tables, bad_lines),
        false => text_report(&design, &people, &tables, bad_lines),
    };
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(report.as_bytes()).and_then(|()| stdout.flush()).map_err(|error| {
        Failure::failed(format!("the summary cannot be written to standard output: {error}"))
    })?;
    if let Some(report) = drawn.last() {
        eprintln!("apprentice: all figures and tables are in {}", report.display());
    }
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    let cpu = now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9;
    eprintln!(
        "apprentice: {} episodes, {} of them from an earlier run; {:.1} s, {cpu:.1} s of processor \
         time",
        finished.episodes,
        finished.before,
        start.elapsed().as_secs_f64()
    );
    Ok(())
}

fn conditions(names: &[String]) -> Result<Vec<Condition>, Failure> {
    let mut conditions: Vec<Condition> = Vec::new();
    for given in names {
        let given = given.trim();
        let recipe_text = recipe::load(given)?;
        let recipe = Recipe::parse(&recipe_text).map_err(Failure::bad_input)?;
        let name = recipe.name().to_owned();
        // It names directories and stands in tables.
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
        if name.is_empty() || name.starts_with('.') || !name.chars().all(plain) {
            return Err(Failure::bad_input(format!(
                "recipe {given} has the name {name:?}; a condition's name may contain letters, digits, - and _"
            )));
        }
        if conditions.iter().any(|other| other.name == name) {
            return Err(Failure::bad_input(format!("you named the condition {name} twice")));
        }
        conditions.push(Condition { name, recipe_text, recipe });
    }
    Ok(conditions)
}

/// In the order in which forms are known, each once.
fn task_types(names: &[String]) -> Result<Vec<String>, Failure> {
    let mut chosen = BTreeSet::new();
    for name in names {
        match name.trim() {
            "all" => chosen.extend(Task::KINDS),
            name => match Task::KINDS.into_iter().find(|form| *form == name) {
                Some(form) => {
                    chosen.insert(form);
                }
                None => {
                    return Err(Failure::bad_input(format!(
                        "there is no task type {name:?}; the types are {}, or all",
                        Task::KINDS.join(", ")
                    )));
                }
            },
        }
    }
    let all = chosen.is_empty();
    let types = Task::KINDS.into_iter().filter(|form| all || chosen.contains(form));
    Ok(types.map(str::to_owned).collect())
}

fn teacher(arguments: &Arguments) -> Result<Teacher, Failure> {
    let Some(path) = &arguments.teacher else {
        return Teacher::parse(Teacher::TEXT).map_err(Failure::failed);
    };
    if let Some(text) = path.to_str().and_then(Teacher::builtin) {
        return Teacher::parse(text).map_err(Failure::failed);
    }
    let fail = |reason: String| {
        Failure::bad_input(format!("the teacher {} cannot be used: {reason}", path.display()))
    };
    let bytes = std::fs::metadata(path).map_err(|error| fail(error.to_string()))?.len();
    if bytes > TEACHER_BYTES_MAX {
        return Err(fail(format!("it has {bytes} bytes; the limit is {TEACHER_BYTES_MAX}")));
    }
    let text = std::fs::read_to_string(path).map_err(|error| fail(error.to_string()))?;
    Teacher::parse(&text)
        .map_err(|error| Failure::bad_input(format!("{}: {error}", path.display())))
}

fn tell_left_out(corpus: &Corpus, torn: usize, unstaged: usize) {
    if torn + unstaged > 0 {
        eprintln!(
            "apprentice: {torn} recorded tasks are left out because a step is missing, wrong ({} look \
             shifted, {} cannot be said in primitives) or on a bad line; {unstaged} more because no \
             scene suits them",
            corpus.suspect, corpus.inexpressible
        );
    }
}

fn failure(error: RunError) -> Failure {
    match error {
        RunError::Start { error: ref reason, .. } if embedded::is_bad_input(reason) => {
            Failure::bad_input(error)
        }
        RunError::Out { .. } | RunError::NotOurs { .. } | RunError::Different { .. } => {
            Failure::bad_input(error)
        }
        RunError::Start { .. } | RunError::Stopped { .. } => Failure::failed(error),
    }
}

fn no_tables(error: MeasureError, episodes: usize) -> Failure {
    Failure::failed(format!(
        "all {episodes} episodes are finished and saved, but the tables could not be made: {error}; \
         run the same command again to make them"
    ))
}

fn rows<'a>(tables: &'a Tables, condition: &'a str) -> impl Iterator<Item = &'a SummaryRow> {
    tables.summary.iter().filter(move |row| row.condition == condition && row.task_type == ALL)
}

fn who(design: &Design, people: &[Participant]) -> String {
    let count = people.len();
    match design.who {
        Who::Simulated { .. } => format!("{count} simulated users in each condition"),
        Who::Recorded { .. } => format!("{count} recorded people in each condition"),
    }
}

fn text_report(
    design: &Design,
    people: &[Participant],
    tables: &Tables,
    bad_lines: usize,
) -> String {
    let mut text = format!("{}, seed {}\n", who(design, people), design.seed);
    for condition in &design.conditions {
        let rows: Vec<&SummaryRow> = rows(tables, &condition.name).collect();
        let episodes: BTreeSet<u32> = rows.iter().map(|row| row.episode).collect();
        let measures: BTreeSet<&str> = rows.iter().map(|row| &*row.measure).collect();
        let _ = write!(text, "\n{:<22}", condition.name);
        episodes.iter().for_each(|episode| {
            let _ = write!(text, "{episode:>9}");
        });
        text.push('\n');
        for measure in measures {
            let _ = write!(text, "  {:<20}", measure.replace('_', " "));
            for episode in &episodes {
                let row = rows.iter().find(|r| r.episode == *episode && r.measure == measure);
                let value = row.map_or("-".to_owned(), |row| format!("{:.3}", row.mean));
                let _ = write!(text, "{value:>9}");
            }
            text.push('\n');
        }
        for row in tables.answered.iter().filter(|row| row.condition == condition.name) {
            let _ = writeln!(
                text,
                "  {} programs by {} ({:.1} %)",
                row.parses,
                row.answered_by,
                row.share * 100.0
            );
        }
    }
    if bad_lines > 0 {
        let _ = writeln!(text, "\n{bad_lines} bad lines in the corpus");
    }
    text
}

fn json_report(
    design: &Design,
    people: &[Participant],
    tables: &Tables,
    bad_lines: usize,
) -> String {
    let round = |value: f64| (value * 10_000.0).round() / 10_000.0;
    let summary: Vec<Value> = tables
        .summary
        .iter()
        .map(|row| {
            json!({
                "condition": row.condition, "task_type": row.task_type, "episode": row.episode,
                "measure": row.measure, "users": row.users, "mean": round(row.mean),
                "sd": row.sd.map(round),
            })
        })
        .collect();
    let answered: Vec<Value> = tables
        .answered
        .iter()
        .map(|row| {
            json!({
                "condition": row.condition, "answered_by": row.answered_by,
                "parses": row.parses, "share": round(row.share),
            })
        })
        .collect();
    let conditions: Vec<&str> = design.conditions.iter().map(|c| c.name.as_str()).collect();
    let report = json!({
        "seed": design.seed, "simulated": design.who.simulated(), "conditions": conditions,
        "people": people.len(), "episodes": tables.episodes.len(),
        "utterances": tables.utterances.len(), "bad_lines": bad_lines,
        "summary": summary, "answered": answered,
    });
    shown::json_pretty(&report) + "\n"
}
