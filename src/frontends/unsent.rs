//! What was made to be sent and has not left the process. `libzmq` counts what waits in messages, of
//! which one may be a thousand times another, and does not say what waits. So each frame carries the
//! place that its bytes take, and gives it back when `libzmq` lets go of the bytes: the frame was
//! encrypted or written, or its connection has ended.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::fairness::Room;
use crate::ids::TenantId;
use crate::limits::UNSENT_CONNECTION_BYTES_MAX;

/// A connection, by its door and routing id.
pub(super) type Line = (usize, Vec<u8>);

/// The bytes that wait, by connection and by tenant.
#[derive(Debug, Clone)]
pub(super) struct Unsent(Arc<Mutex<Held>>);

#[derive(Debug)]
struct Held {
    tenants: Room,
    lines: HashMap<Line, usize>,
}

/// Bytes with their place among those that wait.
#[derive(Debug)]
pub(super) struct Parcel {
    pub bytes: Vec<u8>,
    _place: Place,
}

/// Room for so many bytes, until it is dropped.
#[derive(Debug)]
pub(super) struct Place {
    unsent: Unsent,
    tenant: TenantId,
    line: Option<Line>,
    amount: usize,
}

/// Bytes that a frame takes beside its own: those of `libzmq`'s and our bookkeeping.
const FRAME_COST: usize = 256;

impl Unsent {
    /// - `most`: bytes of one tenant alone; several together have less than twice as many.
    pub fn new(most: usize) -> Unsent {
        Unsent(Arc::new(Mutex::new(Held { tenants: Room::new(most), lines: HashMap::new() })))
    }

    /// [`Unsent::place`] for `bytes`, and the bytes with it.
    pub fn pack(&self, tenant: &TenantId, line: Option<Line>, bytes: Vec<u8>) -> Option<Parcel> {
        let place = self.place(tenant, line, bytes.len())?;
        Some(Parcel { bytes, _place: place })
    }

    /// Takes a place for so many bytes.
    ///
    /// - `line`: the connection that they are for; none for what goes to many.
    /// - returns: none when there is no room. One connection may take as much as it leaves free to
    ///   the others of its tenant, and [`UNSENT_CONNECTION_BYTES_MAX`] in all, or one frame.
    pub fn place(&self, tenant: &TenantId, line: Option<Line>, bytes: usize) -> Option<Place> {
        let amount = bytes + FRAME_COST;
        let mut held = self.held();
        let waiting = line.as_ref().and_then(|line| held.lines.get(line)).copied().unwrap_or(0);
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
        if let Some(line) = &line {
            held.lines.insert(line.clone(), after);
        }
        let (unsent, tenant) = (self.clone(), tenant.clone());
        Some(Place { unsent, tenant, line, amount })
    }

    // Its holders leave it whole whenever they return.
    fn held(&self) -> MutexGuard<'_, Held> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut held = self.unsent.held();
        held.tenants.give_back(&self.tenant, self.amount);
        let Some(line) = &self.line else { return };
        if let Some(waiting) = held.lines.get_mut(line) {
            *waiting = waiting.saturating_sub(self.amount);
            if *waiting == 0 {
                held.lines.remove(line);
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
    fn fill(unsent: &Unsent, tenant: &TenantId, line: u8) -> Vec<Parcel> {
        let take = || unsent.pack(tenant, Some((0, vec![line])), vec![0; FRAME]);
        std::iter::from_fn(take).collect()
    }

    #[test]
    fn a_connection_that_does_not_read_gets_its_share_and_leaves_some_to_the_next() {
        let (unsent, lab) = (Unsent::new(MOST), lab("lab"));
        let share = UNSENT_CONNECTION_BYTES_MAX / (FRAME + FRAME_COST);
        let all: Vec<_> = (0..100).map(|line| fill(&unsent, &lab, line)).collect();
        assert_eq!((all[0].len(), all[1].len()), (share, share));
        assert!((1..share).contains(&all[4].len()), "{} of {share}", all[4].len());
        let bytes = |frames: &Vec<Parcel>| frames.len() * (FRAME + FRAME_COST);
        assert!(all.iter().map(bytes).sum::<usize>() <= MOST);
        let small = unsent.pack(&lab, Some((0, vec![200])), vec![0; 500]);
        assert!(small.is_some(), "a client that reads gets the usual answer");
        drop((all, small));
        assert_eq!(fill(&unsent, &lab, 9).len(), share, "what was given back is there again");
        assert!(unsent.held().lines.is_empty(), "nothing is kept of connections that read");
    }

    #[test]
    fn a_lab_whose_connections_do_not_read_takes_nothing_from_another() {
        let (unsent, loud, quiet) = (Unsent::new(MOST), lab("loud"), lab("quiet"));
        let held: Vec<_> = (0..200).map(|line| fill(&unsent, &loud, line)).collect();
        assert!(unsent.pack(&loud, Some((0, vec![255])), vec![0; 2 * FRAME]).is_none());
        assert!(unsent.pack(&loud, None, vec![0; 2 * FRAME]).is_none());
        assert!(unsent.pack(&quiet, Some((0, vec![254])), vec![0; MOST / 3]).is_some());
        drop(held);
    }

    #[test]
    fn one_frame_may_be_larger_than_a_connections_share() {
        let (unsent, lab) = (Unsent::new(MOST), lab("lab"));
        let line = || Some((0, vec![1]));
        let large = unsent.pack(&lab, line(), vec![0; 2 * UNSENT_CONNECTION_BYTES_MAX]);
        assert!(large.is_some() && unsent.pack(&lab, line(), vec![0; 10]).is_none());
        drop(large);
        assert!(unsent.pack(&lab, line(), vec![0; 10]).is_some());
        assert!(unsent.pack(&lab, line(), vec![0; MOST]).is_none(), "a lab's share is a bound");
    }
}
