use crate::events::{Head, Record};
use crate::invariants::Invariant;

/// The receipt for an append: these records are durable. A reply cannot be made without one, and
/// only the store can make one: the compiler keeps both (invariant `DurableBeforeReply`).
#[derive(Debug, Clone, PartialEq)]
pub struct Durable {
    records: Vec<Record>,
    head: Head,
}

impl Durable {
    /// For this room only, after the records were made durable.
    ///
    /// - panics: when `head` is not the last of `records`: a reply would then speak of others.
    pub(in crate::store) fn mint(records: Vec<Record>, head: Head) -> Durable {
        let ends = |last: &Record| (last.seq.get(), last.digest) == (head.seq, head.digest);
        let law = Invariant::DurableBeforeReply;
        assert!(records.last().is_none_or(ends), "{law}: a receipt is for what it names");
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::directory::store::open_memory;
    use crate::store::testing::conformance::{batch, stream};

    #[test]
    #[should_panic(expected = "DurableBeforeReply")]
    fn a_receipt_for_other_records_than_it_names_is_not_made() {
        let store = open_memory();
        let ada = stream(&store.keys, "local", "ada");
        let durable = store.log.append(&ada, Head::EMPTY, batch(["a", "b"])).wait().unwrap();
        let Durable { mut records, head } = durable;
        records.pop();
        Durable::mint(records, head);
    }
}
