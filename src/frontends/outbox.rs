use std::collections::VecDeque;
use std::io::{Read, Write};
use std::os::fd::{AsRawFd, RawFd};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// What actors hand to the gateway's thread, and how they wake it: a socket has one owner, so they
/// cannot send themselves. Bounded by the gateway's own count of requests in flight: each request
/// puts one answer here and no more.
#[derive(Debug)]
pub(super) struct Outbox<T>(Arc<Inner<T>>);

#[derive(Debug)]
struct Inner<T> {
    queue: Mutex<VecDeque<T>>,
    /// A wake-up is under way: no second byte is needed.
    woken: AtomicBool,
    bell: UnixStream,
}

/// The gateway's end: what it polls and drains.
#[derive(Debug)]
pub(super) struct Inbox<T> {
    outbox: Outbox<T>,
    ear: UnixStream,
}

impl<T> Clone for Outbox<T> {
    fn clone(&self) -> Self {
        Outbox(self.0.clone())
    }
}

impl<T> Outbox<T> {
    pub fn new() -> std::io::Result<(Outbox<T>, Inbox<T>)> {
        let (bell, ear) = UnixStream::pair()?;
        bell.set_nonblocking(true)?;
        ear.set_nonblocking(true)?;
        let woken = AtomicBool::new(false);
        let queue = Mutex::new(VecDeque::new());
        let outbox = Outbox(Arc::new(Inner { queue, woken, bell }));
        Ok((outbox.clone(), Inbox { outbox, ear }))
    }

    pub fn put(&self, item: T) {
        self.0.queue.lock().unwrap_or_else(PoisonError::into_inner).push_back(item);
        self.wake();
    }

    pub fn wake(&self) {
        if !self.0.woken.swap(true, Ordering::SeqCst) {
            // A full pipe holds a wake-up already; a closed one has nobody to wake.
            let _ = (&self.0.bell).write(&[1]);
        }
    }
}

impl<T> Inbox<T> {
    pub fn fd(&self) -> RawFd {
        self.ear.as_raw_fd()
    }

    /// Takes everything that was put in.
    pub fn drain(&mut self) -> VecDeque<T> {
        let mut bytes = [0; 64];
        while matches!(self.ear.read(&mut bytes), Ok(read) if read == bytes.len()) {}
        // Cleared *before* the queue is taken: what is put in from now on rings again, and what
        // was put in before is taken below. The other way round, an item put in between would
        // neither ring nor be taken.
        self.outbox.0.woken.store(false, Ordering::SeqCst);
        std::mem::take(&mut *self.outbox.0.queue.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;

    /// Polls only when the bell has rung, as the gateway does.
    fn take_all(inbox: &mut Inbox<u32>, wanted: usize) -> Vec<u32> {
        let mut taken = Vec::new();
        while taken.len() < wanted {
            let mut items = [zmq::PollItem::from_fd(inbox.fd(), zmq::POLLIN)];
            let ready = zmq::poll(&mut items, 10_000).unwrap();
            assert_eq!(ready, 1, "a wake-up was lost after {} items", taken.len());
            taken.extend(inbox.drain());
        }
        taken
    }

    #[test]
    fn no_wake_up_is_lost_between_threads() {
        const EACH: u32 = 20_000;
        let (outbox, mut inbox) = Outbox::new().unwrap();
        let threads: Vec<_> = (0..4)
            .map(|thread| {
                let outbox = outbox.clone();
                thread::spawn(move || (0..EACH).for_each(|n| outbox.put(thread * EACH + n)))
            })
            .collect();
        let mut taken = take_all(&mut inbox, 4 * EACH as usize);
        threads.into_iter().for_each(|thread| thread.join().unwrap());
        taken.sort_unstable();
        assert!(taken.into_iter().eq(0..4 * EACH));
        assert!(inbox.drain().is_empty());
    }
}
