//! Erases a person. The directory waits until the person's requests and trainings are done, sends
//! the seat to sleep and wakes no other. Then the registrar destroys the key.

use std::time::Duration;

use super::{Directory, DirectoryEffect};
use crate::actors::presence::Presence;
use crate::ids::StreamId;

/// An erasure that is under way.
pub(super) struct Erasure<E> {
    /// What the person's seat still has to do; none if the person was asleep.
    presence: Option<Presence>,
    /// None once the key is being destroyed.
    caller: Option<E>,
    looks: u32,
}

/// The time between two looks whether the person is idle.
const LOOK: Duration = Duration::from_millis(5);
/// The most looks: 20 seconds for the requests and trainings of the person.
const LOOKS_MAX: u32 = 4_000;

impl<L, E> Directory<L, E> {
    pub(super) fn erase(&mut self, stream: StreamId, caller: E) {
        // While everybody goes to sleep, an append may still run.
        if self.stopping || self.leaving.contains_key(&stream) {
            return self.effects.push(DirectoryEffect::StillBusy { caller });
        }
        let presence = self.entries.get(&stream).map(|entry| entry.presence.clone());
        let erasure = Erasure { presence, caller: Some(caller), looks: 0 };
        self.leaving.insert(stream.clone(), erasure);
        self.look(stream);
    }

    /// Continues an erasure if the person is idle. Gives up if the person is busy for too long.
    pub(super) fn look(&mut self, stream: StreamId) {
        let Some(erasure) = self.leaving.get_mut(&stream) else { return };
        erasure.looks += 1;
        let is_idle = erasure.presence.as_ref().is_none_or(Presence::is_idle);
        if !is_idle && erasure.looks < LOOKS_MAX {
            return self.effects.push(DirectoryEffect::LookAgain { stream, after: LOOK });
        }
        let Some(caller) = erasure.caller.take() else { return };
        if !is_idle {
            self.leaving.remove(&stream);
            return self.effects.push(DirectoryEffect::StillBusy { caller });
        }
        // Removed first, so that nothing more is appended in the person's name.
        if let Some(generation) = self.generation_of(&stream) {
            self.strike_off(&stream, generation);
        }
        self.effects.push(DirectoryEffect::Erase { stream, caller });
    }
}
