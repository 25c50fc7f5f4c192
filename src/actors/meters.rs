use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};
use std::time::Instant;

use crate::client::{
    Ask, Command, Order, PersonAsk, Quota, QuotaExceeded, Response, TenantAsk, TenantVerb,
};
use crate::fairness::{Bucket, Room, TOKEN};
use crate::ids::TenantId;
use crate::limits::GATEWAY_IN_FLIGHT_MAX;
use crate::store::EventLog;
use crate::tenancy::{Admissions, Quotas};

/// Counts what each tenant uses of the service, and compares it with its quotas. The gateway's
/// thread does this before a request goes to an actor. So a tenant that is over a quota is refused
/// at once, and costs the other tenants nothing.
pub(super) struct Meters {
    admissions: Admissions,
    log: Arc<dyn EventLog>,
    /// The moment that buckets count from.
    start: Instant,
    in_flight: Mutex<Room>,
    tenants: RwLock<BTreeMap<TenantId, Arc<Meter>>>,
}

/// The counts of one tenant.
#[derive(Default)]
pub(super) struct Meter {
    bucket: Mutex<Bucket>,
    awake: AtomicUsize,
    refused: Counts,
}

#[derive(Default)]
struct Counts {
    awake_users: AtomicU64,
    in_flight: AtomicU64,
    utterances: AtomicU64,
    sealed_bytes: AtomicU64,
    trainings: AtomicU64,
    busy: AtomicU64,
    unread: AtomicU64,
}

/// How many requests of a tenant were refused since the start, by the reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Refusals {
    /// Its quota of people awake at the same time.
    pub awake_users: u64,
    /// Its quota of requests in flight.
    pub in_flight: u64,
    /// Its quota of utterances in a second.
    pub utterances: u64,
    /// Its quota of bytes in the log.
    pub sealed_bytes: u64,
    /// Trainings that found its queue full. They are asked for again.
    pub trainings: u64,
    /// No quota: all tenants together use all of the service.
    pub busy: u64,
    /// Answers and messages of the feed that were dropped, because its clients do not read.
    pub unread: u64,
}

/// What a tenant uses now.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Usage {
    /// People awake.
    pub awake_users: usize,
    /// Requests accepted and not yet answered.
    pub in_flight: usize,
    /// What was refused since the start.
    pub refused: Refusals,
}

/// An accepted request. It counts until this is dropped.
pub(super) struct InFlight {
    meters: Arc<Meters>,
    tenant: TenantId,
}

/// Milliseconds after which a request may be sent again if there were too many others.
const RETRY_CROWD_MS: u32 = 200;
/// What a query costs, in millionths of a token: a tenth, because it records nothing.
const QUERY_COST: u64 = TOKEN / 10;

impl Meters {
    pub fn new(admissions: Admissions, log: Arc<dyn EventLog>) -> Meters {
        let in_flight = Mutex::new(Room::new(GATEWAY_IN_FLIGHT_MAX));
        Meters { admissions, log, start: Instant::now(), in_flight, tenants: RwLock::default() }
    }

    /// Accepts a request, or refuses it.
    ///
    /// - errors: the answer: [`Response::QuotaExceeded`] for a limit of the tenant, and
    ///   [`Response::Busy`] for a limit of the service.
    pub fn admit(
        self: &Arc<Self>,
        tenant: &TenantId,
        ask: &Ask,
    ) -> Result<InFlight, Box<Response>> {
        let (quotas, meter) = (self.quotas(tenant), self.meter(tenant));
        self.check_bytes(tenant, ask, &quotas, &meter)?;
        {
            let mut room = self.room();
            let held = room.held_by(tenant) as u64;
            if let Some(limit) = quotas.in_flight.filter(|limit| held >= u64::from(*limit)) {
                let over = over(Quota::InFlight, held, limit.into(), Some(RETRY_CROWD_MS));
                return Err(count(&meter.refused.in_flight, tenant, over));
            }
            if !room.take(tenant, 1) {
                meter.refused.busy.fetch_add(1, Ordering::Relaxed);
                let full = "the service has too many requests in hand";
                return Err(Box::new(Response::busy(full, RETRY_CROWD_MS)));
            }
        }
        let in_flight = InFlight { meters: self.clone(), tenant: tenant.clone() };
        self.check_rate(tenant, ask, &quotas, &meter)?;
        Ok(in_flight)
    }

