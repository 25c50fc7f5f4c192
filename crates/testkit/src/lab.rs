//! Labs at a running service: their orders, keys and clients.

use std::sync::mpsc;
use std::time::Duration;

use apprentice::actors::Registrar;
use apprentice::client::{Client, CurveKey, Identity};
use apprentice::ids::{TenantId, UserId};
use apprentice::service::{Config, Data, Service};
use apprentice::tenancy::{Order, Role};

use crate::toy::{self, Bells};

/// An endpoint at a free port of this machine.
pub const FREE_PORT: &str = "tcp://127.0.0.1:0";

/// How long an order may take.
const ORDER_MAX: Duration = Duration::from_secs(60);

/// The tenant with this name.
///
/// - panics: if the name is not allowed.
pub fn tenant(name: &str) -> TenantId {
    TenantId::new(name).expect("a name that a tenant may have")
}

/// The person with this name.
///
/// - panics: if the name is not allowed.
pub fn user(name: &str) -> UserId {
    UserId::new(name).expect("a name that a person may have")
}

/// A service of bells with an endpoint with keys.
pub fn config(data: Data) -> Config<Bells> {
    let mut config = toy::config(data);
    config.listen_curve = vec![FREE_PORT.to_owned()];
    config
}

/// Gives an order about a lab, and waits until it is durable.
///
/// - panics: if the order is refused.
pub fn order(service: &Service, lab: &str, order: impl Into<Order>) {
    obey(service.registrar(), &tenant(lab), order);
}

/// As [`order`], without a service.
pub fn obey(registrar: &Registrar, tenant: &TenantId, order: impl Into<Order>) {
    let (sender, receiver) = mpsc::channel();
    let answer = move |obeyed| sender.send(obeyed).expect("the caller waits for it");
    registrar.order(tenant.clone(), order.into(), answer);
    receiver.recv_timeout(ORDER_MAX).expect("an answer").expect("the order is carried out");
}

/// Makes a key and admits it in this role. Makes the lab if it does not exist.
pub fn admit(service: &Service, lab: &str, role: Role) -> CurveKey {
    let key = CurveKey::new().expect("ZeroMQ makes keys");
    order(service, lab, Order::Open);
    let label = format!("{role} of {lab}");
    order(service, lab, Order::Admit { key: *key.public(), role, label });
    key
}

/// What a client with this key needs to connect.
pub fn identity(service: &Service, key: &CurveKey) -> Identity {
    let server = *service.server_key().expect("the service has an endpoint with keys");
    Identity { key: key.clone(), server }
}

/// A client of the endpoint with keys, in a person's name.
pub fn connect(service: &Service, key: &CurveKey, person: &str) -> Client {
    let endpoint = &service.curve_endpoints()[0];
    Client::connect_as(endpoint, user(person), identity(service, key)).expect("it connects")
}

/// A socket with this key, not yet connected. It can send any bytes.
pub fn socket(service: &Service, key: &CurveKey, kind: zmq::SocketType) -> zmq::Socket {
    let socket = zmq::Context::new().socket(kind).expect("a socket");
    socket.set_linger(0).expect("an option");
    identity(service, key).put_on(&socket).expect("options");
    socket
}
