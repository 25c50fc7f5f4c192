use std::path::PathBuf;

use apprentice::store;
use clap::Args;

use super::data_dir;
use super::failure::Failure;

/// Import an exported tenant into a data directory.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice import --data new-lab --in lab.apx
  apprentice import --data new-lab --in lab.apx --key /media/stick/lab.apx.key

The file is checked first. Then all of it is imported, or nothing. The directory may be new, or contain
other tenants. It must not contain this tenant.

Exit codes: 1 the export or its key is damaged (the message names the frame); 2 a file or the
directory cannot be used.")]
pub struct Arguments {
    /// The data directory. It is made if it does not exist
    /// [default: $XDG_DATA_HOME/apprentice, else ~/.local/share/apprentice]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// The exported file.
    #[arg(long = "in", value_name = "FILE")]
    input: PathBuf,
    /// The tenant's secret [default: FILE.key]
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let directory = data_dir::choose(arguments.data)?;
    let key = arguments.key.unwrap_or_else(|| store::key_file_of(&arguments.input));
    let imported =
        store::import(&directory, &arguments.input, &key).map_err(|error| match error {
            store::ImportError::Damaged { .. }
            | store::ImportError::Key { .. }
            | store::ImportError::Failed { .. } => Failure::failed(error),
            other => Failure::bad_input(other),
        })?;
    let (tenant, counts) = (imported.tenant, imported.counts);
    println!("imported {} records of {} people of tenant {tenant}", counts.records, counts.people);
    Ok(())
}
