use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// How much one person's seat has to do: requests not yet answered and trainings not yet ended.
/// Nobody with something to do is put to sleep.
#[derive(Debug, Clone, Default)]
pub struct Presence(Arc<AtomicUsize>);

impl Presence {
    pub fn attend(&self) -> Attention {
        self.0.fetch_add(1, Ordering::SeqCst);
        Attention(self.0.clone())
    }

    pub fn is_idle(&self) -> bool {
        self.0.load(Ordering::SeqCst) == 0
    }
}

/// One thing that a person's seat has to do. Ends when dropped.
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
