//! A client that keeps the bytes of every answer, and disconnects when it is told to.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use apprentice::client::wire::{Request, decode_response, encode_request};
use apprentice::client::{Ask, Response};
use apprentice::ids::{RequestId, UserId};

use crate::served::endpoint;

pub struct Line<'a> {
    socket: zmq::Socket,
    user: UserId,
    /// Disconnected: no answers come any more.
    stop: &'a AtomicBool,
}

/// An answer and its bytes.
pub struct Heard {
    pub bytes: Vec<u8>,
    pub response: Response,
}

/// Time after which a request without an answer is sent again.
const AGAIN: Duration = Duration::from_secs(10);

impl Line<'_> {
    pub fn new<'a>(socket_file: &Path, user: &UserId, stop: &'a AtomicBool) -> Line<'a> {
        let socket = zmq::Context::new().socket(zmq::DEALER).unwrap();
        socket.set_linger(0).unwrap();
        socket.set_reconnect_ivl(5).unwrap();
        socket.connect(&endpoint(socket_file)).unwrap();
        Line { socket, user: user.clone(), stop }
    }

    /// Asks until there is an answer other than Busy, always with the same id.
    ///
    /// - returns: none if the client was disconnected.
    pub fn ask(&self, id: RequestId, ask: &Ask) -> Option<Heard> {
        let bytes = encode_request(&Request { id, user: self.user.clone(), ask: ask.clone() });
        loop {
            // A full pipe has no receiver any more: the next attempt sends again.
            let _ = self.socket.send(&bytes, zmq::DONTWAIT);
            match self.answer(id, Instant::now() + AGAIN) {
                Some(Heard { response: Response::Busy(busy), .. }) => {
                    thread::sleep(Duration::from_millis(u64::from(busy.retry_after_ms.min(50))));
                }
                Some(heard) => return Some(heard),
                None => {}
            }
            if self.stop.load(Ordering::SeqCst) {
                return None;
            }
        }
    }

    fn answer(&self, id: RequestId, until: Instant) -> Option<Heard> {
        while Instant::now() < until {
            if self.socket.poll(zmq::POLLIN, 5).unwrap() == 0 {
                if self.stop.load(Ordering::SeqCst) {
                    return None;
                }
                continue;
            }
            let Ok(frames) = self.socket.recv_multipart(zmq::DONTWAIT) else { continue };
            let [bytes] = <[Vec<u8>; 1]>::try_from(frames).expect("answers have one frame");
            let (found, response) = decode_response(&bytes).expect("answers can be read");
            if found == id {
                return Some(Heard { bytes, response });
            }
        }
        None
    }
}
