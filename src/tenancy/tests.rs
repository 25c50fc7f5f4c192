//! Clocks that jump, and keys that were taken back. Times are in seconds after a day of 2026.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::*;
use crate::events::{Event, KeyRetired, Overlap, Record};
use crate::ids::{Digest, PublicKey, RequestId, StreamKey, TenantId, Timestamp};
use crate::limits::OVERLAP_S_MAX;

const TODAY: u64 = 1_790_000_000;
const YEARS: u64 = 10 * 365 * 24 * 60 * 60;
const DAY: u64 = 24 * 60 * 60;
const KEY: PublicKey = PublicKey([1; 32]);
const NEXT: PublicKey = PublicKey([2; 32]);

/// Seconds before [`TODAY`], for [`Lab::at`].
fn back(seconds: u64) -> u64 {
    0u64.wrapping_sub(seconds)
}

/// A lab, its stream, and the doors of one process.
struct Lab {
    wall: Arc<AtomicU64>,
    records: Vec<Record>,
    registry: Registry,
    doors: Admissions,
}

fn doors(wall: &Arc<AtomicU64>) -> Admissions {
    let wall = wall.clone();
    Admissions::new(Clock::new(move || Timestamp(wall.load(Ordering::SeqCst) * 1_000_000)))
}

fn id() -> TenantId {
    TenantId::new("lab").unwrap()
}

fn retire(overlap_seconds: u64) -> Order {
    Order::Retire { key: KEY, overlap_seconds }
}

fn admit(key: PublicKey) -> Order {
    Order::Admit { key, role: Role::Gateway, label: String::new() }
}

impl Lab {
    /// With one key, admitted at [`TODAY`] plus `seconds`.
    fn new(seconds: u64) -> Lab {
        let wall = Arc::new(AtomicU64::new(0));
        let doors = doors(&wall);
        let mut lab = Lab { wall, records: vec![], registry: Registry::default(), doors };
        lab.at(seconds);
        assert_eq!(lab.order(Order::Open), Ok(1));
        assert_eq!(lab.order(admit(KEY)), Ok(1));
        lab
    }

    /// Sets the clock to [`TODAY`] plus `seconds`; wraps around to go back.
    fn at(&self, seconds: u64) {
        self.wall.store(TODAY.wrapping_add(seconds), Ordering::SeqCst);
    }

    fn order(&mut self, order: Order) -> Result<usize, Refusal> {
        let wall = self.doors.clock().read();
        let events = decide(&self.registry, &order, wall)?;
        Ok(self.record(events, self.registry.next_at(wall)))
    }

    /// A batch of its own.
    fn record(&mut self, events: Vec<Event>, at: Timestamp) -> usize {
        let request = RequestId([self.records.len() as u8; 16]);
        let count = events.len();
        for event in events {
            let (seq, prev) = (self.registry.head().next(), self.registry.head().digest);
            let digest = Digest::of(&seq.get().to_be_bytes());
            let record = Record { seq, at, request, prev, digest, event };
            self.registry.apply(&record).unwrap();
            self.records.push(record);
        }
        self.doors.update(&id(), self.registry.standing());
        count
    }

    /// Something that has nothing to do with keys, as a service records by itself.
    fn close_segment(&mut self) -> usize {
        let stream = StreamKey([7; 16]);
        let first = self.registry.uncovered(stream);
        let (root, head) = (Digest::ZERO, Digest::ZERO);
        let closed = crate::events::SegmentClosed { stream, first, last: first, root, head };
        self.order(Order::CloseSegment(closed)).unwrap()
    }

    /// The process ends, and the next one folds the records.
    fn restart(&mut self) {
        let mut registry = Registry::default();
        self.records.iter().for_each(|record| registry.apply(record).unwrap());
        assert_eq!(registry, self.registry, "a function of the records");
        self.doors = doors(&self.wall);
        self.doors.update(&id(), self.registry.standing());
    }

    fn lets_in(&self, key: PublicKey) -> bool {
        self.doors.admit(&key).is_some()
    }

    /// Whether the key comes in at [`TODAY`] plus `seconds`, and in another process that starts then.
    fn lets_in_at(&self, seconds: u64) -> bool {
        self.at(seconds);
        let other = doors(&self.wall);
        other.update(&id(), self.registry.standing());
        let (here, there) = (self.lets_in(KEY), other.admit(&KEY).is_some());
        assert!(there || !here, "what a new process refuses, an old one refuses too");
        here
    }

    /// The key comes in at no time of the clock, here and after restarts.
    fn is_shut_for_ever(&mut self) {
        for seconds in [0, 1, 5, 59, 61, DAY, YEARS, back(1), back(DAY), back(TODAY), back(YEARS)] {
            self.at(seconds);
            self.restart();
            assert!(!self.lets_in(KEY), "at {seconds}");
        }
    }
}

