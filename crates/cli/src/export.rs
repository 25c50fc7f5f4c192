use std::fs::{self, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use apprentice::ids::{Seq, TenantId};
use apprentice::plain::count;
use apprentice::store;
use clap::Args;
use serde_json::Value;

use super::failure::Failure;
use super::{data_dir, log, shown};

/// Write one tenant to a file, to import it elsewhere or to analyse it.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice export --data lab --out lab.apx
  apprentice export --data lab --out lab.ndjson --ndjson

This makes two files. FILE contains all sealed records. Without FILE.key it shows only how many users
there are, how much they said and when. FILE.key is the tenant's secret and decrypts everything: send it
another way, and keep it like a password. With --ndjson there is one file, which contains everything
that users said, decrypted. Only you can read these files.

Exit codes: 1 a record cannot be read; 2 the directory or the file cannot be used.")]
pub struct Arguments {
    /// The data directory. It is not changed
    /// [default: $XDG_DATA_HOME/apprentice, else ~/.local/share/apprentice]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// The lab to export.
    #[arg(long, value_name = "NAME", default_value = "local")]
    tenant: String,
    /// The new file. It must not exist.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Instead, write every record decrypted, one JSON object per line.
    #[arg(long)]
    ndjson: bool,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let tenant = TenantId::new(&arguments.tenant).map_err(Failure::bad_input)?;
    let directory = data_dir::choose(arguments.data)?;
    if arguments.ndjson {
        return ndjson(&directory, &tenant, &arguments.out);
    }
    let exported =
        store::export(&directory, &tenant, &arguments.out).map_err(|error| match error {
            store::ExportError::Damaged { .. } | store::ExportError::Heads { .. } => {
                Failure::failed(error)
            }
            other => Failure::bad_input(other),
        })?;
    println!("exported {} records of {} people", exported.records, exported.people);
    let key = store::key_file_of(&arguments.out);
    eprintln!(
        "apprentice: {} decrypts all of it; keep it secret and in another place",
        key.display()
    );
    Ok(())
}

fn ndjson(directory: &Path, tenant: &TenantId, out: &Path) -> Result<(), Failure> {
    let copy = store::copy_private(directory).map_err(Failure::bad_input)?;
    let store = copy.open().map_err(Failure::bad_input)?;
    let streams = store.log.streams(tenant).map_err(Failure::failed)?;
    if streams.is_empty() {
        return Err(Failure::bad_input(format!("there are no records of tenant {tenant}")));
    }
    let failed = |error: io::Error| {
        Failure::bad_input(format!("{} cannot be written: {error}", out.display()))
    };
    let file = OpenOptions::new().write(true).create_new(true).mode(0o600).open(out);
    let mut file = BufWriter::new(file.map_err(failed)?);
    let people = streams.iter().filter(|stream| !stream.is_tenants()).count() as u64;
    let (mut records, mut erased) = (0_u64, 0_u64);
    let written = (|| {
        for stream in &streams {
            let read = match store.log.read(stream, Seq::FIRST) {
                Err(store::ReadError::Erased) => {
                    erased += 1;
                    continue;
                }
                read => read.map_err(Failure::failed)?,
            };
            for record in read {
                let record =
                    record.map_err(|error| Failure::failed(format!("stream {stream}: {error}")))?;
                let mut line = log::json(&record);
                if let Value::Object(fields) = &mut line {
                    fields.insert("stream".to_owned(), stream.to_string().into());
                }
                writeln!(file, "{}", shown::json(&line)).map_err(failed)?;
                records += 1;
            }
        }
        file.flush().and_then(|()| file.get_ref().sync_all()).map_err(failed)
    })();
    if written.is_err() {
        // Half of it could be taken for all of it.
        let _ = fs::remove_file(out);
    }
    written?;
    println!("exported {records} records of {} people", people - erased);
    if erased > 0 {
        eprintln!("apprentice: left out because erased: {}", count(erased, "user"));
    }
    Ok(())
}
