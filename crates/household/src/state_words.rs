//! The words that say which state a thing is in: "dirty", "chilled", "shut".

use super::scene::{Index, Scene, State};

/// What a state word says of a thing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StateWord {
    Dirty,
    Clean,
    Hot,
    Cold,
    Open,
    Closed,
    On,
    Off,
    Empty,
    Full,
}

/// The words of each state. Released recipes use [`StateWord::opposite`] of clean, cold and hot, so
/// a change in these three rows would change their answers.
const WORDS: [(&[&str], StateWord); 10] = [
    (&["clean", "cleaned", "washed", "rinsed"], StateWord::Clean),
    (&["cold", "chilled", "cooled"], StateWord::Cold),
    (&["hot", "heated", "warm", "warmed"], StateWord::Hot),
    (&["dirty", "unwashed", "unclean"], StateWord::Dirty),
    (&["open", "opened"], StateWord::Open),
    (&["closed", "shut"], StateWord::Closed),
    (&["on", "lit", "running"], StateWord::On),
    (&["off", "unlit"], StateWord::Off),
    (&["empty", "emptied"], StateWord::Empty),
    (&["full", "filled"], StateWord::Full),
];

impl StateWord {
    /// The state that a word names; none for other words.
    pub(crate) fn read(word: &str) -> Option<StateWord> {
        let row = WORDS.iter().find(|(words, _)| words.contains(&word));
        row.map(|(_, state)| *state)
    }

    /// The state that contradicts the word, for words that released recipes ask about.
    pub(crate) fn opposite(self) -> Option<State> {
        match self {
            StateWord::Clean => Some(State::Dirty),
            StateWord::Cold => Some(State::Hot),
            StateWord::Hot => Some(State::Cold),
            _ => None,
        }
    }

    /// Whether the thing is in the state; none when that is not known: for "hot" and a mug that is
    /// neither hot nor cold, for "open" and a shelf, which has no door.
    pub(crate) fn holds(self, scene: &Scene, index: Index) -> Option<bool> {
        let object = scene.object(index);
        let kind = object.kind;
        let is = |state: State| object.is(state);
        match self {
            StateWord::Dirty => Some(is(State::Dirty)),
            StateWord::Clean => Some(!is(State::Dirty)),
            StateWord::Hot => either(is(State::Hot), is(State::Cold)),
            StateWord::Cold => either(is(State::Cold), is(State::Hot)),
            StateWord::Open => kind.openable().then(|| is(State::Open)),
            StateWord::Closed => kind.openable().then(|| object.shut()),
            StateWord::On => kind.toggleable().then(|| is(State::On)),
            StateWord::Off => kind.toggleable().then(|| !is(State::On)),
            StateWord::Empty => kind.receptacle().then(|| !is_filled(scene, index)),
            StateWord::Full => kind.receptacle().then(|| is_filled(scene, index)),
        }
    }
}

fn either(so: bool, opposite: bool) -> Option<bool> {
    (so || opposite).then_some(so)
}

/// Whether something that can be carried is in or on it: a faucet does not fill its sink.
fn is_filled(scene: &Scene, index: Index) -> bool {
    scene.objects.iter().any(|object| object.parent == Some(index) && object.kind.pickupable())
}