    /// Checks the bytes in the log. A tenant over this quota may still ask queries, withdraw
    /// people, erase people and retire keys.
    fn check_bytes(
        &self,
        tenant: &TenantId,
        ask: &Ask,
        quotas: &Quotas,
        meter: &Meter,
    ) -> Result<(), Box<Response>> {
        let appends = match ask {
            Ask::Person(PersonAsk::Command(command)) => !matches!(command, Command::Close { .. }),
            // The host's operator must be able to raise the quota.
            Ask::Order(TenantAsk { verb: TenantVerb::Give(order), .. }) => {
                *tenant != TenantId::local()
                    && matches!(order, Order::Admit { .. } | Order::Rotate { .. })
            }
            _ => false,
        };
        let Some(limit) = quotas.sealed_bytes.filter(|_| appends) else { return Ok(()) };
        // An error means that the log cannot be read. The next reader or writer reports it with
        // more detail.
        let used = self.log.sealed_bytes(tenant).unwrap_or(0);
        match used >= limit {
            false => Ok(()),
            true => {
                let over = over(Quota::SealedBytes, used, limit, None);
                Err(count(&meter.refused.sealed_bytes, tenant, over))
            }
        }
    }

    fn check_rate(
        &self,
        tenant: &TenantId,
        ask: &Ask,
        quotas: &Quotas,
        meter: &Meter,
    ) -> Result<(), Box<Response>> {
        let Some(rate) = quotas.utterances_per_second else { return Ok(()) };
        let cost = match ask {
            Ask::Person(PersonAsk::Command(_)) => TOKEN,
            Ask::Person(PersonAsk::Query(_) | PersonAsk::Wait { .. }) | Ask::Archive(_) => {
                QUERY_COST
            }
            // These wake no person. And an operator must be heard while the lab's people are
            // refused.
            Ask::Service(_) | Ask::Order(_) => return Ok(()),
        };
        let burst = quotas.burst.unwrap_or(rate);
        let now_us = u64::try_from(self.start.elapsed().as_micros()).unwrap_or(u64::MAX);
        let mut bucket = meter.bucket.lock().unwrap_or_else(PoisonError::into_inner);
        let Err(wait_us) = bucket.take(now_us, rate, burst, cost) else { return Ok(()) };
        drop(bucket);
        let wait_ms = u32::try_from(wait_us.div_ceil(1_000)).ok();
        // The bucket is empty, so the tenant has used all of its burst.
        let over = over(Quota::Utterances, u64::from(burst), rate.into(), wait_ms);
        Err(count(&meter.refused.utterances, tenant, over))
    }

    /// The refusal when a tenant has too many people awake.
    pub fn refuse_waking(&self, tenant: &TenantId, awake: usize, limit: u32) -> Box<Response> {
        let over = over(Quota::AwakeUsers, awake as u64, limit.into(), Some(RETRY_CROWD_MS));
        count(&self.meter(tenant).refused.awake_users, tenant, over)
    }

    /// The refusal when all tenants together have too many people awake.
    pub fn refuse_crowd(&self, tenant: &TenantId) -> Response {
        self.meter(tenant).refused.busy.fetch_add(1, Ordering::Relaxed);
        let crowd = "everybody who is awake is busy and no one else can be woken";
        Response::busy(crowd, RETRY_CROWD_MS)
    }

    /// Notes that something was dropped, because the tenant's clients do not read.
    pub fn note_unread(&self, tenant: &TenantId) {
        if self.meter(tenant).refused.unread.fetch_add(1, Ordering::Relaxed) == 0 {
            tracing::warn!(%tenant, "a tenant's connections do not read: what they miss is dropped");
        }
    }

    /// Notes that a training found the tenant's queue full.
    pub fn note_training_refused(&self, tenant: &TenantId) {
        self.meter(tenant).refused.trainings.fetch_add(1, Ordering::Relaxed);
    }

    /// Notes how many people of a tenant are awake.
    pub fn note_awake(&self, tenant: &TenantId, awake: usize) {
        self.meter(tenant).awake.store(awake, Ordering::Relaxed);
    }

    /// The quotas of a tenant.
    pub fn quotas(&self, tenant: &TenantId) -> Quotas {
        self.admissions.quotas(tenant)
    }

    /// What each tenant uses that has sent a request since the start.
    pub fn usage(&self) -> BTreeMap<TenantId, Usage> {
        let tenants = self.tenants.read().unwrap_or_else(PoisonError::into_inner).clone();
        let room = self.room();
        let usage = |(tenant, meter): (TenantId, Arc<Meter>)| {
            let in_flight = room.held_by(&tenant);
            let awake_users = meter.awake.load(Ordering::Relaxed);
            (tenant, Usage { awake_users, in_flight, refused: meter.refused.now() })
        };
        tenants.into_iter().map(usage).collect()
    }

