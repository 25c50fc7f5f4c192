use std::path::PathBuf;

use apprentice::client::{Client, CurveKey, Identity, read_public};
use apprentice::ids::UserId;
use clap::Args;

use super::failure::Failure;

/// The keys for a service that admits only known keys.
#[derive(Debug, Args)]
pub struct Credentials {
    /// Your key file, made by `apprentice keys new`.
    #[arg(long, value_name = "FILE", requires = "server_key")]
    key: Option<PathBuf>,
    /// The service's public key: 40 characters, or a file that contains them.
    #[arg(long, value_name = "PUBLIC|FILE", requires = "key", allow_hyphen_values = true)]
    server_key: Option<String>,
}

impl Credentials {
    pub fn is_given(&self) -> bool {
        self.key.is_some() || self.server_key.is_some()
    }

    /// - errors: with code 2, when an argument cannot be used. Nothing was sent yet.
    pub fn client(&self, endpoint: &str, user: UserId) -> Result<Client, Failure> {
        let client = match (&self.key, &self.server_key) {
            (Some(key), Some(server)) => {
                let key = CurveKey::read(key).map_err(Failure::bad_input)?;
                let server = read_public(server).map_err(Failure::bad_input)?;
                Client::connect_as(endpoint, user, Identity { key, server })
            }
            _ => Client::connect(endpoint, user),
        };
        client.map_err(Failure::bad_input)
    }
}
