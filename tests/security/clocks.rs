//! What clocks cannot do, through the endpoints of a service whose clock the test sets. No jump of
//! the clock admits a retired key again. No held time in the log counts as a reading of the clock.

use std::path::{Path, PathBuf};
use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use apprentice::client::{Client, ClientError, CurveKey, ErrorCode, KeyView, Order};
use apprentice::ids::{Seq, StreamId, TenantId, Timestamp};
use apprentice::service::{Data, Service};
use apprentice::store;
use apprentice::tenancy::{Clock, Role};
use apprentice::world::Stage;
use apprentice_testkit::lab::{self, tenant, user};

/// Seconds since 1970, a day in 2026.
const TODAY: u64 = 1_790_000_000;
const DAY: u64 = 24 * 60 * 60;
const YEARS: u64 = 10 * 365 * DAY;

/// A lab with a directory, and a clock that is set by hand.
struct Clocked {
    folder: tempfile::TempDir,
    wall: Arc<AtomicU64>,
    key: CurveKey,
    service: Option<Service>,
}

impl Clocked {
    /// With one gateway key, admitted at `seconds`.
    fn new(seconds: u64) -> Clocked {
        let (folder, key) = (tempfile::tempdir().unwrap(), CurveKey::new().unwrap());
        let wall = Arc::new(AtomicU64::new(seconds));
        let mut clocked = Clocked { folder, wall, key, service: None };
        clocked.start(seconds);
        let admit = Order::Admit {
            key: *clocked.key.public(),
            role: Role::Gateway,
            label: "robot".to_owned(),
        };
        assert_eq!((clocked.order(Order::Add), clocked.order(admit)), (1, 1));
        clocked
    }

    fn at(&self, seconds: u64) {
        self.wall.store(seconds, Ordering::SeqCst);
    }

    fn directory(&self) -> PathBuf {
        self.folder.path().join("data")
    }

    /// Starts the service, or starts it again, with the clock at `seconds`.
    fn start(&mut self, seconds: u64) {
        self.stop();
        self.at(seconds);
        let wall = self.wall.clone();
        let mut config = lab::config(Data::Directory(self.directory()));
        config.clock = Clock::new(move || Timestamp(wall.load(Ordering::SeqCst) * 1_000_000));
        self.service = Some(Service::start(config).unwrap());
    }

    fn stop(&mut self) {
        if let Some(service) = self.service.take() {
            service.stop().unwrap();
        }
    }

    fn service(&self) -> &Service {
        self.service.as_ref().unwrap()
    }

    /// The single user of this machine, who may give all orders.
    fn operator(&self) -> Client {
        self.service().connect(user("operator")).unwrap()
    }

    /// - returns: how many records it led to.
    fn order(&self, order: Order) -> u32 {
        self.operator().order(Some(tenant("lab")), order).unwrap().recorded
    }

    fn retire(&self, overlap_seconds: u64) -> u32 {
        self.order(Order::Retire { key: *self.key.public(), overlap_seconds })
    }

    fn view(&self) -> KeyView {
        self.operator().tenants(Some(tenant("lab"))).unwrap()[0].keys[0].clone()
    }

    /// A new connection with the lab's key.
    fn connect(&self) -> Client {
        lab::connect(self.service(), &self.key, "ada")
    }

    /// Neither an open connection nor a new one gets an answer.
    fn shut(&self, open: &Client) {
        match open.status() {
            Err(ClientError::Failed { code: ErrorCode::Denied, .. }) => {}
            other => panic!("an open connection is served: {other:?}"),
        }
        self.shut_to_new();
    }

    fn shut_to_new(&self) {
        let error = self.connect().hello().unwrap_err();
        assert!(matches!(error, ClientError::NotAdmitted { .. }), "{error}");
        assert!(self.view().retired);
    }
}

#[test]
fn a_retired_key_stays_out_when_the_clock_is_set_back_before_and_after_a_restart() {
    let mut clocked = Clocked::new(TODAY);
    let open = clocked.connect();
    open.hello().unwrap();
    clocked.at(TODAY + 5);
    assert_eq!(clocked.retire(0), 1);
    clocked.shut(&open);
    clocked.at(TODAY - DAY);
    clocked.shut(&open);
    assert_eq!(clocked.retire(0), 0);
    for seconds in [TODAY - DAY, TODAY + 3, 0, TODAY + YEARS] {
        clocked.start(seconds);
        clocked.shut_to_new();
    }
}

