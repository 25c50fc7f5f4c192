//! Every backend obeys the contract of `EventLog`.

use std::sync::Arc;

use apprentice::store::conformance::{Subject, check, in_memory};
use apprentice::store::{FaultPlan, FaultyLog, MemoryLog, open};

#[test]
fn the_log_in_memory_keeps_the_contract() {
    check(&|| in_memory(|keys| Arc::new(MemoryLog::new(keys))));
}

#[test]
fn the_log_on_sled_keeps_the_contract() {
    check(&|| {
        // The directory lives as long as the closure that reopens it.
        let dir = tempfile::tempdir().unwrap();
        let store = open(dir.path()).unwrap();
        Subject { store, reopen: Some(Box::new(move || open(dir.path()).unwrap())) }
    });
}

#[test]
fn a_faulty_log_without_faults_keeps_the_contract() {
    check(&|| {
        in_memory(|keys| {
            let inner = Arc::new(MemoryLog::new(keys));
            Arc::new(FaultyLog::new(inner, FaultPlan::default()))
        })
    });
}
