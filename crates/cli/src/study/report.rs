use std::io::Write;
use std::path::{Path, PathBuf};

use apprentice_study::measures::Tables;
use apprentice_study::pictures::{About, draw};
use clap::Args;

use crate::failure::Failure;

/// Draw the figures and the report of a finished study again, from its tables.
///
/// The same tables give the same bytes. The figures are SVG and PNG files. report.html contains all
/// figures and the summary tables, without scripts.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  apprentice study report --out study

Exit codes: 0 the names of the files are on standard output; 1 a file cannot be written; 2 a table is
missing or wrong (the message names the file and the line).")]
pub struct Arguments {
    /// The study's directory, with study.toml and the tables. The figures go there too.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub fn run(Arguments { out }: Arguments) -> Result<(), Failure> {
    let written = draw_all(&out)?;
    let names = written.iter().filter_map(|path| path.file_name());
    let text: String = names.map(|name| format!("{}\n", name.display())).collect();
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()).map_err(|error| {
        Failure::failed(format!("the names cannot be written to standard output: {error}"))
    })
}

/// Draws what the tables in `out` have numbers for.
///
/// - returns: the files, the report last.
/// - errors: with code 2 a table is missing or wrong; with code 1 a file cannot be written.
pub(super) fn draw_all(out: &Path) -> Result<Vec<PathBuf>, Failure> {
    let about = About::read(out).map_err(Failure::bad_input)?;
    let tables = Tables::read(out).map_err(Failure::bad_input)?;
    draw(&tables, &about, out).map_err(Failure::failed)
}
