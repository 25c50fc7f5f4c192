use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::super::failure::Failure;
use super::super::passport::Passport;
use super::super::{data_dir, embedded};
use crate::actors::{Book, TenantView};
use crate::frontends::Client;
use crate::ids::TenantId;
use crate::store;
use crate::tenancy::Order;

/// How long a service may take to carry out an order.
const PATIENCE: Duration = Duration::from_secs(20);

/// Where tenants are decided about.
#[derive(Debug, Args)]
pub(super) struct Place {
    /// A running service.
    #[arg(long, value_name = "ENDPOINT", conflicts_with = "data")]
    connect: Option<String>,
    #[command(flatten)]
    passport: Passport,
    /// A data directory that no service has open
    /// [default: $XDG_DATA_HOME/apprentice, else ~/.local/share/apprentice]
    #[arg(long, value_name = "DIR", conflicts_with_all = ["key", "server_key"])]
    data: Option<PathBuf>,
}

/// Who carries orders out. Both are the same [`Book`]; one of them is behind a service's registrar.
pub(super) enum Office {
    Running(Client),
    Closed(Box<Book>),
}

impl Place {
    /// - `make`: a data directory that is not there is made.
    pub fn enter(&self, make: bool) -> Result<Office, Failure> {
        if let Some(endpoint) = &self.connect {
            let client = self.passport.client(endpoint, embedded::user("operator")?)?;
            return Ok(Office::Running(client.with_patience(PATIENCE)));
        }
        if self.passport.is_given() {
            return Err(Failure::bad_input(
                "--key is for a running service; name it with --connect",
            ));
        }
        let directory = data_dir::choose(self.data.clone())?;
        if !make && !directory.join("LAYOUT").is_file() {
            return Err(Failure::bad_input(format!(
                "there is no data directory of apprentice at {}; `apprentice tenant add` makes one",
                directory.display()
            )));
        }
        let store = store::open(&directory).map_err(|error| match error {
            store::OpenError::InUse { .. } => Failure::bad_input(format!(
                "{error}; a running service takes orders with --connect"
            )),
            error => Failure::bad_input(error),
        })?;
        let book = Book::open(store).map_err(Failure::failed)?;
        Ok(Office::Closed(Box::new(book)))
    }
}

impl Office {
    /// - returns: how many records it led to; 0 when it was so already.
    pub fn obey(&mut self, tenant: &TenantId, order: Order) -> Result<u32, Failure> {
        match self {
            Office::Running(client) => {
                let ordered = client.order(Some(tenant.clone()), order).map_err(Failure::failed)?;
                Ok(ordered.recorded)
            }
            Office::Closed(book) => {
                let events = book.obey(tenant, &order).map_err(Failure::failed)?;
                Ok(events.len() as u32)
            }
        }
    }

    pub fn list(&mut self, only: Option<&TenantId>) -> Result<Vec<TenantView>, Failure> {
        match self {
            Office::Running(client) => client.tenants(only.cloned()).map_err(Failure::failed),
            Office::Closed(book) => Ok(TenantView::list(book.admissions(), only)),
        }
    }
}
