//! Which keys are admitted, and as whom, at the endpoint with keys, from outside, through real
//! sockets.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::process::{self, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use apprentice::client::wire::{Request, decode_response, encode_request};
use apprentice::client::{
    Ask, Client, ClientError, Command, CurveKey, ErrorCode, Identity, Order, Response, ServiceAsk,
    TenantAsk, TenantVerb, fresh_id,
};
use apprentice::ids::PublicKey;
use apprentice::service::{Data, Service, StartError, server_key_file};
use apprentice::tenancy::{Quotas, Role};
use apprentice::world::Stage;
use apprentice_testkit::lab::{self, FREE_PORT, admit, connect, identity, order, tenant, user};
use apprentice_testkit::toy;

/// A client must know within this time that it is not admitted.
const BOUND: Duration = Duration::from_secs(20);

fn task() -> Stage {
    Stage::Task { task: "Brass Glass".to_owned(), seed: 1 }
}

/// A service of bells with an endpoint without keys and one with keys.
fn bells(data: Data) -> Service {
    let mut config = lab::config(data);
    config.listen = vec![FREE_PORT.to_owned()];
    Service::start(config).unwrap()
}

fn retire(key: &CurveKey) -> Order {
    Order::Retire { key: *key.public(), overlap_seconds: 0 }
}

