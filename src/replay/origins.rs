//! What caches are made from: form, code and recipe. A difference in any makes them stale.

use crate::events::EventKind;
use crate::ids::{Digest, StreamId};
use crate::learning::{self, Mind};
use crate::store::{Origin, Store};
use crate::world::Domain;

/// The origin of a mind of `recipe` that this code trains.
pub fn mind_origin(recipe: Digest) -> Origin {
    Origin { schema: learning::mind_schema(), code: learning::code_digest(), recipe }
}

/// The origin of a state that this code folds, of a person with `recipe`.
pub fn state_origin<D: Domain>(domain: &D, recipe: Digest) -> Origin {
    Origin { schema: state_schema(domain), code: learning::code_digest(), recipe }
}

/// Names the form and the rules of a state: another version of this crate, of a body or of the
/// world has states of its own.
fn state_schema<D: Domain>(domain: &D) -> Digest {
    let bodies: Vec<String> =
        EventKind::ALL.iter().map(|kind| kind.version().to_string()).collect();
    let text = format!(
        "apprentice {} · bodies {} · {} {}",
        env!("CARGO_PKG_VERSION"),
        bodies.join(","),
        domain.id(),
        domain.version(),
    );
    Digest::of(text.as_bytes())
}

/// Keeps a mind's bytes for the person of `stream`, so that waking need not train it.
///
/// - errors: a sentence for the operator; failing costs time only.
pub fn keep_mind(store: &Store, stream: &StreamId, mind: &Mind) -> Result<(), String> {
    store.models.put(stream, &mind_origin(mind.recipe()), mind.digest(), &mind.to_bytes())
}
