//! Panics inside, one at a time. A panic in one person's work costs one answer. A panic in a part
//! that everybody depends on ends the process at once. Nothing acknowledged is lost.

use std::sync::atomic::Ordering;
use std::thread;
use std::time::Duration;

use apprentice::store;

use crate::ledger::Ledger;
use crate::people::{Person, Signals};
use crate::served::{PATIENCE, Server};

/// A service that must end has to end within this time: a second on a quiet machine, and much less
/// than the minute after which a hanging service is given up.
const AT_ONCE: Duration = Duration::from_secs(10);
const STEPS: usize = 25;

struct Place {
    folder: tempfile::TempDir,
    people: Vec<Ledger>,
}

fn place() -> Place {
    let people = ["ada", "grace", "mary"].map(Ledger::new).to_vec();
    Place { folder: tempfile::tempdir().unwrap(), people }
}

impl Place {
    /// A service that panics when it passes `point` for the `number`-th time.
    fn serve(&self, point: &str, number: usize) -> Server {
        let folder = self.folder.path();
        let wanted = ("APPRENTICE_PANIC", format!("{point}:{number}"));
        let mut server = Server::spawn(&folder.join("data"), &folder.join("socket"), &[wanted]);
        if let Err(ended) = server.ready() {
            panic!("it does not start: {ended:?}");
        }
        server
    }

    /// Everybody plays some steps, or until the service has said that it cannot continue.
    fn live(&self, server: &mut Server) -> Lived {
        let (socket, signals) = (self.folder.path().join("socket"), Signals::default());
        let ended = thread::scope(|scope| {
            let people: Vec<_> = (self.people.iter().zip(1..))
                .map(|(ledger, seed)| {
                    let mut person = Person::new(ledger, &socket, seed, &signals);
                    scope.spawn(move || (0..STEPS).all(|_| person.step().is_some()))
                })
                .collect();
            while !server.has_ended() && people.iter().any(|person| !person.is_finished()) {
                thread::sleep(Duration::from_millis(1));
            }
            let mut ended = server.end(Duration::ZERO);
            signals.hang_up.store(true, Ordering::SeqCst);
            let whole = people.into_iter().all(|person| person.join().unwrap());
            if !whole && ended.is_none() {
                ended = server.end(PATIENCE);
            }
            ended
        });
        Lived { ended, defects: signals.defects.load(Ordering::SeqCst) }
    }

    /// After a restart everybody finds what they had been told.
    fn all_is_there(&self) {
        let (data, socket) = (self.folder.path().join("data"), self.folder.path().join("socket"));
        let store = store::open(&data).unwrap();
        for ledger in &self.people {
            let promised = ledger.acknowledged();
            ledger.check(&store, &promised).unwrap_or_else(|sentence| panic!("{sentence}"));
        }
        drop(store);
        let (server, signals) = (Server::start(&data, &socket), Signals::default());
        for ledger in &self.people {
            let mut person = Person::new(ledger, &socket, 1, &signals);
            person.insist().expect("nobody hangs up");
        }
        server.kill();
    }
}

struct Lived {
    ended: Option<crate::served::Ended>,
    defects: usize,
}

#[test]
fn a_panic_in_one_persons_work_costs_one_answer_at_most() {
    for (point, number, defects) in [("handler", 20, 1), ("settling", 20, 1), ("training", 2, 0)] {
        let place = place();
        let mut server = place.serve(point, number);
        let lived = place.live(&mut server);
        assert!(lived.ended.is_none(), "{point}: {:?}", lived.ended);
        assert_eq!(lived.defects, defects, "{point}");
        // The affected actor and all others continue.
        let after = place.live(&mut server);
        assert!(after.ended.is_none(), "{point}: {:?}", after.ended);
        assert_eq!(after.defects, 0, "{point}");
        assert!(server.has_panicked(), "{point} was never passed {number} times");
        server.kill();
        place.all_is_there();
    }
}

#[test]
fn a_panic_in_what_everybody_depends_on_stops_the_process_at_once() {
    for point in ["committer", "gateway", "directory"] {
        for number in [2, 40] {
            let place = place();
            let mut server = place.serve(point, number);
            let lived = place.live(&mut server);
            let ended = lived.ended.unwrap_or_else(|| panic!("{point}: it went on"));
            assert_eq!(ended.status.code(), Some(1), "{point}: {ended:?}");
            let took = ended.since_panic.unwrap_or_else(|| panic!("{point}: no panic: {ended:?}"));
            println!("{point}, time {number}: gone after {took:?}");
            assert!(took <= AT_ONCE, "{point}: it took {took:?}: {ended:?}");
            let sentence = ended.errors.lines().last().unwrap_or_default();
            assert!(sentence.starts_with("apprentice: "), "{point}: {ended:?}");
            place.all_is_there();
        }
    }
}
