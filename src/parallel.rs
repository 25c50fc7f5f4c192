//! Work on several threads with results in a fixed order.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// Told how far some work is; the work never asks it anything.
pub trait Progress: Sync {
    /// So many more pieces of work will be done.
    fn expect(&self, _count: u64) {}
    /// So many more are done.
    fn advance(&self, _count: u64) {}
}

/// Nobody watches.
impl Progress for () {}

/// `work` applied to every item, on at most `threads` threads; the results come in the order of
/// the items, whoever was faster.
pub fn in_order<T: Sync, R: Send>(
    threads: usize,
    progress: &dyn Progress,
    items: &[T],
    work: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    progress.expect(items.len() as u64);
    let next = AtomicUsize::new(0);
    let one_thread = || {
        let mut done = Vec::new();
        loop {
            let place = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(place) else { return done };
            done.push((place, work(item)));
            progress.advance(1);
        }
    };
    let mut done: Vec<(usize, R)> = thread::scope(|scope| {
        let threads = threads.clamp(1, items.len().max(1));
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(one_thread)).collect();
        let join = |worker: thread::ScopedJoinHandle<'_, Vec<(usize, R)>>| match worker.join() {
            Ok(done) => done,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        workers.into_iter().flat_map(join).collect()
    });
    done.sort_by_key(|(place, _)| *place);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_items() {
        let items: Vec<usize> = (0..500).collect();
        let doubled = in_order(3, &(), &items, |item| {
            // Early items take longer, so that threads overtake one another.
            for round in 0..(500 - item) * 20 {
                std::hint::black_box(round);
            }
            item * 2
        });
        assert_eq!(doubled, items.iter().map(|item| item * 2).collect::<Vec<_>>());
    }
}
