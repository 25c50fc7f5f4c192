use std::io::Write;

use apprentice::learning::code_digest;
use apprentice::numerics::{Kernel, NumericsVersion};
use apprentice_study::known_minds::train_all;
use clap::Args;
use serde_json::json;

use super::failure::Failure;

/// Check that this machine trains exactly the same minds as every other machine.
///
/// Trains the minds of a few known histories and compares their digests with the known ones. If they
/// differ, do not move data to or from this machine.
#[derive(Debug, Args)]
#[command(after_help = "\
Exit codes: 0 all digests agree; 1 some differ (each line says which).")]
pub struct Arguments {
    /// Print one JSON object per line, with full digests.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    let mut print = |line: String| {
        writeln!(stdout, "{line}")
            .and_then(|()| stdout.flush())
            .map_err(|error| Failure::failed(format!("standard output cannot be written: {error}")))
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
                    (true, _) => "agrees".to_owned(),
                    (false, Some(pinned)) => format!("DIFFERS: expected {}", pinned.short()),
                    (false, None) => "has no known digest".to_owned(),
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
