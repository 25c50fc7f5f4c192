use std::path::PathBuf;
use std::time::Duration;

use apprentice::actors::{OrderError, TenantRegistry, list_tenants};
use apprentice::client::{Client, ClientError, ErrorCode, Order, TenantView};
use apprentice::events::PersonErased;
use apprentice::ids::{TenantId, UserId};
use apprentice::store;
use clap::Args;

use super::credentials::Credentials;
use super::failure::Failure;
use super::{data_dir, embedded};

/// How long a service may take to carry out an order.
const PATIENCE: Duration = Duration::from_secs(20);

/// Where an order goes: to a running service, or to a closed data directory.
#[derive(Debug, Args)]
pub struct Place {
    /// The endpoint of a running service.
    #[arg(long, value_name = "ENDPOINT", conflicts_with = "data")]
    connect: Option<String>,
    #[command(flatten)]
    credentials: Credentials,
    /// A data directory that no service has open
    /// [default: $XDG_DATA_HOME/apprentice, else ~/.local/share/apprentice]
    #[arg(long, value_name = "DIR", conflicts_with_all = ["key", "server_key"])]
    data: Option<PathBuf>,
}

/// What carries orders out: the [`TenantRegistry`] of a running service, or of a closed directory.
pub enum AdminClient {
    Running(Client),
    Closed(Box<TenantRegistry>),
}

impl Place {
    /// - `make`: whether to make a data directory that does not exist.
    pub fn enter(&self, make: bool) -> Result<AdminClient, Failure> {
        if let Some(endpoint) = &self.connect {
            let client = self.credentials.client(endpoint, embedded::user("operator")?)?;
            return Ok(AdminClient::Running(client.with_patience(PATIENCE)));
        }
        if self.credentials.is_given() {
            return Err(Failure::bad_input(
                "--key is for a running service; name the service with --connect",
            ));
        }
        let directory = data_dir::choose(self.data.clone())?;
        if !make {
            data_dir::must_hold_data(&directory)?;
        }
        let store = store::open(&directory).map_err(|error| match error {
            store::OpenError::InUse { .. } => Failure::bad_input(format!(
                "{error}; to give orders to a running service, use --connect"
            )),
            error => Failure::bad_input(error),
        })?;
        let tenant_registry = TenantRegistry::open(store).map_err(Failure::failed)?;
        Ok(AdminClient::Closed(Box::new(tenant_registry)))
    }
}

impl AdminClient {
    /// - returns: how many records were added; 0 when the order changed nothing.
    pub fn obey(&mut self, tenant: &TenantId, order: Order) -> Result<u32, Failure> {
        match self {
            AdminClient::Running(client) => {
                let ordered = client.order(Some(tenant.clone()), order).map_err(Failure::failed)?;
                Ok(ordered.recorded)
            }
            AdminClient::Closed(tenant_registry) => {
                let events =
                    tenant_registry.obey(tenant, &order.into()).map_err(Failure::failed)?;
                Ok(events.len() as u32)
            }
        }
    }

    /// - errors: with code 2, when there is no such person.
    pub fn erase(&mut self, tenant: &TenantId, user: &UserId) -> Result<PersonErased, Failure> {
        match self {
            AdminClient::Running(client) => {
                let erased = client.erase(Some(tenant.clone()), user.clone());
                erased.map(|view| view.erased).map_err(|error| match error {
                    ClientError::Failed { code: ErrorCode::Refused, .. } => {
                        Failure::bad_input(error)
                    }
                    error => Failure::failed(error),
                })
            }
            AdminClient::Closed(tenant_registry) => {
                let stream = tenant_registry.stream_id(tenant, user).map_err(Failure::bad_input)?;
                tenant_registry.erase(&stream).map_err(|error| match error {
                    OrderError::NobodyThere { .. } => Failure::bad_input(error),
                    error => Failure::failed(error),
                })
            }
        }
    }

    pub fn list(&mut self, only: Option<&TenantId>) -> Result<Vec<TenantView>, Failure> {
        match self {
            AdminClient::Running(client) => client.tenants(only.cloned()).map_err(Failure::failed),
            AdminClient::Closed(tenant_registry) => {
                Ok(list_tenants(tenant_registry.admissions(), only))
            }
        }
    }
}
