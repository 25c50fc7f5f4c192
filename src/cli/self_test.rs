use std::io::Write;

use clap::Args;
use serde_json::json;

use super::failure::Failure;
use crate::learning::code_digest;
use crate::numerics::{Kernel, NumericsVersion};
use crate::study::known_minds::train_all;

/// Check that this machine learns the same bits as every other.
///
/// Trains a few known histories and compares the digests of their minds with those that this version
/// has everywhere. A mind that was learned elsewhere comes back here only if they agree.
#[derive(Debug, Args)]
#[command(after_help = "\
Exit codes: 0 every digest agrees; 1 some do not, and each line says which.")]
pub struct Arguments {
    /// One JSON object a line, with whole digests.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    let mut print = |line: String| {
        writeln!(stdout, "{line}").and_then(|()| stdout.flush()).map_err(|error| {
            Failure::failed(format!("standard output cannot be written to: {error}"))
        })
    };
    let (mut trained, mut differ) = (0, 0);
    for known in train_all() {
        let known = known.map_err(Failure::failed)?;
        trained += 1;
        differ += usize::from(!known.agrees());
        print(match arguments.json {
            true => json!({
                "recipe": known.recipe,
                "history": known.history,
                "mind": known.digest,
                "pinned": known.pinned,
            })
            .to_string(),
            false => format!(
                "{:<15} {:<8} {}  {}",
                known.recipe,
                known.history,
                known.digest.short(),
                match (known.agrees(), known.pinned) {
                    (true, _) => "as everywhere".to_owned(),
                    (false, Some(pinned)) => format!("DIFFERS: {} elsewhere", pinned.short()),
                    (false, None) => "is not pinned".to_owned(),
                }
            ),
        })?;
    }
    if !arguments.json {
        print(format!(
            "{trained} minds trained, {differ} differ; code {}, arithmetic {}, kernel {:?}",
            code_digest().short(),
            NumericsVersion::CURRENT.0,
            Kernel::current(),
        ))?;
    }
    match differ {
        0 => Ok(()),
        _ => Err(Failure::differences()),
    }
}