    fn meter(&self, tenant: &TenantId) -> Arc<Meter> {
        let known =
            self.tenants.read().unwrap_or_else(PoisonError::into_inner).get(tenant).cloned();
        known.unwrap_or_else(|| {
            let mut tenants = self.tenants.write().unwrap_or_else(PoisonError::into_inner);
            tenants.entry(tenant.clone()).or_default().clone()
        })
    }

    // A panic while the lock is held leaves nothing half changed.
    fn room(&self) -> MutexGuard<'_, Room> {
        self.in_flight.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for InFlight {
    fn drop(&mut self) {
        self.meters.room().give_back(&self.tenant, 1);
    }
}

impl Counts {
    fn now(&self) -> Refusals {
        let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        Refusals {
            awake_users: read(&self.awake_users),
            in_flight: read(&self.in_flight),
            utterances: read(&self.utterances),
            sealed_bytes: read(&self.sealed_bytes),
            trainings: read(&self.trainings),
            busy: read(&self.busy),
            unread: read(&self.unread),
        }
    }
}

/// Counts a refusal. The first of each kind goes into the log.
fn count(counter: &AtomicU64, tenant: &TenantId, over: QuotaExceeded) -> Box<Response> {
    if counter.fetch_add(1, Ordering::Relaxed) == 0 {
        let (quota, limit) = (over.quota, over.limit);
        tracing::warn!(%tenant, ?quota, limit, "a tenant is over its quota for the first time");
    }
    Box::new(Response::QuotaExceeded(over))
}

fn over(quota: Quota, used: u64, limit: u64, retry_after_ms: Option<u32>) -> QuotaExceeded {
    let message = match quota {
        Quota::AwakeUsers => {
            format!("all of the {limit} people of this tenant who may be awake at once are busy")
        }
        Quota::InFlight => format!("{used} requests of this tenant are unanswered; {limit} may be"),
        Quota::Utterances => format!("this tenant may say {limit} utterances a second"),
        Quota::SealedBytes => format!(
            "this tenant has {used} bytes in the log, of {limit} that it may have; \
             the operator can allow more"
        ),
    };
    QuotaExceeded { quota, used, limit, retry_after_ms, message }
}

#[cfg(test)]
mod tests {
    use super::super::wall_clock;
    use super::*;
    use crate::client::Query;
    use crate::client::ServiceAsk;
    use crate::ids::{PublicKey, StreamId, UserId};
    use crate::store::conformance::{batch, stream};
    use crate::store::{Store, open_memory};
    use crate::tenancy::{Registry, Role, Standing};

    fn meters(store: &Store, quotas: Quotas) -> (Arc<Meters>, TenantId) {
        let (admissions, lab) = (Admissions::new(wall_clock()), TenantId::new("lab").unwrap());
        admissions.update(&lab, &standing(quotas));
        (Arc::new(Meters::new(admissions, store.log.clone())), lab)
    }

    /// A tenant after an operator's orders.
    fn standing(quotas: Quotas) -> Standing {
        use crate::events::{QuotasSet, Record, TenantOpened};
        use crate::ids::{Digest, RequestId, Timestamp};
        let mut registry = Registry::default();
        for event in [TenantOpened {}.into(), QuotasSet { quotas }.into()] {
            let (seq, prev) = (registry.head().next(), registry.head().digest);
            let (at, request) = (Timestamp(1), RequestId([0; 16]));
            let digest = Digest::of(&seq.get().to_be_bytes());
            registry.apply(&Record { seq, at, request, prev, digest, event }).unwrap();
        }
        registry.standing().clone()
    }

    fn say() -> Ask {
        Command::Say { utterance: "ring the bell".to_owned() }.into()
    }

    fn refused(answer: Result<InFlight, Box<Response>>) -> QuotaExceeded {
        match answer.map_err(|response| *response) {
            Err(Response::QuotaExceeded(over)) => over,
            Err(other) => panic!("{other:?}"),
            Ok(_) => panic!("accepted"),
        }
    }

