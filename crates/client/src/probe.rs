//! Why a service does not answer: one handshake on a socket of its own, watched. A client asks this
//! only when an answer is overdue, so that its own socket needs no monitor, which would stall
//! handshakes while nobody reads it.

use std::time::{Duration, Instant};

use zmq::SocketEvent;

use crate::Identity;

/// What became of a handshake.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Probe {
    /// Somebody let us in.
    LetIn,
    /// We have proved to have our key, and the service does not let it in.
    NotAdmitted,
    /// We come with a key and they ask for none, or the other way round.
    OtherDoor,
    /// Somebody is there and broke off: not who we take them for.
    BrokenOff,
    /// Nothing was heard.
    Silence,
}

/// `ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH`, for which the crate has no name.
const MECHANISM_MISMATCH: u32 = 0x1100_0002;
/// Once may be a service that is just ending.
const BROKEN_OFF_MIN: usize = 2;

/// Makes one handshake and tells how it went, within `patience`.
pub(crate) fn probe(endpoint: &str, identity: Option<&Identity>, patience: Duration) -> Probe {
    // A context of its own: whatever happens on it happens to nobody else.
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
            // ZeroMQ connects again at once. It may break off before it has read what the other
            // side is, and find that out at the next attempt: a better answer may follow.
            Some(Probe::BrokenOff) => broken_off += 1,
            Some(outcome) => return Ok(outcome),
        }
    }
}

/// The first frame of an event: its number (16 bits) and its value (32 bits) as this machine
/// writes them.
fn meaning(event: &[u8]) -> Option<Probe> {
    let (number, value) = event.split_first_chunk::<2>()?;
    let value = u32::from_ne_bytes(*value.first_chunk::<4>()?);
    match (SocketEvent::from_raw(u16::from_ne_bytes(*number)), value) {
        (SocketEvent::HANDSHAKE_SUCCEEDED, _) => Some(Probe::LetIn),
        (SocketEvent::HANDSHAKE_FAILED_AUTH, _) => Some(Probe::NotAdmitted),
        (SocketEvent::HANDSHAKE_FAILED_PROTOCOL, MECHANISM_MISMATCH) => Some(Probe::OtherDoor),
        (SocketEvent::HANDSHAKE_FAILED_PROTOCOL, _)
        | (SocketEvent::HANDSHAKE_FAILED_NO_DETAIL, _) => Some(Probe::BrokenOff),
        _ => None,
    }
}
