use std::sync::Arc;

use super::failure::Failure;
use crate::ids::UserId;
use crate::service::{Config, Data, Service, StartError};
use crate::world::household::Household;

/// Starts a service of the household inside this process.
///
/// - errors: with code 2 when what the person named cannot be used (a directory in use, a port
///   that is taken), with code 1 when the service itself failed.
pub fn start(data: Data, recipe_text: String, listen: Vec<String>) -> Result<Service, Failure> {
    let mut config = Config::new(Arc::new(Household::new()), data);
    config.recipe_text = recipe_text;
    config.listen = listen;
    Service::start(config).map_err(|error| match error {
        StartError::Endpoint(_) | StartError::Store(_) | StartError::Gateway(_) => {
            Failure::bad_input(error)
        }
        StartError::Actors(_) => Failure::failed(error),
    })
}

/// The name of a person as it was typed.
pub fn user(name: &str) -> Result<UserId, Failure> {
    UserId::new(name).map_err(Failure::bad_input)
}
