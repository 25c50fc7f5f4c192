use std::io;

use clap::{Args, ValueEnum};
use tracing_subscriber::EnvFilter;

use super::failure::Failure;

/// The environment variable that filters when the flag does not.
const FILTER_VARIABLE: &str = "APPRENTICE_LOG";

/// How the program logs about itself. What people say is in the event log, never here.
#[derive(Debug, Clone, Args)]
pub struct Logging {
    /// Which log lines to write to standard error, such as info or apprentice::store=debug.
    ///
    /// Without it the environment variable APPRENTICE_LOG decides; without both, warn (and info
    /// for serve).
    #[arg(long, value_name = "FILTER", global = true, help_heading = "Logging")]
    log_filter: Option<String>,
    /// The form of log lines.
    #[arg(long, value_enum, default_value_t = Format::Pretty, global = true, help_heading = "Logging")]
    log_format: Format,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// For people.
    Pretty,
    /// One JSON object per line.
    Json,
}

impl Logging {
    /// Sets the process's subscriber. Call once.
    ///
    /// - `otherwise`: the filter when neither flag nor environment gives one.
    /// - errors: a filter that cannot be read.
    pub fn start(&self, otherwise: &str) -> Result<(), Failure> {
        let from_environment = std::env::var(FILTER_VARIABLE).ok().filter(|text| !text.is_empty());
        let (text, source) = match (&self.log_filter, from_environment) {
            (Some(flag), _) => (flag.clone(), "--log-filter"),
            (None, Some(variable)) => (variable, FILTER_VARIABLE),
            (None, None) => (otherwise.to_owned(), "the default filter"),
        };
        let filter = EnvFilter::builder().parse(&text).map_err(|error| {
            Failure::bad_input(format!(
                "{source} {text:?} is not a log filter: {error}; use for example info or \
                 apprentice::store=debug"
            ))
        })?;
        let builder = tracing_subscriber::fmt().with_env_filter(filter).with_writer(io::stderr);
        let set = match self.log_format {
            Format::Pretty => builder.try_init(),
            Format::Json => builder.json().flatten_event(true).try_init(),
        };
        // A program that embeds this one may have its own subscriber; that one stays.
        if let Err(error) = set {
            tracing::debug!(%error, "another log subscriber is in place");
        }
        Ok(())
    }
}
