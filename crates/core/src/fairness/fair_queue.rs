use std::collections::{BTreeMap, VecDeque};

use crate::ids::TenantId;

/// A queue in which tenants take turns: each tenant's jobs stay in their order, and whoever has
/// many waits behind their own jobs, not others behind theirs.
#[derive(Debug)]
pub struct FairQueue<J> {
    lanes: BTreeMap<TenantId, VecDeque<J>>,
    /// The tenants that have a lane; the first is next.
    order: VecDeque<TenantId>,
}

impl<J> Default for FairQueue<J> {
    fn default() -> FairQueue<J> {
        FairQueue { lanes: BTreeMap::new(), order: VecDeque::new() }
    }
}

impl<J> FairQueue<J> {
    pub fn push(&mut self, tenant: &TenantId, job: J) {
        match self.lanes.get_mut(tenant) {
            Some(lane) => lane.push_back(job),
            None => {
                self.order.push_back(tenant.clone());
                self.lanes.insert(tenant.clone(), VecDeque::from([job]));
            }
        }
    }

    /// The first job of the tenant whose turn it is; its next turn comes after everybody else's.
    pub fn pop(&mut self) -> Option<J> {
        let tenant = self.order.pop_front()?;
        let lane = self.lanes.get_mut(&tenant).expect("who is in the order has a lane");
        let job = lane.pop_front().expect("a lane without jobs is removed");
        match lane.is_empty() {
            true => drop(self.lanes.remove(&tenant)),
            false => self.order.push_back(tenant),
        }
        Some(job)
    }

    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    pub fn len(&self) -> usize {
        self.lanes.values().map(VecDeque::len).sum()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn tenant(number: usize) -> TenantId {
        TenantId::new(&format!("lab-{number}")).unwrap()
    }

    #[test]
    fn one_job_waits_for_one_of_each_other_tenant_and_not_for_a_flood() {
        let mut queue = FairQueue::default();
        (0..1_000).for_each(|job| queue.push(&tenant(0), (0, job)));
        queue.push(&tenant(1), (1, 0));
        queue.push(&tenant(2), (2, 0));
        let first: Vec<_> = (0..4).map_while(|_| queue.pop()).collect();
        assert_eq!(first, [(0, 0), (1, 0), (2, 0), (0, 1)]);
        assert_eq!(queue.len(), 998);
    }

    proptest! {
        /// Some push, some take, in any order: every lane stays in order, nothing is lost, and
        /// between two turns of a tenant that still has jobs nobody else has more than one.
        #[test]
        fn every_order_of_calls_is_fair(calls in prop::collection::vec(0usize..6, 1..200)) {
            let mut queue = FairQueue::default();
            let (mut pushed, mut taken) = ([0; 3], [0; 3]);
            let mut since = [[0; 3]; 3];
            for call in calls {
                if call < 3 {
                    queue.push(&tenant(call), (call, pushed[call]));
                    pushed[call] += 1;
                    continue;
                }
                let waiting: Vec<usize> = (0..3).filter(|&t| taken[t] < pushed[t]).collect();
                match queue.pop() {
                    None => prop_assert!(waiting.is_empty()),
                    Some((who, job)) => {
                        prop_assert_eq!(job, taken[who]);
                        taken[who] += 1;
                        since[who] = [0; 3];
                        for &other in waiting.iter().filter(|&&other| other != who) {
                            since[other][who] += 1;
                            prop_assert!(since[other][who] <= 1, "{} before {}", who, other);
                        }
                        (0..3).filter(|t| !waiting.contains(t)).for_each(|t| since[t] = [0; 3]);
                    }
                }
            }
            prop_assert_eq!(queue.len(), pushed.iter().sum::<usize>() - taken.iter().sum::<usize>());
        }
    }
}