#[test]
fn a_key_that_was_retired_without_an_overlap_comes_in_at_no_time_of_the_clock() {
    let mut lab = Lab::new(0);
    lab.at(5);
    assert_eq!(lab.order(retire(0)), Ok(1));
    assert!(!lab.lets_in(KEY));
    lab.at(back(DAY));
    assert!(!lab.lets_in(KEY));
    lab.is_shut_for_ever();
    assert_eq!(lab.order(retire(0)), Ok(0));
    assert_eq!(lab.order(admit(KEY)), Err(Refusal::Retired { key: KEY }));
}

#[test]
fn an_overlap_runs_from_the_reading_to_its_end_and_nowhere_else() {
    let mut lab = Lab::new(0);
    lab.at(10);
    lab.order(retire(60)).unwrap();
    for (seconds, good) in [(10, true), (69, true), (70, false)] {
        assert_eq!(lab.lets_in_at(seconds), good, "{seconds}");
    }
    let mut lab = Lab::new(0);
    lab.at(10);
    lab.order(retire(60)).unwrap();
    assert!(lab.lets_in_at(30));
    assert!(!lab.lets_in_at(9), "before the reading");
    lab.at(30);
    assert!(!lab.lets_in(KEY), "a reading has ended it in this process");
    assert!(lab.doors.standing(&id()).unwrap().keys()[&KEY].is_gone());
}

#[test]
fn what_the_doors_have_seen_end_stays_ended_whatever_is_recorded_next() {
    let mut lab = Lab::new(0);
    lab.order(retire(60)).unwrap();
    assert!(!lab.lets_in_at(61));
    lab.at(30);
    lab.order(admit(NEXT)).unwrap();
    assert!(!lab.lets_in(KEY));
    assert!(lab.lets_in(NEXT));
    assert!(lab.doors.is_gone(&id(), &KEY) && !lab.doors.is_gone(&id(), &NEXT));
}

#[test]
fn a_later_record_ends_an_overlap_for_the_processes_after_it_too() {
    let mut lab = Lab::new(0);
    lab.order(retire(60)).unwrap();
    lab.at(61);
    assert_eq!(lab.close_segment(), 1, "its own time says it");
    lab.at(30);
    lab.restart();
    assert!(!lab.lets_in(KEY));
    lab.is_shut_for_ever();

    // The clock is set back behind the reading, and something is recorded then.
    let mut lab = Lab::new(0);
    lab.at(10);
    lab.order(retire(60)).unwrap();
    lab.at(back(DAY));
    assert_eq!(lab.close_segment(), 2, "a held time says nothing of the clock: a record does");
    lab.at(30);
    lab.restart();
    assert!(!lab.lets_in(KEY));
    assert_eq!(lab.close_segment(), 1, "said once");
    lab.is_shut_for_ever();
}

#[test]
fn a_clock_that_once_ran_ahead_keeps_no_key_alive() {
    let mut lab = Lab::new(YEARS);
    lab.at(0);
    assert!(lab.lets_in(KEY));
    assert_eq!(lab.order(retire(0)), Ok(1));
    assert!(!lab.lets_in(KEY));
    lab.is_shut_for_ever();

    let mut lab = Lab::new(YEARS);
    lab.at(0);
    assert_eq!(lab.order(retire(60)), Ok(1));
    assert!(lab.records.last().unwrap().at.0 > (TODAY + YEARS) * 1_000_000, "a held time");
    // Records with held times end nothing before its time.
    lab.at(59);
    assert_eq!(lab.close_segment(), 1);
    lab.restart();
    assert!(lab.lets_in(KEY));
    lab.at(60);
    assert!(!lab.lets_in(KEY));
    // And after it, they say so.
    assert_eq!(lab.close_segment(), 2);
    lab.at(30);
    lab.restart();
    assert!(!lab.lets_in(KEY));
    lab.is_shut_for_ever();

    // Retired while it ran ahead.
    let mut lab = Lab::new(YEARS);
    lab.order(retire(60)).unwrap();
    assert!(lab.lets_in(KEY));
    lab.at(0);
    assert!(!lab.lets_in(KEY));
}

