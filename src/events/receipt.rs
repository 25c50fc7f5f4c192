use super::{Head, Record};

/// The receipt for an append: these records are durable. A reply cannot be made without one
/// (invariant `DurableBeforeReply`).
#[derive(Debug, Clone, PartialEq)]
pub struct Durable {
    records: Vec<Record>,
    head: Head,
}

impl Durable {
    /// For `store/` only, after the records were made durable; `tests/tidy/` checks that nothing
    /// else calls it.
    pub(crate) fn mint(records: Vec<Record>, head: Head) -> Durable {
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
