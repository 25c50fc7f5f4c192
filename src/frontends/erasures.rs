use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::ids::{RequestId, TenantId};

/// Remembers the last erasures by their request ids. After an erasure, the name can belong to a new
/// person. So a request that is sent again, because its answer was lost, must not erase this person
/// too.
///
/// `V` is the answer.
#[derive(Debug)]
pub(super) struct Erasures<V>(Arc<Mutex<Inner<V>>>);

#[derive(Debug)]
struct Inner<V> {
    asked: BTreeMap<(TenantId, RequestId), Option<V>>,
    order: VecDeque<(TenantId, RequestId)>,
}

/// What to do with a request.
#[derive(Debug, PartialEq)]
pub(super) enum Asked<V> {
    /// Carry it out: it is new.
    First,
    /// Say that it is being carried out.
    UnderWay,
    /// Give this answer: it was carried out.
    Done(V),
}

/// Erasures that are remembered: more than can be requested while one client retries.
const REMEMBERED_MAX: usize = 4_096;

impl<V> Clone for Erasures<V> {
    fn clone(&self) -> Self {
        Erasures(self.0.clone())
    }
}

impl<V: Clone> Erasures<V> {
    pub fn new() -> Erasures<V> {
        let (asked, order) = (BTreeMap::new(), VecDeque::new());
        Erasures(Arc::new(Mutex::new(Inner { asked, order })))
    }

    /// Notes a request, if it is new.
    pub fn ask(&self, tenant: &TenantId, id: RequestId) -> Asked<V> {
        let mut inner = self.lock();
        let name = (tenant.clone(), id);
        match inner.asked.get(&name) {
            Some(None) => return Asked::UnderWay,
            Some(Some(view)) => return Asked::Done(view.clone()),
            None => {}
        }
        if inner.order.len() >= REMEMBERED_MAX
            && let Some(oldest) = inner.order.pop_front()
        {
            inner.asked.remove(&oldest);
        }
        inner.order.push_back(name.clone());
        inner.asked.insert(name, None);
        Asked::First
    }

    /// Notes that a request was carried out.
    ///
    /// - `view`: the answer; none if it failed, so that it can be tried again.
    pub fn end(&self, tenant: &TenantId, id: RequestId, view: Option<V>) {
        let mut inner = self.lock();
        let name = (tenant.clone(), id);
        match view {
            Some(view) => {
                // It is forgotten if too many came after it.
                if let Some(known) = inner.asked.get_mut(&name) {
                    *known = Some(view);
                }
            }
            None => {
                inner.asked.remove(&name);
                inner.order.retain(|known| *known != name);
            }
        }
    }

    // A panic while the lock is held leaves nothing half changed.
    fn lock(&self) -> MutexGuard<'_, Inner<V>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_erases_once_however_often_it_is_sent() {
        let (erasures, lab) = (Erasures::new(), TenantId::new("lab").unwrap());
        let id = RequestId([1; 16]);
        assert_eq!(erasures.ask(&lab, id), Asked::First);
        assert_eq!(erasures.ask(&lab, id), Asked::UnderWay);
        assert_eq!(erasures.ask(&TenantId::local(), id), Asked::First, "another lab's request");
        erasures.end(&lab, id, None);
        assert_eq!(erasures.ask(&lab, id), Asked::First, "it went wrong and is tried again");
        erasures.end(&lab, id, Some("erased"));
        assert_eq!(erasures.ask(&lab, id), Asked::Done("erased"));
        for number in 0..2 * REMEMBERED_MAX as u64 {
            let mut bytes = [2; 16];
            bytes[..8].copy_from_slice(&number.to_be_bytes());
            erasures.ask(&lab, RequestId(bytes));
        }
        let inner = erasures.lock();
        assert_eq!((inner.asked.len(), inner.order.len()), (REMEMBERED_MAX, REMEMBERED_MAX));
    }
}
