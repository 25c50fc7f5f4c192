use std::fmt;

use actix::Message;

use super::meters::InFlight;
use super::presence::Attention;
use crate::client::{PersonAsk, Response};
use crate::ids::{RequestId, StreamId, TenantId, UserId};
use crate::invariants::Invariant;

/// One request for a person.
#[derive(Debug, Message)]
#[rtype(result = "()")]
pub struct Submit {
    /// From the endpoint and the key of the connection, never from the request (invariant
    /// `TenantWall`).
    pub tenant: TenantId,
    /// The person.
    pub user: UserId,
    /// The id of the request.
    pub request: RequestId,
    /// What is asked.
    pub ask: PersonAsk,
    /// Where the answer goes.
    pub answer: AnswerTo,
}

impl Submit {
    /// - panics: when it came from another tenant than the one of `stream`.
    pub(super) fn must_be_for(&self, stream: &StreamId) {
        let law = Invariant::TenantWall;
        assert_eq!(self.tenant, stream.tenant, "{law}: a request is for its own tenant's people");
    }
}

/// Sends the answer to the caller, exactly once. If it is dropped without an answer, because an
/// actor stopped or panicked, the caller is told to ask again. It is always safe to ask again with
/// the same request id (invariant `ExactlyOnce`).
pub struct AnswerTo {
    way: Option<Box<dyn FnOnce(Response) + Send>>,
    /// Keeps the person awake until there is an answer.
    awake: Option<Attention>,
    /// Counts the request among those in flight.
    in_flight: Option<InFlight>,
}

/// Milliseconds after which a request that was lost inside the service may be sent again: time
/// enough for a new actor to start, and too short to be noticed.
const RETRY_LOST_MS: u32 = 50;

impl AnswerTo {
    /// - `way`: called with the answer, on any thread.
    pub fn new(way: impl FnOnce(Response) + Send + 'static) -> AnswerTo {
        AnswerTo { way: Some(Box::new(way)), awake: None, in_flight: None }
    }

    /// Sends the answer.
    pub fn send(mut self, response: Response) {
        // Before the answer is sent: the caller may at once ask for another person, who needs the
        // place of this one. The actor still ends its present message before it goes to sleep.
        self.awake = None;
        self.in_flight = None;
        let law = Invariant::AnsweredOnce;
        let way = self.way.take().unwrap_or_else(|| panic!("{law}: nobody waits for this answer"));
        way(response);
    }

    pub(super) fn let_in(&mut self, in_flight: InFlight) {
        self.in_flight = Some(in_flight);
    }

    pub(super) fn hold(&mut self, attention: Attention) {
        self.awake = Some(attention);
    }
}

impl Drop for AnswerTo {
    fn drop(&mut self) {
        self.in_flight = None;
        if let Some(way) = self.way.take() {
            way(Response::busy("the request was interrupted; send it again", RETRY_LOST_MS));
        }
    }
}

impl fmt::Debug for AnswerTo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("AnswerTo(..)")
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;
    use crate::client::Query;

    #[test]
    fn a_dropped_request_is_answered_with_busy() {
        let (sender, receiver) = mpsc::channel();
        drop(AnswerTo::new(move |response| sender.send(response).unwrap()));
        assert!(matches!(receiver.recv().unwrap(), Response::Busy(_)));
        assert!(receiver.recv().is_err(), "one answer and no more");
    }

    #[test]
    fn an_answered_request_is_answered_once() {
        let (sender, receiver) = mpsc::channel();
        AnswerTo::new(move |response| sender.send(response).unwrap())
            .send(Response::Known(Vec::new()));
        assert_eq!(receiver.recv().unwrap(), Response::Known(Vec::new()));
        assert!(receiver.recv().is_err(), "one answer and no more");
    }

    #[test]
    #[should_panic(expected = "AnsweredOnce")]
    fn a_second_answer_has_no_way() {
        let mut answer = AnswerTo::new(drop);
        answer.way = None;
        answer.send(Response::Known(Vec::new()));
    }

    #[test]
    #[should_panic(expected = "TenantWall")]
    fn a_request_that_reaches_another_tenants_seat_is_a_defect() {
        let [here, there] = ["here", "there"].map(|name| TenantId::new(name).unwrap());
        let submit = Submit {
            tenant: here,
            user: UserId::new("ada").unwrap(),
            request: RequestId([1; 16]),
            ask: PersonAsk::Query(Query::Status),
            answer: AnswerTo::new(drop),
        };
        submit.must_be_for(&StreamId::of_tenant(&there));
    }
}
