//! A state as bytes, for its digest, and a session that goes on from a state.

use std::sync::Arc;

use super::state::State;
use super::{Session, parse_recipe};
use crate::ids::Digest;
use crate::world::World;

impl<D: World> Session<D> {
    /// Goes on from a state that `apply` made; the mind is to be [installed](Session::install)
    /// afterwards.
    pub fn resume(domain: Arc<D>, state: State<D::Scene, D::Task>) -> Session<D> {
        let recipe = parse_recipe(&state);
        Session { domain, state, recipe, mind: None }
    }

    /// BLAKE3 over the state as MessagePack with field names: equal states have equal digests.
    ///
    /// The last act is left out. Releases 0.1 and 0.2 knew none, and their digests stay.
    pub fn state_digest(&self) -> Digest {
        let mut state = self.state.clone();
        if let Some(episode) = &mut state.episode {
            episode.last_act = None;
        }
        let bytes = rmp_serde::to_vec_named(&state);
        Digest::of(&bytes.expect("a state is plain data and encodes into memory"))
    }
}
