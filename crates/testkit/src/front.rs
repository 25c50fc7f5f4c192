//! Submits requests as a gateway does.

use apprentice::actors::{AnswerTo, Front, Submit};
use apprentice::client::{Ask, ServiceAsk};
use apprentice::ids::{RequestId, TenantId, UserId};

/// Counts a request for its tenant's quotas and submits it.
pub fn hand_in(
    front: &Front,
    (tenant, user): (TenantId, UserId),
    request: RequestId,
    ask: Ask,
    mut answer: AnswerTo,
) {
    if let Err(refused) = front.let_in(&tenant, &ask, &mut answer) {
        return answer.send(*refused);
    }
    let taken = match ask {
        Ask::Person(ask) => front.submit(Submit { tenant, user, request, ask, answer }),
        Ask::Archive(ask) => front.ask_archive(tenant, ask, answer),
        Ask::Service(ServiceAsk::Hello) => front.greet(answer),
        other => panic!("a gateway answers {other:?}"),
    };
    assert!(taken.is_ok(), "the queue is not full");
}
