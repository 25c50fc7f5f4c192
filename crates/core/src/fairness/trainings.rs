use std::collections::{BTreeMap, BTreeSet, VecDeque};

use crate::ids::{StreamId, StreamKey, TenantId, WithinTenant};

/// The trainings that are due: who gets the next free trainer.
///
/// - The tenant with the fewest trainings running goes first; of those, the one that was served
///   longest ago. So a tenant of which nothing runs waits for the next trainer that becomes free
///   and for one training of each other such tenant, however many others have queued.
/// - A person has at most one training running and one waiting. A newer one takes the place of the
///   one that waits: only the newest lessons count.
/// - Within a tenant, people are served in the order in which they came.
#[derive(Debug)]
pub struct Trainings<J> {
    /// Trainings at once.
    trainers: usize,
    waiting: BTreeMap<TenantId, Lane<J>>,
    running: BTreeSet<StreamId>,
    served: BTreeMap<TenantId, Served>,
    ticks: u64,
}

#[derive(Debug)]
struct Lane<J> {
    order: VecDeque<StreamKey>,
    jobs: WithinTenant<J>,
}

/// How a tenant used the trainers. Kept for every tenant that ever trained, so that leaving and
/// coming back gains nothing. Tenants are few, and only the operator makes them.
#[derive(Debug, Default, Clone, Copy)]
struct Served {
    running: usize,
    last: u64,
}

impl<J> Trainings<J> {
    /// No trainings yet.
    ///
    /// - `trainers`: how many trainings run at once; 0 counts as 1.
    pub fn new(trainers: usize) -> Trainings<J> {
        Trainings {
            trainers: trainers.max(1),
            waiting: BTreeMap::new(),
            running: BTreeSet::new(),
            served: BTreeMap::new(),
            ticks: 0,
        }
    }

    /// Queues a training, unless `waiting_max` of its tenant wait already.
    ///
    /// - returns: the training of this person that waited, if there was one; the new one takes its
    ///   place.
    /// - errors: the job itself, when there is no place.
    pub fn push(&mut self, stream: &StreamId, job: J, waiting_max: usize) -> Result<Option<J>, J> {
        if let Some(lane) = self.waiting.get_mut(&stream.tenant)
            && let Some(former) = lane.jobs.get_mut(&stream.key)
        {
            return Ok(Some(std::mem::replace(former, job)));
        }
        if self.waiting_of(&stream.tenant) >= waiting_max {
            return Err(job);
        }
        let lane = self
            .waiting
            .entry(stream.tenant.clone())
            .or_insert_with(|| Lane { order: VecDeque::new(), jobs: WithinTenant::new() });
        lane.order.push_back(stream.key);
        lane.jobs.insert(stream.key, job);
        Ok(None)
    }

    /// The training that is to run now, if a trainer is free and one may. It counts as running
    /// until [`Trainings::finish`].
    pub fn start(&mut self) -> Option<(StreamId, J)> {
        if self.running.len() >= self.trainers {
            return None;
        }
        let (_, tenant, place) = self
            .waiting
            .iter()
            .filter_map(|(tenant, lane)| {
                let place = lane.first_idle(tenant, &self.running)?;
                let Served { running, last } = self.served.get(tenant).copied().unwrap_or_default();
                Some(((running, last), tenant.clone(), place))
            })
            .min_by_key(|(rank, ..)| *rank)?;
        let lane = self.waiting.get_mut(&tenant).expect("it was just found there");
        let key = lane.order.remove(place).expect("it was just found there");
        let job = lane.jobs.remove(&key).expect("who stands in the order has a job");
        if lane.order.is_empty() {
            self.waiting.remove(&tenant);
        }
        self.ticks += 1;
        let served = self.served.entry(tenant.clone()).or_default();
        *served = Served { running: served.running + 1, last: self.ticks };
        let stream = StreamId { tenant, key };
        self.running.insert(stream.clone());
        Some((stream, job))
    }

    /// A training that was started is over.
    pub fn finish(&mut self, stream: &StreamId) {
        if self.running.remove(stream) {
            let served = self.served.get_mut(&stream.tenant).expect("it was served");
            served.running -= 1;
        }
    }

    /// Takes out all waiting trainings, for when the trainers are gone.
    pub fn clear(&mut self) -> Vec<J> {
        let lanes = std::mem::take(&mut self.waiting);
        lanes.into_values().flat_map(|lane| lane.jobs.into_values()).collect()
    }

    /// Trainings of a tenant that wait.
    pub fn waiting_of(&self, tenant: &TenantId) -> usize {
        self.waiting.get(tenant).map_or(0, |lane| lane.order.len())
    }

    /// Trainings of a tenant that run.
    pub fn running_of(&self, tenant: &TenantId) -> usize {
        self.served.get(tenant).map_or(0, |served| served.running)
    }
}

