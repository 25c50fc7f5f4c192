use crate::events::{Head, Record};

/// The receipt for an append: these records are durable. A reply cannot be made without one, and
/// only the store can make one: the compiler keeps both (invariant `DurableBeforeReply`).
#[derive(Debug, Clone, PartialEq)]
pub struct Durable {
    records: Vec<Record>,
    head: Head,
}

impl Durable {
    /// For this room only, after the records were made durable.
    pub(in crate::store) fn mint(records: Vec<Record>, head: Head) -> Durable {
        Durable { records, head }
    }

    /// The appended records, in order, as they will be read back.
    pub fn records(&self) -> &[Record] {
        &self.records
    }

    /// The stream's new head.
    pub fn head(&self) -> Head {
        self.head
    }
}