    #[test]
    fn requests_in_flight_are_counted_until_they_end() {
        let quotas = Quotas { in_flight: Some(2), ..Quotas::default() };
        let (meters, lab) = meters(&open_memory(), quotas);
        let first = meters.admit(&lab, &say()).unwrap();
        let second = meters.admit(&lab, &Ask::from(ServiceAsk::Hello)).unwrap();
        let over = refused(meters.admit(&lab, &say()));
        assert_eq!((over.quota, over.used, over.limit), (Quota::InFlight, 2, 2));
        assert_eq!(over.retry_after_ms, Some(RETRY_CROWD_MS));
        assert!(meters.admit(&TenantId::local(), &say()).is_ok(), "another tenant is not affected");
        drop(first);
        let third = meters.admit(&lab, &say()).unwrap();
        assert_eq!(meters.usage()[&lab].in_flight, 2);
        drop((second, third));
        let usage = meters.usage()[&lab];
        assert_eq!((usage.in_flight, usage.refused.in_flight), (0, 1));
    }

    #[test]
    fn utterances_and_queries_draw_on_one_bucket() {
        let quotas = Quotas { utterances_per_second: Some(1), burst: Some(3), ..Quotas::default() };
        let (meters, lab) = meters(&open_memory(), quotas);
        let say_all = |count| (0..count).filter(|_| meters.admit(&lab, &say()).is_ok()).count();
        assert_eq!(say_all(2), 2);
        let status = Ask::from(Query::Status);
        let asked = (0..30).filter(|_| meters.admit(&lab, &status).is_ok()).count();
        // One token is left, and with it ten queries; a slow test earns some more.
        assert!((10..30).contains(&asked), "{asked}");
        let over = refused(meters.admit(&lab, &say()));
        assert_eq!((over.quota, over.limit), (Quota::Utterances, 1));
        assert!(over.retry_after_ms.is_some_and(|ms| (1..=1_000).contains(&ms)), "{over:?}");
        assert!(meters.admit(&lab, &Ask::from(ServiceAsk::Hello)).is_ok());
        assert_eq!(meters.usage()[&lab].in_flight, 0, "a refused request does not count");
    }

    #[test]
    fn a_full_log_lets_people_look_and_withdraw() {
        let (store, quotas) =
            (open_memory(), Quotas { sealed_bytes: Some(1_000), ..Quotas::default() });
        let (meters, lab) = meters(&store, quotas);
        let ada: StreamId = stream(&store.keys, "lab", "ada");
        assert!(meters.admit(&lab, &say()).is_ok());
        let long = "x".repeat(2_000);
        let head = store.log.head(&ada).unwrap();
        store.log.append(&ada, head, batch([&*long])).wait().unwrap();
        let over = refused(meters.admit(&lab, &say()));
        assert_eq!(
            (over.quota, over.limit, over.retry_after_ms),
            (Quota::SealedBytes, 1_000, None)
        );
        assert!(over.used > 2_000 && over.message.contains("operator"), "{over:?}");
        assert!(meters.admit(&lab, &Ask::Person(PersonAsk::Query(Query::Known))).is_ok());
        let close = Command::Close { reason: "enough".to_owned() };
        assert!(meters.admit(&lab, &Ask::Person(PersonAsk::Command(close))).is_ok());
        // An operator of the lab, and one of the host.
        let (key, label) = (PublicKey([3; 32]), String::new());
        let admit = Order::Admit { key, role: Role::Gateway, label };
        let give = |order: &Order| {
            Ask::Order(TenantAsk {
                tenant: Some(lab.clone()),
                verb: TenantVerb::Give(order.clone()),
            })
        };
        assert_eq!(refused(meters.admit(&lab, &give(&admit))).quota, Quota::SealedBytes);
        assert!(meters.admit(&TenantId::local(), &give(&admit)).is_ok());
        let retire = Order::Retire { key, overlap_seconds: 0 };
        assert!(meters.admit(&lab, &give(&retire)).is_ok());
        let verb = TenantVerb::Erase { user: UserId::new("ada").unwrap() };
        assert!(meters.admit(&lab, &Ask::Order(TenantAsk { tenant: None, verb })).is_ok());
    }

    #[test]
    fn without_quotas_one_tenant_gets_what_the_service_has_and_another_is_still_accepted() {
        let (meters, lab) = meters(&open_memory(), Quotas::default());
        let held: Vec<_> =
            std::iter::from_fn(|| meters.admit(&lab, &Ask::from(ServiceAsk::Hello)).ok()).collect();
        assert_eq!(held.len(), GATEWAY_IN_FLIGHT_MAX);
        let busy = meters.admit(&lab, &Ask::from(ServiceAsk::Hello)).map_err(|response| *response);
        assert!(matches!(busy, Err(Response::Busy(_))));
        assert!(meters.admit(&TenantId::local(), &say()).is_ok());
        assert_eq!(meters.usage()[&lab].refused.busy, 2);
    }
}
