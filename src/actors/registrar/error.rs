use crate::ids::{IdError, TenantId};
use crate::replay::CheckpointsError;
use crate::store::{AppendError, KeyError, ReadError};
use crate::tenancy::{Disagreement, Refusal};

/// Why an order was not carried out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OrderError {
    #[error("tenant {tenant}: {refusal}")]
    Refused { tenant: TenantId, refusal: Refusal },
    #[error("no new tenant can be called {tenant}: {error}")]
    Name { tenant: TenantId, error: IdError },
    /// One key is one lab's: else nobody could say whose a message is.
    #[error("the key belongs to another tenant already; make a new one with `apprentice keys new`")]
    KeyOfOther,
    #[error("tenant {tenant}: {error}")]
    Append { tenant: TenantId, error: AppendError },
    #[error("tenant {tenant}: {error}")]
    Key { tenant: TenantId, error: KeyError },
    #[error("tenant {tenant}: {error}")]
    Read { tenant: TenantId, error: ReadError },
    #[error("tenant {tenant}: {error}; was it recorded by another version of apprentice?")]
    Disagreement { tenant: TenantId, error: Disagreement },
    #[error("tenant {tenant}: {error}")]
    Evidence { tenant: TenantId, error: CheckpointsError },
    #[error("tenant {tenant} has no records of such a person: nothing was erased")]
    NobodyThere { tenant: TenantId },
    #[error("they are still busy; nothing was erased; ask again in a moment")]
    StillBusy,
    /// The service is ending.
    #[error("the registrar is gone; ask again when the service is back")]
    Gone,
    #[error("the registrar has too many orders in hand; ask again in a moment")]
    Busy,
}