#[test]
fn an_overlap_that_was_seen_to_end_stays_ended_and_a_later_record_tells_the_next_process() {
    let mut clocked = Clocked::new(TODAY);
    let open = clocked.connect();
    assert_eq!(clocked.retire(60), 1);
    clocked.at(TODAY + 59);
    open.hello().unwrap();
    clocked.connect().hello().unwrap();
    assert!(!clocked.view().retired);
    clocked.at(TODAY + 60);
    clocked.shut(&open);
    clocked.at(TODAY + 30);
    clocked.shut(&open);
    // Something else is recorded after the end of the key.
    clocked.at(TODAY + 61);
    clocked.order(Order::Disable { reason: "a pause".to_owned() });
    clocked.order(Order::Enable);
    clocked.start(TODAY + 30);
    clocked.shut_to_new();
}

#[test]
fn a_clock_set_back_before_an_overlap_began_ends_it() {
    let mut clocked = Clocked::new(TODAY);
    let open = clocked.connect();
    open.hello().unwrap();
    clocked.retire(60);
    clocked.at(TODAY - 1);
    clocked.shut(&open);
    // Records have held times now. A record of the retired key says what the clock read.
    assert_eq!(clocked.order(Order::Disable { reason: "a pause".to_owned() }), 2);
    clocked.order(Order::Enable);
    clocked.start(TODAY + 30);
    clocked.shut_to_new();
}

#[test]
fn a_clock_that_ran_ahead_once_keeps_no_key_and_its_overlaps_are_real_seconds() {
    let clocked = Clocked::new(TODAY + YEARS);
    clocked.at(TODAY);
    let open = clocked.connect();
    open.hello().unwrap();
    assert_eq!(clocked.retire(0), 1);
    clocked.shut(&open);

    let mut clocked = Clocked::new(TODAY + YEARS);
    clocked.at(TODAY);
    let open = clocked.connect();
    assert_eq!(clocked.retire(60), 1);
    clocked.at(TODAY + 59);
    open.hello().unwrap();
    clocked.at(TODAY + 60);
    clocked.shut(&open);
    clocked.start(TODAY + 60);
    clocked.shut_to_new();
}

#[test]
fn a_shorter_overlap_takes_effect_and_one_beyond_the_bound_is_refused() {
    let clocked = Clocked::new(TODAY);
    let open = clocked.connect();
    let forever = Order::Retire { key: *clocked.key.public(), overlap_seconds: u64::MAX };
    let refused = clocked.operator().order(Some(tenant("lab")), forever).unwrap_err().to_string();
    assert!(refused.contains("at most 2592000 seconds (30 days)"), "{refused}");
    assert_eq!(clocked.retire(1_000), 1);
    assert_eq!(clocked.retire(2_000), 0);
    open.hello().unwrap();
    assert_eq!(clocked.retire(10), 1);
    clocked.at(TODAY + 10);
    clocked.shut(&open);
}

/// Runs a command that must succeed.
fn said(arguments: &[&str], data: &Path) -> String {
    let output = process::Command::new(env!("CARGO_BIN_EXE_apprentice"))
        .args(arguments)
        .arg("--data")
        .arg(data)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_log_shows_which_times_were_held() {
    const HELD: &str = "time held: the clock did not move forward";
    let mut clocked = Clocked::new(TODAY);
    let ada = clocked.service().connect(user("ada")).unwrap();
    ada.start(Stage::Task { task: "Brass Glass".to_owned(), seed: 1 }).unwrap();
    clocked.at(TODAY + 7);
    ada.say("ring the brass bell").unwrap();
    clocked.at(TODAY - DAY);
    ada.say("ring the brass bell").unwrap();
    clocked.at(TODAY + 9);
    ada.say("ring the brass bell").unwrap();
    clocked.stop();

    let shown = said(&["log", "show", "--user", "ada"], &clocked.directory());
    let lines: Vec<&str> = shown.lines().collect();
    let said = (0..lines.len()).filter(|&at| lines[at].contains(" Interpreted "));
    let held: Vec<bool> = said.map(|at| lines[at + 1].trim() == HELD).collect();
    assert_eq!(held, [false, true, false], "{shown}");

    // Times never run backwards, also in a tenant's own stream.
    let store = store::open(&clocked.directory()).unwrap();
    for stream in [
        store.keys.stream_id(&TenantId::local(), &user("ada")).unwrap(),
        StreamId::of_tenant(&tenant("lab")),
    ] {
        let records = store.log.read(&stream, Seq::FIRST).unwrap();
        let records: Vec<_> = records.map(Result::unwrap).collect();
        assert!(records.windows(2).all(|two| two[0].at <= two[1].at), "{stream}");
    }
}
