use std::path::PathBuf;
use std::sync::Arc;

use apprentice::ids::UserId;
use apprentice::service::{Config, Data, Service, StartError};
use apprentice::store::FaultPlan;
use apprentice::world::household::Household;

use super::failure::Failure;

/// What a service of the household is started with.
pub struct Wanted {
    pub data: Data,
    pub recipe_text: String,
    pub listen: Vec<String>,
    pub listen_curve: Vec<String>,
    pub feed: Option<String>,
    pub server_key: Option<PathBuf>,
    pub faults: Option<FaultPlan>,
}

impl Wanted {
    /// A service for this process alone.
    pub fn inside(data: Data, recipe_text: String) -> Wanted {
        Wanted {
            data,
            recipe_text,
            listen: Vec::new(),
            listen_curve: Vec::new(),
            feed: None,
            server_key: None,
            faults: None,
        }
    }
}

/// Starts a service of the household inside this process.
///
/// - errors: with code 2 when what the person named cannot be used (a directory in use, a port
///   that is taken), with code 1 when the service itself failed.
pub fn start(wanted: Wanted) -> Result<Service, Failure> {
    let mut config = Config::new(Arc::new(Household::new()), wanted.data);
    config.recipe_text = wanted.recipe_text;
    config.faults = wanted.faults;
    config.listen = wanted.listen;
    config.listen_curve = wanted.listen_curve;
    config.feed = wanted.feed;
    config.server_key = wanted.server_key;
    Service::start(config).map_err(|error| match is_bad_input(&error) {
        true => Failure::bad_input(error),
        false => Failure::failed(error),
    })
}

/// Whether a service did not start because of what the person named.
pub fn is_bad_input(error: &StartError) -> bool {
    match error {
        StartError::Endpoint(_)
        | StartError::FeedAlone
        | StartError::ServerKey(_)
        | StartError::Store(_)
        | StartError::Gateway(_) => true,
        StartError::Actors(_) | StartError::Drill(_) => false,
    }
}

/// The name of a person as it was typed.
pub fn user(name: &str) -> Result<UserId, Failure> {
    UserId::new(name).map_err(Failure::bad_input)
}
