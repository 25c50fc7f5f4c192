//! What an audit holds a recorded erasure against.

use super::Difference;
use crate::events::{Head, PersonErased};
use crate::evidence;
use crate::ids::{StreamId, TenantId};
use crate::store::{ReadError, Store};
use crate::tenancy::erasure_statement;

/// Whether the tenant signed it, the person's key is gone, and the stream ends where it says.
///
/// - `seq`: of the record in the tenant's stream.
pub(super) fn check(
    store: &Store,
    tenant: &TenantId,
    seq: u64,
    erased: &PersonErased,
) -> Option<Difference> {
    let PersonErased { stream, last, head, signature } = erased;
    let statement = erasure_statement(tenant, *stream, *last, *head);
    let signed = store
        .keys
        .signing_secret(tenant)
        .is_ok_and(|secret| evidence::is_signed(&secret, &statement, signature));
    if !signed {
        return Some(Difference::new(
            seq,
            "signature",
            signature,
            "not a signature by this tenant's key",
        ));
    }
    let stream = StreamId { tenant: tenant.clone(), key: *stream };
    if !matches!(store.log.read(&stream, *last).map(|_| ()), Err(ReadError::Erased)) {
        return Some(Difference::new(seq, "key", "erased", "the user's key still exists"));
    }
    match store.log.walk(&stream) {
        Ok(Head { seq: found, digest }) if found == last.get() && digest == *head => None,
        Ok(found) => Some(Difference::new(seq, "last", last, found.seq)),
        Err(error) => Some(Difference::of_read(&error, seq)),
    }
}
