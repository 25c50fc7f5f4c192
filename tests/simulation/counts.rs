use std::collections::BTreeMap;

/// How often each kind of thing happened.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Counts(BTreeMap<&'static str, u64>);

/// What must happen in a run that is to show anything.
const KINDS: [&str; 30] = [
    "acknowledged",
    "appends failed",
    "appends in conflict",
    "appends of labs failed",
    "appends of labs in conflict",
    "busy people not erased yet",
    "caches lost",
    "checkpoints",
    "crashes",
    "deaths of an actor",
    "erasures finished later",
    "evictions",
    "labs read again",
    "mailboxes full",
    "no room for one more awake",
    "orders obeyed",
    "orders refused",
    "people erased",
    "registrars too busy",
    "registrars' starts interrupted",
    "rejected",
    "repeated",
    "seats that left",
    "segments closed",
    "stale messages of seats",
    "stops",
    "trainings",
    "trainings refused",
    "waits",
    "wakings interrupted",
];

impl Counts {
    pub fn one(&mut self, kind: &'static str) {
        self.many(kind, 1);
    }

    pub fn many(&mut self, kind: &'static str, count: u64) {
        *self.0.entry(kind).or_default() += count;
    }

    pub fn add(&mut self, other: &Counts) {
        other.0.iter().for_each(|(kind, count)| self.many(kind, *count));
    }

    /// What never happened.
    pub fn missing(&self) -> Vec<&'static str> {
        KINDS.into_iter().filter(|kind| !self.0.contains_key(kind)).collect()
    }
}
