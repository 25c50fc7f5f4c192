use serde::{Deserialize, Serialize};

use super::{ErrorCode, OrderError, Response};
use crate::events::PersonErased;
use crate::ids::{PublicKey, TenantId, Timestamp, UserId};
use crate::store::AppendError;
use crate::tenancy::{Admissions, Order, Quotas, Role, Standing};

/// What an operator asks for.
#[derive(Debug, Clone, PartialEq)]
pub struct TenantAsk {
    /// Whom it is about; none: the operator's own tenant, and for a list every tenant that this
    /// operator may see.
    pub tenant: Option<TenantId>,
    pub verb: TenantVerb,
}

#[derive(Debug, Clone, PartialEq)]
pub enum TenantVerb {
    List,
    Give(Order),
    /// Destroy a person's key.
    Erase {
        user: UserId,
    },
}

/// A person is erased.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ErasedView {
    pub tenant: TenantId,
    /// As it stands in the tenant's stream.
    pub erased: PersonErased,
}

/// An order was carried out, and is durable.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ordered {
    pub tenant: TenantId,
    /// Records that it led to; 0 when it was so already.
    pub recorded: u32,
}

/// A tenant, for operators.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TenantView {
    pub tenant: TenantId,
    /// Why nobody comes in, if so.
    pub disabled: Option<String>,
    pub quotas: Quotas,
    /// Every key that was ever admitted.
    pub keys: Vec<KeyView>,
}

/// A key, for operators.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyView {
    pub key: PublicKey,
    pub role: Role,
    pub label: String,
    pub admitted_at: Timestamp,
    /// When its overlap was to end, once it was retired; none before.
    pub valid_until: Option<Timestamp>,
    /// It never comes in again: there was no overlap, or a reading of the clock has ended it.
    #[serde(default)]
    pub retired: bool,
}

/// Milliseconds after which an order may be sent again that found too many before it.
const RETRY_BUSY_MS: u32 = 200;

impl TenantView {
    pub fn of(tenant: TenantId, standing: &Standing) -> TenantView {
        let keys = standing.keys().iter().map(|(key, known)| KeyView {
            key: *key,
            role: known.role,
            label: known.label.clone(),
            admitted_at: known.admitted_at,
            valid_until: known.retired.map(|retired| retired.until),
            retired: known.is_gone(),
        });
        TenantView {
            tenant,
            disabled: standing.disabled().map(str::to_owned),
            quotas: *standing.quotas(),
            keys: keys.collect(),
        }
    }

    /// One tenant, or all of them in the order of their names.
    pub fn list(admissions: &Admissions, only: Option<&TenantId>) -> Vec<TenantView> {
        let wanted =
            admissions.tenants().into_iter().filter(|tenant| only.is_none_or(|o| o == tenant));
        wanted
            .filter_map(|tenant| {
                let standing = admissions.standing(&tenant)?;
                Some(TenantView::of(tenant, &standing))
            })
            .collect()
    }
}

impl From<OrderError> for Response {
    fn from(error: OrderError) -> Response {
        let message = error.to_string();
        match error {
            OrderError::Busy
            | OrderError::Gone
            | OrderError::StillBusy
            | OrderError::Append { error: AppendError::Busy { .. }, .. } => {
                Response::busy(message, RETRY_BUSY_MS)
            }
            OrderError::Refused { .. }
            | OrderError::Name { .. }
            | OrderError::KeyOfOther
            | OrderError::NobodyThere { .. } => Response::error(ErrorCode::Refused, message),
            OrderError::Append { .. }
            | OrderError::Key { .. }
            | OrderError::Read { .. }
            | OrderError::Evidence { .. }
            | OrderError::Disagreement { .. } => Response::error(ErrorCode::Unavailable, message),
        }
    }
}