/// The code and the sentence of a request that was refused.
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
fn a_client_with_an_admitted_key_talks_and_teaches() {
    let service = bells(Data::Memory);
    let key = admit(&service, "lab-a", Role::Gateway);
    let ada = connect(&service, &key, "ada");
    assert_eq!(ada.hello().unwrap().domain, "bells");
    ada.start(task()).unwrap();
    ada.say("ring the brass bell").unwrap();
    assert_eq!(ada.status().unwrap().utterances, 1);
    // The single user of this machine needs no key and sees none of the lab's people.
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
    // The same request id does not give the other lab's reply.
    let id = fresh_id();
    let command = |text: &str| Command::Say { utterance: text.to_owned() };
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
    order(&service, "lab-a", Order::Add);
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
fn a_client_of_the_wrong_endpoint_or_the_wrong_service_is_told_so() {
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
    // A port on which nothing listens, and which nothing else gets meanwhile.
    let gone = connect_to("tcp://127.0.0.1:1", &key, PublicKey([1; 32]));
    let error = timed(gone.with_patience(Duration::from_millis(300)));
    assert!(matches!(error, ClientError::NoAnswer { .. }), "{error}");
}

fn connect_to(endpoint: &str, key: &CurveKey, server: PublicKey) -> Client {
    Client::connect_as(endpoint, user("ada"), Identity { key: key.clone(), server }).unwrap()
}

/// A socket that can send anything.
fn stranger(service: &Service, key: &CurveKey) -> zmq::Socket {
    lab::socket(service, key, zmq::DEALER)
}

#[test]
fn an_address_that_another_could_take_is_not_answered_to() {
    let service = bells(Data::Memory);
    let key = admit(&service, "lab-a", Role::Gateway);
    let socket = stranger(&service, &key);
    socket.set_identity(b"lab-a's robot").unwrap();
    socket.connect(&service.curve_endpoints()[0]).unwrap();
    let request =
        Request { id: fresh_id(), user: user("ada"), ask: Ask::Service(ServiceAsk::Hello) };
    socket.send(encode_request(&request), 0).unwrap();
    assert_eq!(socket.poll(zmq::POLLIN, 30_000).unwrap(), 1, "an answer within 30 s");
    let (id, response) = decode_response(&socket.recv_bytes(0).unwrap()).unwrap();
    assert_eq!(id, request.id);
    assert!(matches!(&response, Response::Error(f) if f.code == ErrorCode::Denied), "{response:?}");
    service.stop().unwrap();
}

#[test]
fn a_thousand_denied_handshakes_leave_the_service_serving() {
    const HANDSHAKES: u64 = 1_000;
    let service = bells(Data::Memory);
    let key = admit(&service, "lab-a", Role::Gateway);
    let ada = connect(&service, &key, "ada");
    ada.start(task()).unwrap();
    let unknown = CurveKey::new().unwrap();
    let request =
        Request { id: fresh_id(), user: user("ada"), ask: Ask::Service(ServiceAsk::Hello) };
    let bytes = encode_request(&request);
    let mut connected = 0;
    while service.counts().handshakes_denied < HANDSHAKES {
        let wanted = (service.counts().handshakes_denied + 20).min(HANDSHAKES);
        let sockets: Vec<zmq::Socket> = (0..20)
            .map(|_| {
                let socket = stranger(&service, &unknown);
                socket.connect(&service.curve_endpoints()[0]).unwrap();
                socket.send(&bytes, zmq::DONTWAIT).unwrap();
                socket
            })
            .collect();
        connected += sockets.len();
        let end = Instant::now() + BOUND;
        while service.counts().handshakes_denied < wanted {
            assert!(Instant::now() < end, "after {connected}: {:?}", service.counts());
            thread::sleep(Duration::from_millis(1));
        }
        // The endpoints serve admitted clients all the time.
        ada.say("polish the silver bell").unwrap();
        assert!(sockets.iter().all(|socket| socket.poll(zmq::POLLIN, 0).unwrap() == 0));
    }
    connect(&service, &key, "bob").hello().unwrap();
    let counts = service.counts();
    assert!(counts.handshakes_denied >= HANDSHAKES, "{counts:?}");
    assert_eq!((counts.unvouched, counts.denied, counts.dropped), (0, 0, 0), "{counts:?}");
    println!("{counts:?}");
    service.stop().unwrap();
}

#[test]
fn other_machines_are_listened_to_with_keys_alone() {
    let mut open = toy::config(Data::Memory);
    open.listen = vec!["tcp://0.0.0.0:0".to_owned()];
    let error = Service::start(open).err().expect("it must not start");
    assert!(matches!(error, StartError::Endpoint(_)), "{error}");
    assert!(error.to_string().contains("--curve"), "{error}");
    let mut locked = toy::config(Data::Memory);
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
    let error = Service::start(lab::config(data())).err().expect("others can read its key");
    assert!(error.to_string().contains("chmod 600"), "{error}");
}

/// The code and the sentence of an order that was refused.
fn refused<T: std::fmt::Debug>(result: Result<T, ClientError>) -> (ErrorCode, String) {
    match result {
        Err(ClientError::Failed { code, message }) => (code, message),
        other => panic!("not refused: {other:?}"),
    }
}

#[test]
fn the_hosts_operator_makes_labs_over_the_wire_and_their_operators_keep_their_keys() {
    let service = bells(Data::Memory);
    let (host_key, a_key, b_key) =
        (CurveKey::new().unwrap(), CurveKey::new().unwrap(), CurveKey::new().unwrap());
    let admit = |key: &CurveKey, role| Order::Admit {
        key: *key.public(),
        role,
        label: "by the host".to_owned(),
    };
    // The single user of this machine can begin without any setup.
    let local = Client::connect(service.endpoint().unwrap(), user("root")).unwrap();
    local.order(None, admit(&host_key, Role::Operator)).unwrap();
    let host = connect(&service, &host_key, "host");
    for (lab, key) in [("lab-a", &a_key), ("lab-b", &b_key)] {
        assert_eq!(host.order(Some(tenant(lab)), Order::Add).unwrap().recorded, 1);
        assert_eq!(host.order(Some(tenant(lab)), Order::Add).unwrap().recorded, 0);
        host.order(Some(tenant(lab)), admit(key, Role::Operator)).unwrap();
    }
    let names = |client: &Client, only: Option<&str>| -> Vec<String> {
        let tenants = client.tenants(only.map(tenant)).unwrap();
        tenants.iter().map(|view| view.tenant.to_string()).collect()
    };
    assert_eq!(names(&host, None), ["lab-a", "lab-b", "local"]);
    let a = connect(&service, &a_key, "operator of a");
    assert_eq!(names(&a, None), ["lab-a"], "its own and no other");
    assert_eq!(a.tenants(None).unwrap()[0].keys.len(), 1);

    // It may manage its own keys.
    let gateway = CurveKey::new().unwrap();
    a.order(None, admit(&gateway, Role::Gateway)).unwrap();
    connect(&service, &gateway, "ada").start(task()).unwrap();
    let next = CurveKey::new().unwrap();
    let rotate = Order::Rotate { old: *gateway.public(), new: *next.public(), overlap_seconds: 0 };
    assert_eq!(a.order(Some(tenant("lab-a")), rotate).unwrap().recorded, 2);
    assert_eq!(connect(&service, &next, "ada").status().unwrap().episodes, 1);

    // It may not manage those of others, and not the quotas, which protect the others.
    let quotas = Quotas { awake_users: Some(1_000_000), ..Quotas::default() };
    let disable = || Order::Disable { reason: "rivalry".to_owned() };
    for (about, order) in [
        (Some("lab-b"), admit(&CurveKey::new().unwrap(), Role::Gateway)),
        (Some("lab-b"), Order::Retire { key: *b_key.public(), overlap_seconds: 0 }),
        (Some("lab-b"), disable()),
        (Some("local"), admit(&CurveKey::new().unwrap(), Role::Operator)),
        (Some("lab-c"), Order::Add),
        (None, Order::SetQuotas(quotas)),
        (None, disable()),
    ] {
        let message = denied(a.order(about.map(tenant), order));
        assert!(message.contains("tenant local"), "{message}");
    }
    denied(a.tenants(Some(tenant("lab-b"))));
    for role in [Role::Gateway, Role::Auditor] {
        let key = CurveKey::new().unwrap();
        host.order(Some(tenant("lab-b")), admit(&key, role)).unwrap();
        let message = denied(connect(&service, &key, "b").tenants(None));
        assert_eq!(message, format!("this needs a key with the role operator; yours is {role}"));
    }

    // An order that makes no sense is refused by name. The refusal says nothing more about a key of
    // another lab.
    let (code, message) = refused(a.order(None, admit(&a_key, Role::Auditor)));
    assert!(code == ErrorCode::Refused && message.contains("operator"), "{message}");
    let (code, message) = refused(a.order(None, admit(&b_key, Role::Gateway)));
    assert!(code == ErrorCode::Refused && !message.contains("lab-b"), "{message}");
    let (code, message) = refused(host.order(Some(tenant("lab-x")), Order::Enable));
    assert!(code == ErrorCode::Refused && message.contains("add it first"), "{message}");
    host.order(Some(tenant("lab-a")), Order::SetQuotas(quotas)).unwrap();
    assert_eq!(a.tenants(None).unwrap()[0].quotas, quotas);

    // A lab's operator erases only people of its own lab.
    let ada = connect(&service, &next, "ada");
    denied(a.erase(Some(tenant("lab-b")), user("ada")));
    denied(ada.erase(None, user("ada")));
    let verb = TenantVerb::Erase { user: user("ada") };
    let ask = Ask::Order(TenantAsk { tenant: None, verb });
    let request = Request { id: fresh_id(), user: user("operator of a"), ask };
    let socket = stranger(&service, &a_key);
    socket.connect(&service.curve_endpoints()[0]).unwrap();
    let erase = || {
        socket.send(encode_request(&request), 0).unwrap();
        assert_eq!(socket.poll(zmq::POLLIN, 30_000).unwrap(), 1, "an answer within 30 s");
        match decode_response(&socket.recv_bytes(0).unwrap()).unwrap() {
            (_, Response::Erased(view)) => view,
            other => panic!("{other:?}"),
        }
    };
    let first = erase();
    assert_eq!(ada.status().unwrap().episodes, 0, "somebody new");
    ada.start(task()).unwrap();
    // The answer was lost, for example, and the request is sent again.
    assert_eq!(erase(), first);
    assert_eq!(ada.status().unwrap().episodes, 1, "the new bearer of the name is not erased");
    let second = a.erase(None, user("ada")).unwrap();
    assert_ne!(second.erased.stream, first.erased.stream);
    let (code, message) = refused(a.erase(None, user("nobody")));
    assert!(code == ErrorCode::Refused && message.contains("no records"), "{message}");

    // An operator can retire its own key.
    a.order(None, Order::Retire { key: *a_key.public(), overlap_seconds: 0 }).unwrap();
    denied(a.tenants(None));
    service.stop().unwrap();
}

fn apprentice(arguments: &[&str]) -> process::Output {
    process::Command::new(env!("CARGO_BIN_EXE_apprentice")).args(arguments).output().unwrap()
}

/// The output of a command that succeeded.
fn said(arguments: &[&str]) -> String {
    let output = apprentice(arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {errors}");
    String::from_utf8(output.stdout).unwrap()
}

/// The error of a command, with its exit code.
fn complained(arguments: &[&str]) -> (i32, String) {
    let output = apprentice(arguments);
    (output.status.code().unwrap(), String::from_utf8(output.stderr).unwrap())
}

#[test]
fn the_same_orders_are_given_to_a_closed_directory_and_to_a_running_service() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (data, host, lab, next) = (path("data"), path("host"), path("lab"), path("next"));
    let (code, text) = complained(&["tenant", "list", "--data", &data]);
    assert!(code == 2 && text.contains("no data directory"), "{text}");
    for file in [&host, &lab, &next] {
        let printed = said(&["keys", "new", "--out", file]);
        assert_eq!(printed, fs::read_to_string(format!("{file}.pub")).unwrap());
    }
    let (code, text) = complained(&["keys", "new", "--out", &lab]);
    assert!(code == 2 && text.contains("already exists"), "{text}");
    let public = |file: &str| format!("{file}.pub");

    // The service is stopped: the first tenant makes the directory.
    let (host_pub, lab_pub, next_pub) = (public(&host), public(&lab), public(&next));
    said(&["tenant", "add", "lab-a", "--data", &data]);
    said(&["tenant", "admit", "local", &host_pub, "--role", "operator", "--data", &data]);
    let label = ["--label", "room 7"];
    let admit = ["tenant", "admit", "lab-a", &lab_pub, "--role", "gateway", label[0], label[1]];
    let closed = [&admit[..], &["--data", &data]].concat();
    assert_eq!(said(&closed), "tenant lab-a: done\n");
    assert_eq!(said(&closed), "tenant lab-a: nothing changed; this was already done\n");
    let listed = said(&["tenant", "list", "lab-a", "--data", &data]);
    let printed = fs::read_to_string(&lab_pub).unwrap();
    assert!(listed.contains(printed.trim()) && listed.contains("room 7"), "{listed}");
    let (code, text) = complained(&["tenant", "list", "lab-z", "--data", &data]);
    assert!(code == 1 && text.contains("no tenant lab-z"), "{text}");

    // The service runs: the same commands, with the operator's key.
    let service = Service::start(lab::config(Data::Directory(folder.path().join("data")))).unwrap();
    let server = said(&["keys", "show", "--data", &data]);
    let endpoint = service.curve_endpoints()[0].clone();
    let (code, text) = complained(&closed.iter().map(|word| &**word).collect::<Vec<&str>>());
    assert!(code == 2 && text.contains("--connect"), "{text}");
    let as_host = ["--connect", &endpoint, "--key", &host, "--server-key", server.trim()];
    assert_eq!(
        said(&[&admit[..], &as_host].concat()),
        "tenant lab-a: nothing changed; this was already done\n"
    );
    assert_eq!(said(&[&["tenant", "list", "lab-a"][..], &as_host].concat()), listed);
    let ada =
        connect(&service, &CurveKey::read(folder.path().join("lab").as_path()).unwrap(), "ada");
    ada.start(task()).unwrap();
    let rotate = ["tenant", "rotate-key", "lab-a", &lab_pub, &next_pub, "--overlap", "0s"];
    said(&[&rotate[..], &as_host].concat());
    denied(ada.status());
    let ada =
        connect(&service, &CurveKey::read(folder.path().join("next").as_path()).unwrap(), "ada");
    assert_eq!(ada.status().unwrap().episodes, 1);
    let quotas = ["tenant", "quotas", "lab-a", "--awake-users", "5"];
    said(&[&quotas[..], &as_host].concat());
    assert_eq!(said(&[&quotas[..3], &as_host].concat()), "lab-a: at most 5 people awake\n");
    said(&[&["tenant", "disable", "lab-a", "--reason", "unpaid"][..], &as_host].concat());
    denied(ada.status());
    said(&[&["tenant", "enable", "lab-a"][..], &as_host].concat());
    ada.status().unwrap();
    let as_lab = ["--connect", &endpoint, "--key", &next, "--server-key", server.trim()];
    let (code, text) = complained(&[&["tenant", "list"][..], &as_lab].concat());
    assert!(code == 1 && text.contains("the role operator; yours is gateway"), "{text}");
    let talk = ["talk", "--connect", &endpoint, "--key", &lab, "--server-key", server.trim()];
    let (code, text) = complained(&talk);
    assert!(code == 1 && text.contains("does not admit your key"), "{text}");
    service.stop().unwrap();

    // And stopped again: the orders had their effect.
    let listed = said(&["tenant", "list", "lab-a", "--data", &data]);
    assert!(listed.contains("at most 5 people awake") && listed.contains("until"), "{listed}");
}

/// If no thread answers handshakes, ZeroMQ admits every connection. So the service must end
/// instead.
#[test]
fn a_service_that_cannot_answer_handshakes_ends_and_answers_nobody() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let mut child = process::Command::new(env!("CARGO_BIN_EXE_apprentice"))
        .args(["serve", "--recipe", "tiny", "--log-filter", "off", "--curve", "tcp://127.0.0.1:0"])
        .arg("--data")
        .arg(&data)
        .env("APPRENTICE_PANIC", "authenticator:2")
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
    let server = apprentice::client::read_public(&server).unwrap();
    let key = CurveKey::new().unwrap();
    for _ in 0..2 {
        let client = connect_to(&endpoint, &key, server).with_patience(Duration::from_secs(1));
        client.hello().unwrap_err();
    }
    let deadline = Instant::now() + Duration::from_secs(60);
    while child.try_wait().unwrap().is_none() {
        if Instant::now() > deadline {
            child.kill().unwrap();
            panic!("it answers no handshakes and goes on");
        }
        thread::sleep(Duration::from_millis(20));
    }
    let ended = child.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(1));
    let said = String::from_utf8(ended.stderr).unwrap();
    assert!(said.contains("the thread that authenticates new connections ended"), "{said}");
}
