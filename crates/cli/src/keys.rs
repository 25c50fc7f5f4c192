use std::path::PathBuf;

use apprentice::client::{CurveKey, show_key};
use apprentice::service::server_key_file;
use clap::{Args, Subcommand};

use super::data_dir;
use super::failure::Failure;

/// Make and show the keys that services and labs use to recognise each other.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice keys new --out lab.key
  apprentice keys show --file lab.key
  apprentice keys show --data labs

Keep the key file secret. Give others only the public key, which is printed and is also in FILE.pub.
The files are ZeroMQ certificates. Other ZeroMQ programs can read them.

Exit codes: 0 done; 2 a file cannot be used.")]
pub struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Make a key for a gateway, an operator or an auditor, and print its public key.
    New {
        /// The file for the secret key. Only you can read it. The public key goes to FILE.pub.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
    /// Print the public key of a key file, or of the service in a data directory.
    Show {
        /// A key file.
        #[arg(long, value_name = "FILE", conflicts_with = "data")]
        file: Option<PathBuf>,
        /// A data directory. The key of its service is made if it is missing
        /// [default: $XDG_DATA_HOME/apprentice, else ~/.local/share/apprentice]
        #[arg(long, value_name = "DIR")]
        data: Option<PathBuf>,
    },
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let key = match arguments.verb {
        Verb::New { out } => {
            let key = CurveKey::new().map_err(Failure::failed)?;
            let public = key.write_new(&out).map_err(Failure::bad_input)?;
            eprintln!("apprentice: the secret key is in {}; keep it secret", out.display());
            eprintln!("apprentice: the public key is in {}", public.display());
            key
        }
        Verb::Show { file: Some(file), .. } => CurveKey::read(&file).map_err(Failure::bad_input)?,
        Verb::Show { file: None, data } => {
            let directory = data_dir::choose(data)?;
            data_dir::must_hold_data(&directory)?;
            CurveKey::read_or_make(&server_key_file(&directory)).map_err(Failure::bad_input)?
        }
    };
    println!("{}", show_key(key.public()));
    Ok(())
}
