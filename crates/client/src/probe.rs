//! Finds out why a service does not answer, by one handshake on another socket with a monitor. A
//! client does this only when an answer is late. Its own socket has no monitor, because a monitor
//! that is not read delays handshakes.

use std::time::{Duration, Instant};

use zmq::SocketEvent;

use crate::Identity;

/// How a handshake ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Probe {
    /// The service accepted the connection.
    Accepted,
    /// The service knows our key and does not admit it.
    NotAdmitted,
    /// Only one of the two sides uses keys.
    OtherMechanism,
    /// The other side ended the handshake: it has not the key that we expected.
    BrokenOff,
    /// No answer.
    Silence,
}

/// `ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH`, which the `zmq` crate does not name.
const MECHANISM_MISMATCH: u32 = 0x1100_0002;
/// How often the other side must end handshakes: a service that stops may end one.
const BROKEN_OFF_MIN: usize = 2;

/// Makes one handshake, for at most `patience`.
pub(crate) fn probe(endpoint: &str, identity: Option<&Identity>, patience: Duration) -> Probe {
    // Its own context, so that it disturbs no other socket.
    let context = zmq::Context::new();
    watch(&context, endpoint, identity, patience).unwrap_or(Probe::Silence)
}

fn watch(
    context: &zmq::Context,
    endpoint: &str,
    identity: Option<&Identity>,
    patience: Duration,
) -> zmq::Result<Probe> {
    const MONITOR: &str = "inproc://probe";
    let socket = context.socket(zmq::DEALER)?;
    socket.set_linger(0)?;
    socket.set_ipv6(endpoint.contains('['))?;
    if let Some(identity) = identity {
        identity.put_on(&socket)?;
    }
    let events = [
        SocketEvent::HANDSHAKE_SUCCEEDED,
        SocketEvent::HANDSHAKE_FAILED_AUTH,
        SocketEvent::HANDSHAKE_FAILED_PROTOCOL,
        SocketEvent::HANDSHAKE_FAILED_NO_DETAIL,
    ];
    socket.monitor(MONITOR, events.iter().map(|event| i32::from(event.to_raw())).sum())?;
    let monitor = context.socket(zmq::PAIR)?;
    monitor.set_linger(0)?;
    monitor.connect(MONITOR)?;
    socket.connect(endpoint)?;
    let end = Instant::now() + patience;
    let mut broken_off = 0;
    loop {
        let left = end.saturating_duration_since(Instant::now());
        let left_ms = left.as_micros().div_ceil(1_000) as i64;
        match monitor.poll(zmq::POLLIN, left_ms) {
            Ok(0) if Instant::now() >= end => {
                let is_broken_off = broken_off >= BROKEN_OFF_MIN;
                return Ok(if is_broken_off { Probe::BrokenOff } else { Probe::Silence });
            }
            Ok(0) | Err(zmq::Error::EINTR) => continue,
            Ok(_) => {}
            Err(error) => return Err(error),
        }
        let frames = monitor.recv_multipart(0)?;
        match frames.first().and_then(|event| meaning(event)) {
            None => {}
            // ZeroMQ connects again at once. The next attempt may show more than that the
            // handshake was ended.
            Some(Probe::BrokenOff) => broken_off += 1,
            Some(outcome) => return Ok(outcome),
        }
    }
}

/// Reads the first frame of a monitor's event: its number (16 bits) and its value (32 bits), in the
/// byte order of this machine.
fn meaning(event: &[u8]) -> Option<Probe> {
    let (number, value) = event.split_first_chunk::<2>()?;
    let value = u32::from_ne_bytes(*value.first_chunk::<4>()?);
    match (SocketEvent::from_raw(u16::from_ne_bytes(*number)), value) {
        (SocketEvent::HANDSHAKE_SUCCEEDED, _) => Some(Probe::Accepted),
        (SocketEvent::HANDSHAKE_FAILED_AUTH, _) => Some(Probe::NotAdmitted),
        (SocketEvent::HANDSHAKE_FAILED_PROTOCOL, MECHANISM_MISMATCH) => Some(Probe::OtherMechanism),
        (SocketEvent::HANDSHAKE_FAILED_PROTOCOL, _)
        | (SocketEvent::HANDSHAKE_FAILED_NO_DETAIL, _) => Some(Probe::BrokenOff),
        _ => None,
    }
}
