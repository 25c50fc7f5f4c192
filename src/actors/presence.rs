use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Counts what one person's seat still has to do: requests that are not answered and trainings that
/// have not ended. A person is put to sleep only when there is nothing left.
#[derive(Debug, Clone, Default)]
pub struct Presence(Arc<AtomicUsize>);

impl Presence {
    /// Counts one thing more.
    pub fn attend(&self) -> Attention {
        self.0.fetch_add(1, Ordering::SeqCst);
        Attention(self.0.clone())
    }

    /// True if there is nothing to do.
    pub fn is_idle(&self) -> bool {
        self.0.load(Ordering::SeqCst) == 0
    }
}

/// One thing that a person's seat has to do. It counts until it is dropped.
#[derive(Debug)]
pub struct Attention(Arc<AtomicUsize>);

impl Drop for Attention {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

#[cfg(test)]
mod tests {
    use super::super::AnswerTo;
    use super::*;
    use crate::client::Response;

    #[test]
    fn a_person_is_idle_when_every_answer_is_out() {
        let presence = Presence::default();
        let mut answer = AnswerTo::new(|_| {});
        answer.hold(presence.attend());
        let training = presence.attend();
        answer.send(Response::Known(Vec::new()));
        assert!(!presence.is_idle());
        drop(training);
        assert!(presence.is_idle());
    }
}
