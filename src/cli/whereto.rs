use std::path::PathBuf;

use clap::Args;

use super::failure::Failure;
use crate::frontends::{Client, CurveKey, Identity, read_public};
use crate::ids::UserId;

/// Which service, and as whom.
#[derive(Debug, Args)]
pub struct Whereto {
    /// Where the service listens.
    #[arg(long, value_name = "ENDPOINT")]
    connect: String,
    /// Your key, as `apprentice keys new` made it, for a service that lets in only those with one.
    #[arg(long, value_name = "FILE", requires = "server_key")]
    key: Option<PathBuf>,
    /// The service's public key: its 40 characters or a file with them.
    #[arg(long, value_name = "KEY|FILE", requires = "key")]
    server_key: Option<String>,
}

impl Whereto {
    /// - errors: with code 2, when an argument cannot be used. Nobody was spoken to yet.
    pub fn client(&self, user: UserId) -> Result<Client, Failure> {
        let client = match (&self.key, &self.server_key) {
            (Some(key), Some(server)) => {
                let key = CurveKey::read(key).map_err(Failure::bad_input)?;
                let server = read_public(server).map_err(Failure::bad_input)?;
                Client::connect_as(&self.connect, user, Identity { key, server })
            }
            _ => Client::connect(&self.connect, user),
        };
        client.map_err(Failure::bad_input)
    }
}
