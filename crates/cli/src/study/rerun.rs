use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;

use apprentice::ids::TenantId;
use apprentice::learning::Recipe;
use apprentice::plain;
use apprentice::replay;
use apprentice::world::household::Household;
use apprentice_study::rerun::{self, Report, Variant, With};
use clap::Args;

use crate::bar::Bar;
use crate::failure::Failure;
use crate::{embedded, past, recipe, shown};

/// Answer every recorded utterance again, with another threshold or another recipe.
///
/// Another threshold uses the recorded minds. Another recipe trains minds with the lessons that
/// existed at that time. After the first different action of an episode, the user would have gone on
/// differently. So the report gives two numbers: up to that turn, and over all turns. The command
/// works on a copy and does not change the directory.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice study rerun --data lab --with tau=0.3
  apprentice study rerun --data lab --with tau=0.1..0.6/0.1 --out sweep.csv
  apprentice study rerun --data lab --with condition=seq2seq-grammar --user ada
  apprentice study rerun --data lab --with recipe=mine.toml --json | jq '.variants[].up_to_the_end'

docs/rerun.md says what you can conclude from a rerun and what you cannot.

Exit codes: 0 the report is on standard output; 1 some records could not be read (the report says
whose); 2 the directory, the user or --with cannot be used.")]
pub struct Arguments {
    /// The data directory. The command works on a copy of it
    /// [default: $XDG_DATA_HOME/apprentice, else ~/.local/share/apprentice]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// The other configuration: a threshold, a range of thresholds, a built-in recipe (default,
    /// default-1, default-2, paper, …), or a recipe file.
    #[arg(long, value_name = "tau=T[..TO/STEP]|condition=NAME|recipe=FILE")]
    with: With,
    /// Only the users of this lab.
    #[arg(long, value_name = "NAME")]
    tenant: Option<String>,
    /// Only this user, of the lab in --tenant or of `local`.
    #[arg(long, value_name = "NAME")]
    user: Option<String>,
    /// Also write a table of all turns, including equal answers.
    #[arg(long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
    /// Print one JSON object, without times.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let variants = variants(&arguments.with)?;
    let tenant = arguments.tenant.as_deref().map(TenantId::new).transpose();
    let tenant = tenant.map_err(Failure::bad_input)?;
    let user = arguments.user.as_deref().map(embedded::user).transpose()?;
    let past = past::open(arguments.data)?;
    let streams = match (&tenant, &user) {
        (tenant, Some(user)) => {
            vec![past.stream(tenant.as_ref().unwrap_or(&TenantId::local()), user)?]
        }
        (Some(tenant), None) => {
            past.check_tenant(tenant)?;
            replay::streams_of(&past.store, Some(tenant)).map_err(Failure::failed)?
        }
        (None, None) => replay::streams_of(&past.store, None).map_err(Failure::failed)?,
    };
    let threads = thread::available_parallelism().map_or(1, |cores| cores.get());
    let (domain, bar) = (Arc::new(Household::new()), Bar::new("records"));
    let found = rerun::rerun(&domain, &past.store, &streams, &variants, threads, &bar);
    bar.finish();
    if let Some(path) = &arguments.out {
        std::fs::write(path, rerun::table(&variants, &found.lives)).map_err(|error| {
            Failure::failed(format!("the table {} cannot be written: {error}", path.display()))
        })?;
    }
    let text = match arguments.json {
        true => shown::json_pretty(&found.report) + "\n",
        false => plain::escape_lines(&found.report.to_string()).into_owned(),
    };
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()).map_err(|error| {
        Failure::failed(format!("the report cannot be written to standard output: {error}"))
    })?;
    judge(&found.report)
}

fn variants(with: &With) -> Result<Vec<Variant>, Failure> {
    let read = |name: &str| -> Result<Recipe, Failure> {
        Recipe::parse(&recipe::load(name)?).map_err(Failure::bad_input)
    };
    Ok(match with {
        With::Thresholds(values) => values.iter().map(|tau| Variant::threshold(*tau)).collect(),
        With::Conditions(names) => {
            let variant = |name: &String| Ok(Variant::condition(name, read(name)?));
            names.iter().map(variant).collect::<Result<_, Failure>>()?
        }
        With::File(file) => vec![Variant::recipe(read(file)?)],
    })
}

/// A report without people is an error.
fn judge(report: &Report) -> Result<(), Failure> {
    if report.left_out.iter().any(|gap| gap.is_fault) {
        return Err(Failure::differences());
    }
    match (report.people, report.left_out.first()) {
        (0, Some(first)) => {
            Err(Failure::bad_input(format!("no records can be rerun with this: {}", first.why)))
        }
        (0, None) => Err(Failure::bad_input("there are no records to rerun")),
        _ => Ok(()),
    }
}
