use std::panic::{AssertUnwindSafe, catch_unwind};

use super::NewSession;
use crate::actors::defect::defect;
use crate::client::{Query, Rejected, RejectionCode, Response, Status};
use crate::session::Session;
use crate::world::Domain;

/// Answers a query.
///
/// - errors: the answer if the session panicked. Then the session must not be used again.
pub(super) fn answer<D: Domain>(
    new: &NewSession,
    session: &Session<D>,
    query: Query,
) -> Result<Response, Box<Response>> {
    catch_unwind(AssertUnwindSafe(|| match query {
        Query::Status => Response::Status(status(new, session)),
        Query::Known if !session.is_open() => Response::Known(session.known_before(&new.base)),
        Query::Known => Response::Known(session.known()),
        Query::Look => match session.look() {
            Some(view) => Response::Look(view),
            None => Response::Rejected(Rejected {
                code: RejectionCode::WrongPhase,
                message: "there is nothing to see before the first episode; start one".to_owned(),
            }),
        },
    }))
    .map_err(|panic| Box::new(defect("looking", &*panic)))
}

/// The status of a person. For a new person: what the session would start with.
pub(super) fn status<D: Domain>(new: &NewSession, session: &Session<D>) -> Status {
    match session.is_open() {
        true => session.status(),
        false => session.status_before(&new.recipe, &new.base),
    }
}
