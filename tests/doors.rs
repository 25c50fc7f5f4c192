//! Who comes in, as whom, and who does not: the door with keys from outside, through real sockets.

#[path = "support/toy.rs"]
#[allow(dead_code)]
mod toy;

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::process::{self, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use apprentice::actors::{Ask, ErrorCode, Response};
use apprentice::frontends::wire::{Request, decode_response, encode_request};
use apprentice::frontends::{Client, ClientError, CurveKey, Identity, fresh_id};
use apprentice::ids::{PublicKey, TenantId, UserId};
use apprentice::service::{Data, Service, StartError, server_key_file};
use apprentice::tenancy::{Order, Role};
use apprentice::world::Stage;
use toy::config;

/// Within this a client must know that it is not let in.
const BOUND: Duration = Duration::from_secs(20);

fn user(name: &str) -> UserId {
    UserId::new(name).unwrap()
}

fn tenant(name: &str) -> TenantId {
    TenantId::new(name).unwrap()
}

fn task() -> Stage {
    Stage::Task { task: "Brass Glass".to_owned(), seed: 1 }
}

/// A service of bells with an open door and one with keys.
fn bells(data: Data) -> Service {
    let mut config = config(data);
    config.listen = vec!["tcp://127.0.0.1:0".to_owned()];
    config.listen_curve = vec!["tcp://127.0.0.1:0".to_owned()];
    Service::start(config).unwrap()
}

/// Carries out orders and waits until they are durable.
fn order(service: &Service, name: &str, order: Order) {
    let (sender, receiver) = mpsc::channel();
    service.registrar().order(tenant(name), order, move |obeyed| sender.send(obeyed).unwrap());
    receiver.recv_timeout(BOUND).unwrap().unwrap();
}

fn admit(service: &Service, name: &str, role: Role) -> CurveKey {
    let key = CurveKey::new().unwrap();
    order(service, name, Order::Open);
    let label = format!("{role} of {name}");
    order(service, name, Order::Admit { key: *key.public(), role, label });
    key
}

fn identity(service: &Service, key: &CurveKey) -> Identity {
    Identity { key: key.clone(), server: *service.server_key().unwrap() }
}

fn connect(service: &Service, key: &CurveKey, name: &str) -> Client {
    let endpoint = &service.curve_endpoints()[0];
    Client::connect_as(endpoint, user(name), identity(service, key)).unwrap()
}

fn retire(key: &CurveKey) -> Order {
    Order::Retire { key: *key.public(), overlap_seconds: 0 }
}

/// The code and the sentence of a request that was not carried out.
fn denied<T: std::fmt::Debug>(result: Result<T, ClientError>) -> String {
    match result {
        Err(ClientError::Failed { code: ErrorCode::Denied, message }) => message,
        other => panic!("not denied: {other:?}"),
    }
}

fn not_let_in(client: &Client) {
    let began = Instant::now();
    let error = client.hello().unwrap_err();
    assert!(matches!(error, ClientError::NotAdmitted { .. }), "{error}");
    assert!(error.to_string().contains("tenant admit"), "{error}");
    assert!(began.elapsed() < BOUND, "{:?}", began.elapsed());
}

#[test]
fn whoever_has_an_admitted_key_talks_and_teaches() {
    let service = bells(Data::Memory);
    let key = admit(&service, "lab-a", Role::Gateway);
    let ada = connect(&service, &key, "ada");
    assert_eq!(ada.hello().unwrap().domain, "bells");
    ada.start(task()).unwrap();
    ada.say("ring the brass bell").unwrap();
    assert_eq!(ada.status().unwrap().utterances, 1);
    // The single user of this machine needs no key and meets none of the lab's people.
    let local = Client::connect(service.endpoint().unwrap(), user("ada")).unwrap();
    assert_eq!(local.status().unwrap().episodes, 0);
    assert!(service.counts().handshakes >= 1);
    service.stop().unwrap();
}

#[test]
fn two_labs_with_one_name_for_their_people_do_not_meet() {
    let service = bells(Data::Memory);
    let labs = ["lab-a", "lab-b"].map(|lab| admit(&service, lab, Role::Gateway));
    let [a, b] = labs.each_ref().map(|key| connect(&service, key, "ada"));
    a.start(task()).unwrap();
    let unknown = a.say("sterilize the brass bell").unwrap();
    assert_eq!(b.status().unwrap().episodes, 0, "nothing of the other lab's");
    b.start(task()).unwrap();
    assert_eq!((a.status().unwrap().utterances, b.status().unwrap().utterances), (1, 0));
    // Not even a request id brings out the other's reply.
    let id = fresh_id();
    let command = |text: &str| apprentice::session::Command::Say { utterance: text.to_owned() };
    let mine = a.command_again(id, command("ring the brass bell")).unwrap();
    let theirs = b.command_again(id, command("ring the glass bell")).unwrap();
    assert_ne!(mine, theirs);
    assert!(a.status().unwrap().utterances == 2 && unknown.first.get() > 0);
    service.stop().unwrap();
}

#[test]
fn an_unknown_key_is_told_so_in_one_sentence_and_comes_in_once_it_is_admitted() {
    let service = bells(Data::Memory);
    let key = CurveKey::new().unwrap();
    let ada = connect(&service, &key, "ada");
    not_let_in(&ada);
    order(&service, "lab-a", Order::Open);
    let admit = Order::Admit { key: *key.public(), role: Role::Gateway, label: "late".to_owned() };
    order(&service, "lab-a", admit);
    ada.hello().unwrap();
    service.stop().unwrap();
}

#[test]
fn a_retired_key_is_refused_at_the_next_message_of_its_open_connection() {
    let service = bells(Data::Memory);
    let key = admit(&service, "lab-a", Role::Gateway);
    let ada = connect(&service, &key, "ada");
    ada.start(task()).unwrap();
    order(&service, "lab-a", retire(&key));
    let message = denied(ada.say("ring the brass bell"));
    assert!(!message.contains("lab-a") && !message.contains("retired"), "{message}");
    denied(ada.hello());
    not_let_in(&connect(&service, &key, "ada"));
    assert_eq!(service.counts().denied, 2);
    service.stop().unwrap();
}

#[test]
fn a_rotation_keeps_both_keys_for_as_long_as_it_says() {
    let service = bells(Data::Memory);
    let old = admit(&service, "lab-a", Role::Gateway);
    let before = connect(&service, &old, "ada");
    before.start(task()).unwrap();
    let new = CurveKey::new().unwrap();
    let rotate =
        |overlap_seconds| Order::Rotate { old: *old.public(), new: *new.public(), overlap_seconds };
    order(&service, "lab-a", rotate(3_600));
    let after = connect(&service, &new, "ada");
    for client in [&before, &after] {
        client.say("ring the silver bell").unwrap();
    }
    assert_eq!(after.status().unwrap().utterances, 2, "the same people");
    order(&service, "lab-a", rotate(0));
    denied(before.status());
    after.status().unwrap();
    service.stop().unwrap();
}

#[test]
fn a_role_asks_what_is_its_own_and_is_told_which_role_the_rest_needs() {
    let service = bells(Data::Memory);
    let auditor = connect(&service, &admit(&service, "lab-a", Role::Auditor), "ada");
    let operator = connect(&service, &admit(&service, "lab-a", Role::Operator), "ada");
    auditor.hello().unwrap();
    operator.status().unwrap();
    let held = "this needs a key with the role";
    let cannot = "gateway or operator; yours is auditor";
    assert_eq!(denied(auditor.status()), format!("{held} {cannot}"));
    assert_eq!(denied(auditor.known()), format!("{held} {cannot}"));
    assert_eq!(denied(auditor.start(task())), format!("{held} gateway; yours is auditor"));
    assert_eq!(denied(operator.start(task())), format!("{held} gateway; yours is operator"));
    service.stop().unwrap();
}

#[test]
fn a_disabled_lab_is_shut_out_and_comes_back_as_it_was() {
    let service = bells(Data::Memory);
    let (a, b) = (admit(&service, "lab-a", Role::Gateway), admit(&service, "lab-b", Role::Gateway));
    let (ada, bob) = (connect(&service, &a, "ada"), connect(&service, &b, "bob"));
    ada.start(task()).unwrap();
    order(&service, "lab-a", Order::Disable { reason: "unpaid".to_owned() });
    let message = denied(ada.status());
    assert!(!message.contains("unpaid"), "{message}");
    not_let_in(&connect(&service, &a, "ada"));
    bob.start(task()).unwrap();
    order(&service, "lab-a", Order::Enable);
    assert_eq!(ada.status().unwrap().episodes, 1);
    service.stop().unwrap();
}

#[test]
fn whoever_knocks_at_the_wrong_door_or_at_a_wrong_service_is_told_so() {
    let service = bells(Data::Memory);
    let key = admit(&service, "lab-a", Role::Gateway);
    let locked = service.curve_endpoints()[0].clone();
    let timed = |client: Client| {
        let began = Instant::now();
        let error = client.hello().unwrap_err();
        assert!(began.elapsed() < BOUND, "{:?}", began.elapsed());
        error
    };
    let error = timed(Client::connect(&locked, user("ada")).unwrap());
    assert!(matches!(error, ClientError::KeyWanted { .. }), "{error}");
    let open = service.endpoint().unwrap();
    let error = timed(Client::connect_as(open, user("ada"), identity(&service, &key)).unwrap());
    assert!(matches!(error, ClientError::NoKeyWanted { .. }), "{error}");
    let server = *CurveKey::new().unwrap().public();
    let stranger = Identity { key: key.clone(), server };
    let error = timed(Client::connect_as(&locked, user("ada"), stranger).unwrap());
    assert!(matches!(error, ClientError::WrongServer { .. }), "{error}");
    assert!(error.to_string().contains("keys show"), "{error}");
    service.stop().unwrap();
    let gone = connect_to(&locked, &key, PublicKey([1; 32]));
    let error = timed(gone.with_patience(Duration::from_millis(300)));
    assert!(matches!(error, ClientError::NoAnswer { .. }), "{error}");
}

fn connect_to(endpoint: &str, key: &CurveKey, server: PublicKey) -> Client {
    Client::connect_as(endpoint, user("ada"), Identity { key: key.clone(), server }).unwrap()
}

/// A socket with a key that says what it likes.
fn stranger(service: &Service, key: &CurveKey, folder: &tempfile::TempDir) -> zmq::Socket {
    let path = folder.path().join(fresh_id().to_string());
    key.write_new(&path).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    let field = |name: &str| {
        let line = text.lines().find_map(|line| line.trim().strip_prefix(name)).unwrap();
        zmq::z85_decode(line.trim().trim_start_matches("= ").trim_matches('"')).unwrap()
    };
    let socket = zmq::Context::new().socket(zmq::DEALER).unwrap();
    socket.set_linger(0).unwrap();
    socket.set_curve_publickey(&field("public-key")).unwrap();
    socket.set_curve_secretkey(&field("secret-key")).unwrap();
    socket.set_curve_serverkey(&service.server_key().unwrap().0).unwrap();
    socket
}

#[test]
fn an_address_that_another_could_take_is_not_answered_to() {
    let (service, folder) = (bells(Data::Memory), tempfile::tempdir().unwrap());
    let key = admit(&service, "lab-a", Role::Gateway);
    let socket = stranger(&service, &key, &folder);
    socket.set_identity(b"lab-a's robot").unwrap();
    socket.connect(&service.curve_endpoints()[0]).unwrap();
    let request = Request { id: fresh_id(), user: user("ada"), ask: Ask::Hello };
    socket.send(encode_request(&request), 0).unwrap();
    assert_eq!(socket.poll(zmq::POLLIN, 30_000).unwrap(), 1, "an answer within 30 s");
    let (id, response) = decode_response(&socket.recv_bytes(0).unwrap()).unwrap();
    assert_eq!(id, request.id);
    assert!(matches!(&response, Response::Error(f) if f.code == ErrorCode::Denied), "{response:?}");
    service.stop().unwrap();
}

#[test]
fn a_thousand_denied_handshakes_leave_the_service_serving() {
    const KNOCKS: u64 = 1_000;
    let (service, folder) = (bells(Data::Memory), tempfile::tempdir().unwrap());
    let key = admit(&service, "lab-a", Role::Gateway);
    let ada = connect(&service, &key, "ada");
    ada.start(task()).unwrap();
    let unknown = CurveKey::new().unwrap();
    let request = Request { id: fresh_id(), user: user("ada"), ask: Ask::Hello };
    let bytes = encode_request(&request);
    let mut knocked = 0;
    while service.counts().handshakes_denied < KNOCKS {
        let wanted = (service.counts().handshakes_denied + 20).min(KNOCKS);
        let sockets: Vec<zmq::Socket> = (0..20)
            .map(|_| {
                let socket = stranger(&service, &unknown, &folder);
                socket.connect(&service.curve_endpoints()[0]).unwrap();
                socket.send(&bytes, zmq::DONTWAIT).unwrap();
                socket
            })
            .collect();
        knocked += sockets.len();
        let end = Instant::now() + BOUND;
        while service.counts().handshakes_denied < wanted {
            assert!(Instant::now() < end, "after {knocked}: {:?}", service.counts());
            thread::sleep(Duration::from_millis(1));
        }
        // The doors are open to those who may come in, all the while.
        ada.say("polish the silver bell").unwrap();
        assert!(sockets.iter().all(|socket| socket.poll(zmq::POLLIN, 0).unwrap() == 0));
    }
    connect(&service, &key, "bob").hello().unwrap();
    let counts = service.counts();
    assert!(counts.handshakes_denied >= KNOCKS, "{counts:?}");
    assert_eq!((counts.unvouched, counts.denied, counts.dropped), (0, 0, 0), "{counts:?}");
    println!("{counts:?}");
    service.stop().unwrap();
}

#[test]
fn other_machines_are_listened_to_with_keys_alone() {
    let mut open = config(Data::Memory);
    open.listen = vec!["tcp://0.0.0.0:0".to_owned()];
    let error = Service::start(open).err().expect("it must not start");
    assert!(matches!(error, StartError::Endpoint(_)), "{error}");
    assert!(error.to_string().contains("--curve"), "{error}");
    let mut locked = config(Data::Memory);
    locked.listen_curve = vec!["tcp://*:0".to_owned()];
    let service = Service::start(locked).unwrap();
    let port = service.curve_endpoints()[0].rsplit_once(':').unwrap().1.to_owned();
    let key = admit(&service, "lab-a", Role::Gateway);
    let server = *service.server_key().unwrap();
    connect_to(&format!("tcp://127.0.0.1:{port}"), &key, server).hello().unwrap();
    service.stop().unwrap();
    let plain =
        Client::connect("tcp://192.0.2.1:7117", user("ada")).err().expect("a key is wanted");
    assert!(plain.to_string().contains("--server-key"), "{plain}");
}

#[test]
fn a_service_keeps_its_key_and_its_labs_over_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let data = || Data::Directory(folder.path().join("data"));
    let service = bells(data());
    let key = admit(&service, "lab-a", Role::Gateway);
    let server = *service.server_key().unwrap();
    connect(&service, &key, "ada").start(task()).unwrap();
    service.stop().unwrap();
    let file = server_key_file(&folder.path().join("data"));
    assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600);

    let service = bells(data());
    assert_eq!(*service.server_key().unwrap(), server);
    assert_eq!(connect(&service, &key, "ada").status().unwrap().episodes, 1);
    service.stop().unwrap();

    fs::set_permissions(&file, fs::Permissions::from_mode(0o644)).unwrap();
    let mut config = config(data());
    config.listen_curve = vec!["tcp://127.0.0.1:0".to_owned()];
    let error = Service::start(config).err().expect("others can read its key");
    assert!(error.to_string().contains("chmod 600"), "{error}");
}

