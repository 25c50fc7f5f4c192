//! Counts the bytes that wait to be sent, and limits them. `libzmq` limits messages, not bytes, and
//! does not tell how many wait. So each frame reserves space for its bytes. It gives the space back
//! when `libzmq` frees the bytes: they were encrypted or written, or the connection has ended. See
//! ADR 20.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::fairness::Room;
use crate::ids::TenantId;
use crate::limits::UNSENT_CONNECTION_BYTES_MAX;

/// A connection: the place of its listener, and its routing id.
pub(super) type ConnectionId = (usize, Vec<u8>);

/// The bytes that wait, for each connection and each tenant.
#[derive(Debug, Clone)]
pub(super) struct Unsent(Arc<Mutex<Held>>);

#[derive(Debug)]
struct Held {
    tenants: Room,
    connections: HashMap<ConnectionId, usize>,
}

/// Bytes with the space that is reserved for them.
#[derive(Debug)]
pub(super) struct Parcel {
    pub bytes: Vec<u8>,
    _place: Place,
}

/// Space for some bytes. It is free again when this is dropped.
#[derive(Debug)]
pub(super) struct Place {
    unsent: Unsent,
    tenant: TenantId,
    connection: Option<ConnectionId>,
    amount: usize,
}

/// Bytes that `libzmq` and this file need for a frame beside its content.
const FRAME_COST: usize = 256;

impl Unsent {
    /// - `most`: bytes of one tenant, if no other has any. All tenants together have less than
    ///   twice as many.
    pub fn new(most: usize) -> Unsent {
        Unsent(Arc::new(Mutex::new(Held { tenants: Room::new(most), connections: HashMap::new() })))
    }

    /// Reserves space for `bytes`, as [`Unsent::place`].
    pub fn pack(
        &self,
        tenant: &TenantId,
        connection: Option<ConnectionId>,
        bytes: Vec<u8>,
    ) -> Option<Parcel> {
        let place = self.place(tenant, connection, bytes.len())?;
        Some(Parcel { bytes, _place: place })
    }

    /// Reserves space for so many bytes.
    ///
    /// - `connection`: the connection that they are for; none if they are for many.
    /// - returns: none if there is no space. One connection gets at most
    ///   [`UNSENT_CONNECTION_BYTES_MAX`], and at most as much as it leaves free for the other
    ///   connections of its tenant. It always gets one frame.
    pub fn place(
        &self,
        tenant: &TenantId,
        connection: Option<ConnectionId>,
        bytes: usize,
    ) -> Option<Place> {
        let amount = bytes + FRAME_COST;
        let mut held = self.held();
        let waiting = connection
            .as_ref()
            .and_then(|connection| held.connections.get(connection))
            .copied()
            .unwrap_or(0);
        let after = waiting + amount;
        if waiting > 0 {
            let left = held.tenants.free_for(tenant).saturating_sub(amount);
            if after > UNSENT_CONNECTION_BYTES_MAX.min(left) {
                return None;
            }
        }
        if !held.tenants.take(tenant, amount) {
            return None;
        }
        if let Some(connection) = &connection {
            held.connections.insert(connection.clone(), after);
        }
        let (unsent, tenant) = (self.clone(), tenant.clone());
        Some(Place { unsent, tenant, connection, amount })
    }

    // A panic while the lock is held leaves nothing half changed.
    fn held(&self) -> MutexGuard<'_, Held> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut held = self.unsent.held();
        held.tenants.give_back(&self.tenant, self.amount);
        let Some(connection) = &self.connection else { return };
        if let Some(waiting) = held.connections.get_mut(connection) {
            *waiting = waiting.saturating_sub(self.amount);
            if *waiting == 0 {
                held.connections.remove(connection);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOST: usize = 8 * 1024 * 1024;
    const FRAME: usize = 64 * 1024;

    fn lab(name: &str) -> TenantId {
        TenantId::new(name).unwrap()
    }

    /// As many frames as one connection gets.
    fn fill(unsent: &Unsent, tenant: &TenantId, connection: u8) -> Vec<Parcel> {
        let take = || unsent.pack(tenant, Some((0, vec![connection])), vec![0; FRAME]);
        std::iter::from_fn(take).collect()
    }

    #[test]
    fn a_connection_that_does_not_read_gets_its_share_and_leaves_some_to_the_next() {
        let (unsent, lab) = (Unsent::new(MOST), lab("lab"));
        let share = UNSENT_CONNECTION_BYTES_MAX / (FRAME + FRAME_COST);
        let all: Vec<_> = (0..100).map(|connection| fill(&unsent, &lab, connection)).collect();
        assert_eq!((all[0].len(), all[1].len()), (share, share));
        assert!((1..share).contains(&all[4].len()), "{} of {share}", all[4].len());
        let bytes = |frames: &Vec<Parcel>| frames.len() * (FRAME + FRAME_COST);
        assert!(all.iter().map(bytes).sum::<usize>() <= MOST);
        let small = unsent.pack(&lab, Some((0, vec![200])), vec![0; 500]);
        assert!(small.is_some(), "a client that reads gets the usual answer");
        drop((all, small));
        assert_eq!(fill(&unsent, &lab, 9).len(), share, "what was given back is there again");
        assert!(unsent.held().connections.is_empty(), "nothing is kept of connections that read");
    }

    #[test]
    fn a_lab_whose_connections_do_not_read_takes_nothing_from_another() {
        let (unsent, loud, quiet) = (Unsent::new(MOST), lab("loud"), lab("quiet"));
        let held: Vec<_> = (0..200).map(|connection| fill(&unsent, &loud, connection)).collect();
        assert!(unsent.pack(&loud, Some((0, vec![255])), vec![0; 2 * FRAME]).is_none());
        assert!(unsent.pack(&loud, None, vec![0; 2 * FRAME]).is_none());
        assert!(unsent.pack(&quiet, Some((0, vec![254])), vec![0; MOST / 3]).is_some());
        drop(held);
    }

    #[test]
    fn one_frame_may_be_larger_than_a_connections_share() {
        let (unsent, lab) = (Unsent::new(MOST), lab("lab"));
        let connection = || Some((0, vec![1]));
        let large = unsent.pack(&lab, connection(), vec![0; 2 * UNSENT_CONNECTION_BYTES_MAX]);
        assert!(large.is_some() && unsent.pack(&lab, connection(), vec![0; 10]).is_none());
        drop(large);
        assert!(unsent.pack(&lab, connection(), vec![0; 10]).is_some());
        assert!(
            unsent.pack(&lab, connection(), vec![0; MOST]).is_none(),
            "a lab's share is a bound"
        );
    }
}
