use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use apprentice::actors::{OrderError, TenantRegistry};
use apprentice::evidence::{Checkpoint, NoteSigner, VerifierKey};
use apprentice::ids::TenantId;
use apprentice::replay::{self, ORIGIN, Through, Wanted};
use apprentice::store::{self, OpenError, Store};
use clap::Args;

use super::failure::Failure;
use super::{data_dir, verify};

/// Sign the current contents of a lab's log, so that nobody can rewrite them unnoticed.
///
/// Closes the last segments, signs the tree over all segments, and stores the checkpoint in the
/// directory. Give a copy to others: a checkpoint binds the operator only if somebody else keeps it.
/// Run this only on the live directory. A copy would sign a conflicting history.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  apprentice checkpoint --data lab --origin lab.example.org    the first time: name the service
  apprentice checkpoint --data lab --out may.checkpoint
  apprentice checkpoint --data lab --public-key > lab.pub      what verifiers need
  apprentice checkpoint --data lab --since may.checkpoint --out may-to-june.proof

A running service signs checkpoints itself, at most once a minute and when it stops. The file
checkpoints/TENANT in the data directory contains all checkpoints. docs/evidence.md says what a
checkpoint proves.

Exit codes: 1 the log does not continue what was signed before; 2 the directory or a file cannot be
used.")]
pub struct Arguments {
    /// The data directory. No other process may have it open
    /// [default: $XDG_DATA_HOME/apprentice, else ~/.local/share/apprentice]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// The lab.
    #[arg(long, value_name = "NAME", default_value = "local")]
    tenant: String,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// The name of the service in checkpoints and keys, for example its host. Give it once, before
    /// the first checkpoint [default: apprentice]
    #[arg(long, value_name = "NAME")]
    origin: Option<String>,
    /// Print the public key and sign nothing.
    #[arg(long, conflicts_with_all = ["since"])]
    public_key: bool,
    /// Write a proof for `apprentice verify --since`: the log only grew since this checkpoint.
    #[arg(long, value_name = "OLD_CHECKPOINT")]
    since: Option<PathBuf>,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let tenant = TenantId::new(&arguments.tenant).map_err(Failure::bad_input)?;
    let directory = data_dir::choose(arguments.data)?;
    check_there(&directory)?;
    let store = store::open(&directory).map_err(|error| match error {
        OpenError::Damaged { .. } | OpenError::Database { .. } => Failure::failed(error),
        _ => Failure::bad_input(error),
    })?;
    if !store.log.tenants().map_err(Failure::failed)?.contains(&tenant) {
        let directory = directory.display();
        return Err(Failure::bad_input(format!("{directory} holds no records of tenant {tenant}")));
    }
    if let Some(origin) = &arguments.origin {
        name(&store, &tenant, origin)?;
    }
    let signer = replay::signer_of(&store, &tenant).map_err(Failure::bad_input)?;
    let text = if arguments.public_key {
        format!("{}\n", signer.public())
    } else {
        let since = arguments.since.as_deref().map(|path| older(path, &signer.public()));
        let since = since.transpose()?;
        let failed = |error: OrderError| Failure::failed(error);
        let mut tenant_registry = TenantRegistry::open(store.clone()).map_err(failed)?;
        let note = tenant_registry.sign(&tenant, Through::Head).map_err(failed)?;
        match since {
            None => note,
            Some(since) => {
                let wanted = Wanted { record: None, reveal: false, since: Some(since.size) };
                let registry = tenant_registry.registry(&tenant);
                let proof = replay::prove(&store, &tenant, &registry, &wanted);
                proof.map_err(Failure::failed)?.to_text()
            }
        }
    };
    write(arguments.out.as_deref(), &text)
}

/// Names the service. Refuses if checkpoints with another name exist.
fn name(store: &Store, tenant: &TenantId, origin: &str) -> Result<(), Failure> {
    if origin.is_empty() || origin.ends_with('/') {
        return Err(Failure::bad_input("--origin must be the name of a host or a service"));
    }
    // What else a name may be is for the key to say.
    NoteSigner::new(&format!("{origin}/{tenant}"), &[1; 32])
        .map_err(|error| Failure::bad_input(format!("--origin: {error}")))?;
    let mut signed = false;
    for tenant in store.log.tenants().map_err(Failure::failed)? {
        signed |= store.checkpoints.newest(&tenant).map_err(Failure::failed)?.is_some();
    }
    store.checkpoints.name(origin, signed.then_some(ORIGIN)).map_err(Failure::bad_input)
}

/// An older checkpoint of the same log.
pub(super) fn older(path: &Path, key: &VerifierKey) -> Result<Checkpoint, Failure> {
    let note = verify::read(path)?;
    Checkpoint::open(&String::from_utf8_lossy(&note), key)
        .map_err(|error| Failure::bad_input(format!("{}: {error}", path.display())))
}

/// Opening would make a missing directory, and then sign an empty log.
fn check_there(directory: &Path) -> Result<(), Failure> {
    match directory.join("LAYOUT").exists() || directory.join("log").exists() {
        true => Ok(()),
        false => Err(Failure::bad_input(format!(
            "there is no data directory of apprentice at {}",
            directory.display()
        ))),
    }
}

/// To a new file, or to standard output.
pub(super) fn write(out: Option<&Path>, text: &str) -> Result<(), Failure> {
    match out {
        Some(path) => fs::write(path, text).map_err(|error| {
            Failure::bad_input(format!("{} cannot be written: {error}", path.display()))
        }),
        None => {
            let mut stdout = std::io::stdout().lock();
            stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()).map_err(|error| {
                Failure::failed(format!("standard output cannot be written: {error}"))
            })
        }
    }
}