#[test]
fn a_shorter_overlap_takes_effect_and_a_longer_one_does_not() {
    let mut lab = Lab::new(0);
    lab.order(retire(1_000)).unwrap();
    lab.at(10);
    assert_eq!(lab.order(retire(990)), Ok(0), "no later than that already");
    assert_eq!(lab.order(retire(2_000)), Ok(0));
    assert_eq!(lab.order(retire(60)), Ok(1));
    assert!(lab.lets_in_at(69));
    assert!(!lab.lets_in_at(70));
    let mut lab = Lab::new(0);
    lab.order(retire(1_000)).unwrap();
    lab.at(10);
    assert_eq!(lab.order(retire(0)), Ok(1));
    lab.is_shut_for_ever();

    // Over, and nothing was recorded since: the order is what records it.
    let mut lab = Lab::new(0);
    lab.order(retire(60)).unwrap();
    lab.at(100);
    assert_eq!(lab.order(retire(60)), Ok(1));
    assert_eq!(lab.order(retire(60)), Ok(0));
    lab.is_shut_for_ever();
}

#[test]
fn an_overlap_has_a_bound() {
    let mut lab = Lab::new(0);
    for overlap_seconds in [OVERLAP_S_MAX + 1, u64::MAX] {
        let rotate = Order::Rotate { old: KEY, new: NEXT, overlap_seconds };
        for order in [retire(overlap_seconds), rotate] {
            let refused = lab.order(order).unwrap_err().to_string();
            assert!(refused.contains("2592000 seconds (30 days)"), "{refused}");
            assert!(refused.contains(&overlap_seconds.to_string()), "{refused}");
        }
    }
    assert!(lab.lets_in(KEY) && !lab.lets_in(NEXT), "nothing was recorded");
    assert_eq!(lab.order(retire(OVERLAP_S_MAX)), Ok(1));
    assert!(lab.lets_in_at(OVERLAP_S_MAX - 1));
}

/// A record as builds before the release of 0.2 wrote it.
fn former(lab: &mut Lab, at_s: u64, overlap_s: u64) {
    let [at, valid_until] = [at_s, at_s + overlap_s].map(|s| Timestamp((TODAY + s) * 1_000_000));
    let overlap = Overlap::Former { valid_until };
    lab.record(vec![KeyRetired { key: KEY, overlap }.into()], at);
}

#[test]
fn a_record_of_version_1_retires_for_ever_and_its_overlap_counts_from_its_time() {
    let mut lab = Lab::new(0);
    former(&mut lab, 10, 0);
    lab.is_shut_for_ever();

    let mut lab = Lab::new(0);
    former(&mut lab, 10, 60);
    assert!(lab.lets_in_at(10) && lab.lets_in_at(69));
    assert!(!lab.lets_in_at(70));
    let mut lab = Lab::new(0);
    former(&mut lab, 10, 60);
    assert!(!lab.lets_in_at(9));

    // Long ended, and a later record says so.
    let mut lab = Lab::new(0);
    former(&mut lab, 10, 60);
    lab.at(100);
    lab.close_segment();
    lab.is_shut_for_ever();

    // From a clock that ran ahead: ended, since the clock reads before the record's time.
    let mut lab = Lab::new(YEARS);
    former(&mut lab, YEARS + 10, 60);
    lab.at(0);
    assert!(!lab.lets_in(KEY));
    assert_eq!(lab.order(retire(60)), Ok(1));
    lab.is_shut_for_ever();

    // The same in the wrong order: what has ended is not begun again.
    let mut lab = Lab::new(0);
    lab.order(retire(0)).unwrap();
    former(&mut lab, 10, 1_000);
    lab.is_shut_for_ever();
}

#[test]
fn whatever_the_clock_does_a_key_that_once_was_refused_is_never_let_in_again() {
    use proptest::prelude::*;
    // 0: the clock is set; 1: a segment closes; 2, 3: the key is retired; 4: the process restarts.
    let step = (0u8..5, 0u64..300);
    proptest!(|(steps in prop::collection::vec(step, 1..40))| {
        let mut lab = Lab::new(150);
        for (what, n) in steps {
            let was_good = lab.lets_in(KEY);
            let was_gone = lab.registry.standing().keys()[&KEY].is_gone();
            let recorded = match what {
                0 => { lab.at(n); 0 }
                1 => lab.close_segment(),
                2 => lab.order(retire(0)).unwrap(),
                3 => lab.order(retire(n / 3)).unwrap(),
                _ => { lab.restart(); 0 }
            };
            // What the doors remember ends with the process; what a record says does not.
            prop_assert!(was_good || what == 4 || !lab.lets_in(KEY));
            prop_assert!(!was_gone || !lab.lets_in(KEY));
            let (key, wall) = (&lab.registry.standing().keys()[&KEY], lab.doors.clock().read());
            if lab.lets_in(KEY) && let Some(retired) = key.retired {
                prop_assert!(retired.from <= wall && wall < retired.until);
            }
            // Whatever is recorded says of every overlap that the clock has ended that it has ended.
            prop_assert!(recorded == 0 || key.is_good(wall) || key.is_gone());
        }
    });
}