impl<J> Lane<J> {
    /// The place of the first person without a running training. It looks past at most as many
    /// people as there are running trainings.
    fn first_idle(&self, tenant: &TenantId, running: &BTreeSet<StreamId>) -> Option<usize> {
        let idle =
            |key: &StreamKey| !running.contains(&StreamId { tenant: tenant.clone(), key: *key });
        self.order.iter().position(idle)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn stream(lab: usize, person: u8) -> StreamId {
        let tenant = TenantId::new(&format!("lab-{lab}")).unwrap();
        StreamId { tenant, key: StreamKey([person; 16]) }
    }

    fn push(trainings: &mut Trainings<u32>, lab: usize, person: u8) {
        assert_eq!(trainings.push(&stream(lab, person), 0, usize::MAX), Ok(None));
    }

    #[test]
    fn a_flood_delays_nobody_by_more_than_what_runs_already() {
        let mut trainings = Trainings::new(2);
        (0..200).for_each(|person| push(&mut trainings, 0, person));
        let mut running: Vec<StreamId> =
            std::iter::from_fn(|| trainings.start().map(|(stream, _)| stream)).collect();
        assert_eq!(running, [stream(0, 0), stream(0, 1)]);
        // The next trainer that is free is lab 1's, and its second training comes when its first,
        // or another of the flood, is over: each lab has one of the two trainers.
        push(&mut trainings, 1, 0);
        push(&mut trainings, 1, 1);
        let mut order = Vec::new();
        for _ in 0..4 {
            trainings.finish(&running.remove(0));
            let (next, _) = trainings.start().unwrap();
            order.push(next.clone());
            running.push(next);
        }
        assert_eq!(order, [stream(1, 0), stream(0, 2), stream(1, 1), stream(0, 3)]);
    }

    #[test]
    fn a_person_trains_once_at_a_time_and_only_the_newest_waits() {
        let mut trainings = Trainings::new(4);
        let ada = stream(0, 1);
        assert_eq!(trainings.push(&ada, 'a', 10), Ok(None));
        assert_eq!(trainings.start(), Some((ada.clone(), 'a')));
        assert_eq!(trainings.push(&ada, 'b', 10), Ok(None));
        assert_eq!(trainings.push(&ada, 'c', 10), Ok(Some('b')));
        assert_eq!(trainings.start(), None, "hers runs");
        trainings.finish(&ada);
        assert_eq!(trainings.start(), Some((ada.clone(), 'c')));
        trainings.finish(&ada);
        trainings.finish(&ada);
        assert_eq!((trainings.running_of(&ada.tenant), trainings.start()), (0, None));
    }

    #[test]
    fn a_tenant_whose_queue_is_full_fills_nobody_elses() {
        let mut trainings = Trainings::new(1);
        for person in 0..3 {
            assert_eq!(trainings.push(&stream(0, person), person, 3), Ok(None));
        }
        assert_eq!(trainings.push(&stream(0, 3), 3, 3), Err(3));
        assert_eq!(trainings.push(&stream(0, 2), 4, 3), Ok(Some(2)), "a place is hers already");
        assert_eq!(trainings.push(&stream(1, 0), 5, 3), Ok(None));
        assert_eq!(trainings.clear(), [0, 1, 4, 5]);
        assert_eq!(trainings.waiting_of(&stream(0, 0).tenant), 0);
    }

    proptest! {
        /// Any order of coming and of ending: the trainers are never idle for nothing, nobody
        /// trains twice at once, and while a tenant of which nothing runs waits, each other tenant
        /// is served once at most.
        #[test]
        fn every_order_of_coming_and_ending_is_fair(
            trainers in 1usize..4,
            steps in prop::collection::vec((0usize..4, 0u8..6, any::<bool>(), any::<u8>()), 1..300),
        ) {
            let mut trainings = Trainings::new(trainers);
            let mut running: Vec<StreamId> = Vec::new();
            let mut waiting: Vec<StreamId> = Vec::new();
            // How often each tenant was served while this one waited with nothing running.
            let mut before = [[0; 4]; 4];
            for (lab, person, ends, which) in steps {
                if ends && !running.is_empty() {
                    let over = running.remove(usize::from(which) % running.len());
                    trainings.finish(&over);
                } else {
                    let coming = stream(lab, person);
                    let replaced = trainings.push(&coming, person, usize::MAX).unwrap();
                    prop_assert_eq!(replaced.is_some(), waiting.contains(&coming));
                    if replaced.is_none() {
                        waiting.push(coming);
                    }
                }
                let of = |streams: &[StreamId], lab: usize| {
                    streams.iter().filter(|s| s.tenant == stream(lab, 0).tenant).count()
                };
                while let Some((started, person)) = trainings.start() {
                    prop_assert_eq!(started.key, StreamKey([person; 16]));
                    prop_assert!(!running.contains(&started), "twice at once");
                    let place = waiting.iter().position(|waits| *waits == started).unwrap();
                    let first = waiting.iter().position(|waits| {
                        waits.tenant == started.tenant && !running.contains(waits)
                    });
                    prop_assert_eq!(Some(place), first, "out of its tenant's order");
                    waiting.remove(place);
                    let lab = (0..4).find(|&l| stream(l, 0).tenant == started.tenant).unwrap();
                    for other in (0..4).filter(|&other| other != lab) {
                        if of(&waiting, other) > 0 && of(&running, other) == 0 {
                            before[other][lab] += 1;
                            prop_assert!(before[other][lab] <= 1, "{lab} again before {other}");
                        } else {
                            before[other] = [0; 4];
                        }
                    }
                    before[lab] = [0; 4];
                    running.push(started);
                    prop_assert!(running.len() <= trainers);
                }
                let startable = waiting.iter().any(|waits| !running.contains(waits));
                prop_assert!(running.len() == trainers || !startable, "a trainer is idle");
                for lab in 0..4 {
                    let tenant = stream(lab, 0).tenant;
                    prop_assert_eq!(trainings.waiting_of(&tenant), of(&waiting, lab));
                    prop_assert_eq!(trainings.running_of(&tenant), of(&running, lab));
                }
            }
        }
    }
}
