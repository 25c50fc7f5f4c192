use std::collections::BTreeMap;

use crate::ids::TenantId;
use crate::invariants::Invariant;

/// Room that tenants share, none of whom may take what others need: a tenant may take as much as
/// it leaves free. One alone gets `most`, which is half of what there is; of two that want all,
/// each gets a third of it, and so on; so there is always some for one more.
#[derive(Debug)]
pub struct Room {
    most: usize,
    total: usize,
    held: BTreeMap<TenantId, usize>,
}

impl Room {
    pub fn new(most: usize) -> Room {
        Room { most, total: 0, held: BTreeMap::new() }
    }

    /// Takes `amount` for a tenant.
    ///
    /// - returns: whether it was there.
    pub fn take(&mut self, tenant: &TenantId, amount: usize) -> bool {
        let held = self.held_by(tenant).saturating_add(amount);
        let total = self.total.saturating_add(amount);
        if held > self.most.saturating_mul(2).saturating_sub(total) {
            return false;
        }
        self.total = total;
        self.held.insert(tenant.clone(), held);
        true
    }

    /// Gives back what was taken.
    ///
    /// - panics: with assertions on, when less was taken; the room would then have no bound.
    pub fn give_back(&mut self, tenant: &TenantId, amount: usize) {
        let (law, held) = (Invariant::Bounded, self.held_by(tenant));
        debug_assert!(amount <= held, "{law}: {tenant} gives back {amount} of {held}");
        self.total = self.total.saturating_sub(amount);
        if let Some(held) = self.held.get_mut(tenant) {
            *held = held.saturating_sub(amount);
            if *held == 0 {
                self.held.remove(tenant);
            }
        }
    }

    /// What a tenant may still take, as things stand.
    pub fn free_for(&self, tenant: &TenantId) -> usize {
        // Twice: what it takes is no longer free.
        let most = self.most.saturating_mul(2).saturating_sub(self.total);
        most.saturating_sub(self.held_by(tenant)) / 2
    }

    pub fn held_by(&self, tenant: &TenantId) -> usize {
        self.held.get(tenant).copied().unwrap_or(0)
    }

    pub fn total(&self) -> usize {
        self.total
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn tenant(number: usize) -> TenantId {
        TenantId::new(&format!("lab-{number}")).unwrap()
    }

    fn fill(room: &mut Room, lab: usize) -> usize {
        (0..).take_while(|_| room.take(&tenant(lab), 1)).count()
    }

    #[test]
    fn one_alone_gets_the_most_and_there_is_some_for_the_next() {
        let mut room = Room::new(600);
        assert_eq!(fill(&mut room, 0), 600);
        assert_eq!(fill(&mut room, 1), 300);
        assert_eq!(fill(&mut room, 2), 150);
        // Who has more than a fair share takes no more until it is given back.
        room.give_back(&tenant(0), 150);
        assert_eq!((fill(&mut room, 0), fill(&mut room, 1)), (0, 0));
        assert_eq!((room.total(), room.held_by(&tenant(0))), (900, 450));
    }

    #[test]
    fn a_large_piece_is_taken_whole_or_not_at_all() {
        let mut room = Room::new(64);
        assert!(room.take(&tenant(0), 60) && !room.take(&tenant(0), 8));
        assert!(room.take(&tenant(1), 8) && room.take(&tenant(1), 8));
        room.give_back(&tenant(0), 60);
        assert_eq!(room.total(), 16);
    }

    #[cfg(debug_assertions)]
    #[test]
    #[should_panic(expected = "Bounded")]
    fn more_than_was_taken_is_not_given_back() {
        let mut room = Room::new(64);
        assert!(room.take(&tenant(0), 2) && room.take(&tenant(1), 8));
        room.give_back(&tenant(0), 3);
    }

    #[test]
    fn what_is_free_can_be_taken_and_one_more_cannot() {
        let mut room = Room::new(64);
        assert!(room.take(&tenant(0), 20) && room.take(&tenant(1), 7));
        for lab in 0..3 {
            let free = room.free_for(&tenant(lab));
            assert!(!room.take(&tenant(lab), free + 1), "lab {lab} may take {free}");
            assert!(room.take(&tenant(lab), free));
            room.give_back(&tenant(lab), free);
        }
    }

    proptest! {
        /// However others filled it, whoever holds nothing gets at least one piece while fewer
        /// tenants than pieces are about, and what is given back is there again.
        #[test]
        fn there_is_always_some_for_one_more(takes in prop::collection::vec((0usize..8, 1usize..9), 0..500)) {
            let mut room = Room::new(1_024);
            let mut taken = Vec::new();
            for (lab, amount) in takes {
                if room.take(&tenant(lab), amount) {
                    taken.push((lab, amount));
                }
                prop_assert!(room.held_by(&tenant(lab)) <= 1_024);
            }
            prop_assert!(room.take(&tenant(99), 1));
            room.give_back(&tenant(99), 1);
            taken.into_iter().for_each(|(lab, amount)| room.give_back(&tenant(lab), amount));
            prop_assert_eq!((room.total(), room.held.len()), (0, 0));
        }
    }
}
