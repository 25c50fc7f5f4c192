//! What the house itself does: running water cleans, a running microwave heats, a closed fridge
//! cools.

use super::facts::facts;
use super::scene::{Index, Scene, State};

impl Scene {
    /// Brings every thing's states up to date with where it is. Called after each change that can
    /// matter: a thing put somewhere, a door closed, something turned on.
    pub(super) fn settle(&mut self) {
        for index in 0..self.objects.len() as Index {
            let Some(around) = self.working_around(index) else { continue };
            let object = self.object_mut(index);
            match around {
                Working::Water => object.set(State::Dirty, false),
                Working::Heat if object.kind.pickupable() => {
                    object.set(State::Hot, true);
                    object.set(State::Cold, false);
                }
                Working::Cold if object.kind.pickupable() => {
                    object.set(State::Cold, true);
                    object.set(State::Hot, false);
                }
                Working::Heat | Working::Cold => {}
            }
        }
    }

    /// What works on the thing from around it, through whatever it is in or on.
    fn working_around(&self, index: Index) -> Option<Working> {
        self.ancestors(index).find_map(|place| {
            let object = self.object(place);
            if object.kind == facts().sink {
                return self.water_runs(place).then_some(Working::Water);
            }
            if object.kind == facts().microwave {
                return (object.is(State::On) && object.shut()).then_some(Working::Heat);
            }
            (object.kind == facts().fridge && object.shut()).then_some(Working::Cold)
        })
    }

    fn water_runs(&self, sink: Index) -> bool {
        self.of(facts().faucet).any(|faucet| {
            let faucet = self.object(faucet);
            faucet.parent == Some(sink) && faucet.is(State::On)
        })
    }
}

enum Working {
    Water,
    Heat,
    Cold,
}
