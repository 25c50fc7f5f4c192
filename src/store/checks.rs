//! What every backend checks in the same way.

use crate::events::Head;
use crate::ids::StreamId;
use crate::limits::KEY_FILE_BYTES;
use crate::store::log::{AppendError, ReadError};
use crate::store::sealing::keys::{KeyError, Keys};
use crate::store::sealing::seal::DataKey;

/// The expected-head check. (Invariant `SingleWriter`.)
pub(in crate::store) fn head(
    stream: &StreamId,
    after: Head,
    found: Head,
) -> Result<(), AppendError> {
    if after == found {
        return Ok(());
    }
    let stream = stream.clone();
    Err(AppendError::Conflict { stream, expected: after.seq, found: found.seq })
}

/// The key to seal with; a new stream gets a new one.
pub(in crate::store) fn key_to_append(
    keys: &Keys,
    stream: &StreamId,
    head: Head,
) -> Result<DataKey, AppendError> {
    let key = match keys.user_key(stream) {
        Err(KeyError::Missing { .. }) if head == Head::EMPTY => {
            keys.make_user_keys(std::slice::from_ref(stream)).and_then(|()| keys.user_key(stream))
        }
        found => found,
    };
    key.map_err(|error| match error {
        KeyError::Erased { .. } => AppendError::Erased,
        // Not fatal for the log: the other people's keys may be in order.
        other => AppendError::Key { reason: other.to_string() },
    })
}

/// What the first record of a stream adds to its lab's bytes for the key that comes with it.
pub(in crate::store) fn key_bytes(head: Head) -> u64 {
    if head == Head::EMPTY { KEY_FILE_BYTES } else { 0 }
}

/// The key to read with.
pub(in crate::store) fn key_to_read(keys: &Keys, stream: &StreamId) -> Result<DataKey, ReadError> {
    keys.user_key(stream).map_err(|error| match error {
        KeyError::Erased { .. } => ReadError::Erased,
        other => ReadError::Store { reason: other.to_string() },
    })
}