/// A server whose handshakes nobody answers would let everybody in: it must end instead.
#[test]
fn a_service_that_cannot_answer_handshakes_ends_and_answers_nobody() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let mut child = process::Command::new(env!("CARGO_BIN_EXE_apprentice"))
        .args(["serve", "--recipe", "tiny", "--log-filter", "off", "--curve", "tcp://127.0.0.1:0"])
        .arg("--data")
        .arg(&data)
        .env("APPRENTICE_PANIC", "doorkeeper:2")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut out = std::io::BufReader::new(child.stdout.take().unwrap());
    let mut line = || {
        let mut line = String::new();
        std::io::BufRead::read_line(&mut out, &mut line).unwrap();
        line.trim().to_owned()
    };
    let endpoint = line().strip_prefix("serving with keys at ").unwrap().to_owned();
    let server = line().strip_prefix("server key ").unwrap().to_owned();
    let server = apprentice::frontends::read_public(&server).unwrap();
    let key = CurveKey::new().unwrap();
    for _ in 0..2 {
        let client = connect_to(&endpoint, &key, server).with_patience(Duration::from_secs(1));
        client.hello().unwrap_err();
    }
    let ended = child.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(1));
    let said = String::from_utf8(ended.stderr).unwrap();
    assert!(said.contains("the thread that answers handshakes ended"), "{said}");
}
