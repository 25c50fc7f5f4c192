use super::OrderError;
use crate::client::{ErrorCode, KeyView, Response, TenantView};
use crate::ids::TenantId;
use crate::store::AppendError;
use crate::tenancy::{Admissions, Standing};

/// Milliseconds after which an order may be sent again if there were too many others.
const RETRY_BUSY_MS: u32 = 200;

fn view(tenant: TenantId, standing: &Standing) -> TenantView {
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

/// What operators see of one tenant, or of all tenants in the order of their names.
pub fn list_tenants(admissions: &Admissions, only: Option<&TenantId>) -> Vec<TenantView> {
    let wanted = admissions.tenants().into_iter().filter(|tenant| only.is_none_or(|o| o == tenant));
    wanted
        .filter_map(|tenant| {
            let standing = admissions.standing(&tenant)?;
            Some(view(tenant, &standing))
        })
        .collect()
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
