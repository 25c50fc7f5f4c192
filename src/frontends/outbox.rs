use std::collections::VecDeque;
use std::io::{Read, Write};
use std::os::fd::{AsRawFd, RawFd};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// A queue of answers from the actors to the gateway's thread, which it wakes. Only that thread may
/// use the sockets. The queue is bounded by the number of requests in flight, because each request
/// puts exactly one answer into it.
#[derive(Debug)]
pub(super) struct Outbox<T>(Arc<Inner<T>>);

#[derive(Debug)]
struct Inner<T> {
    queue: Mutex<VecDeque<T>>,
    /// A byte to wake the reader was written and not read yet.
    woken: AtomicBool,
    /// A byte in it wakes the reader.
    bell: UnixStream,
}

/// The reader's end of an [`Outbox`], which it polls and drains.
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
            // A full pipe wakes the reader already. A closed pipe has no reader.
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
        // Cleared *before* the queue is taken: a later item wakes the reader again, and an earlier
        // item is taken below. In the other order, an item put in between would do neither.
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
