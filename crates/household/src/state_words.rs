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

/// Recipes that ship ask [`StateWord::opposite`] for clean, cold and hot: a word more or less in
/// these three rows changes their answers.
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
    pub fn read(word: &str) -> Option<StateWord> {
        let row = WORDS.iter().find(|(words, _)| words.contains(&word));
        row.map(|(_, state)| *state)
    }

    /// The state that contradicts the word, where a thing may also be in neither.
    pub fn opposite(self) -> Option<State> {
        match self {
            StateWord::Clean => Some(State::Dirty),
            StateWord::Cold => Some(State::Hot),
            StateWord::Hot => Some(State::Cold),
            _ => None,
        }
    }

    /// Whether the thing is so; none when nothing is known of it: a mug that is neither hot nor
    /// cold, and an open shelf, since a shelf has no door.
    pub fn holds(self, scene: &Scene, index: Index) -> Option<bool> {
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
