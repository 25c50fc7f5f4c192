//! The few calls of `libzmq` that the `zmq` crate does not offer. It is the only unsafe code of the
//! frontends, and it reads no byte from outside.

use std::ffi::c_void;
use std::ops::Deref;
use std::os::raw::c_int;

use super::unsent::Parcel;
use crate::limits::{SEND_BUFFER_BYTES, UNREAD_S_MAX};

/// A socket that sends parcels.
pub(super) struct Outlet {
    socket: zmq::Socket,
    /// The same socket, as `libzmq` knows it.
    handle: *mut c_void,
}

// SAFETY: the handle is the socket's own, and a `zmq::Socket` may be sent to another thread.
unsafe impl Send for Outlet {}

impl Deref for Outlet {
    type Target = zmq::Socket;

    fn deref(&self) -> &zmq::Socket {
        &self.socket
    }
}

impl Outlet {
    pub fn new(mut socket: zmq::Socket) -> Outlet {
        let handle = socket.as_mut_ptr();
        Outlet { socket, handle }
    }

    /// Sends `frames`, and a parcel as the last frame of the message. Does not wait. The space of
    /// the parcel is free again when `libzmq` no longer needs its bytes.
    ///
    /// - errors: as [`zmq::Socket::send`]; then the parcel is dropped.
    pub fn send_parcel(&self, frames: Vec<Vec<u8>>, parcel: Parcel) -> zmq::Result<()> {
        for frame in frames {
            self.socket.send(frame, zmq::DONTWAIT | zmq::SNDMORE)?;
        }
        send(self.handle, parcel)
    }

    /// Limits how many bytes the kernel keeps for each network connection, and for how long:
    /// [`SEND_BUFFER_BYTES`] and [`UNREAD_S_MAX`].
    pub fn bound_sending(&self) -> zmq::Result<()> {
        self.socket.set_sndbuf(SEND_BUFFER_BYTES)?;
        let value = c_int::try_from(UNREAD_S_MAX * 1_000).expect("half a minute fits");
        let option = zmq_sys::ZMQ_TCP_MAXRT as c_int;
        // SAFETY: the option takes an int, of which pointer and size are given. The handle is that
        // of a socket that is open as long as `self` is there.
        let set = unsafe {
            let value = (&raw const value).cast::<c_void>();
            zmq_sys::zmq_setsockopt(self.handle, option, value, size_of::<c_int>())
        };
        if set == 0 { Ok(()) } else { Err(last_error()) }
    }
}

fn send(socket: *mut c_void, parcel: Parcel) -> zmq::Result<()> {
    let parcel = Box::new(parcel);
    let (data, size) = (parcel.bytes.as_ptr(), parcel.bytes.len());
    let mut message = zmq_sys::zmq_msg_t::default();
    let hint = Box::into_raw(parcel).cast::<c_void>();
    // SAFETY: `data` points to `size` bytes on the heap that `parcel` owns. It is not touched and
    // not moved until `let_go` frees it, which libzmq calls once, after its last use of the bytes.
    // libzmq does not write to the bytes of a message that is sent.
    let made = unsafe {
        let data = data.cast_mut().cast::<c_void>();
        zmq_sys::zmq_msg_init_data(&mut message, data, size, Some(let_go), hint)
    };
    if made != 0 {
        // SAFETY: libzmq did not take the parcel (it had no memory), and will not call `let_go`.
        unsafe { let_go(std::ptr::null_mut(), hint) };
        return Err(last_error());
    }
    // SAFETY: the message is initialised, and the socket is open as long as its `Outlet` is there.
    let sent = unsafe { zmq_sys::zmq_msg_send(&mut message, socket, zmq::DONTWAIT) };
    if sent >= 0 {
        return Ok(());
    }
    let error = last_error();
    // SAFETY: a message that was not sent is still ours to close, which calls `let_go`.
    unsafe { zmq_sys::zmq_msg_close(&mut message) };
    Err(error)
}

/// Frees a parcel. libzmq calls it on any of its threads.
unsafe extern "C" fn let_go(_data: *mut c_void, hint: *mut c_void) {
    // SAFETY: `hint` came from `Box::into_raw` in `send`, and this is called once for it.
    drop(unsafe { Box::from_raw(hint.cast::<Parcel>()) });
}

fn last_error() -> zmq::Error {
    // SAFETY: reads the error number of this thread.
    zmq::Error::from_raw(unsafe { zmq_sys::zmq_errno() })
}

#[cfg(test)]
mod tests {
    use super::super::unsent::Unsent;
    use super::*;
    use crate::ids::TenantId;

    #[test]
    fn a_parcel_gives_its_space_back_when_it_was_read_and_when_the_peer_is_gone() {
        let context = zmq::Context::new();
        let router = Outlet::new(context.socket(zmq::ROUTER).unwrap());
        router.set_router_mandatory(true).unwrap();
        router.bound_sending().unwrap();
        router.bind("tcp://127.0.0.1:*").unwrap();
        let endpoint = router.get_last_endpoint().unwrap().unwrap();
        let dealer = context.socket(zmq::DEALER).unwrap();
        dealer.connect(&endpoint).unwrap();
        dealer.send("hello", 0).unwrap();
        let id = router.recv_multipart(0).unwrap().remove(0);

        const BYTES: usize = 100_000;
        let (unsent, lab) = (Unsent::new(BYTES + 1_000), TenantId::local());
        let take = || unsent.pack(&lab, Some((0, id.clone())), vec![7; BYTES]);
        for round in 0..20 {
            // There is space for one, so the former one gave its space back.
            let parcel = (0..10_000).find_map(|_| {
                std::thread::yield_now();
                take()
            });
            router.send_parcel(vec![id.clone()], parcel.expect("room")).unwrap();
            assert_eq!(dealer.recv_bytes(0).unwrap(), vec![7; BYTES], "round {round}");
        }
        let gone = router.send_parcel(vec![b"nobody".to_vec()], take().expect("room"));
        assert_eq!(gone, Err(zmq::Error::EHOSTUNREACH));
        assert!(take().is_some(), "what was not sent takes no room");
    }
}
