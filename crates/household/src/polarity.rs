use super::facts::Kind;
use super::primitives::{Action, Bound, act};
use super::scene::{Scene, State};
use super::state_words::StateWord;
use super::task::Task;
use crate::language::{Program, Step, Symbol};

/// Whether the words ask to turn on what is on, or off what is off. TOGGLE, the paper's primitive,
/// has no direction, so only the words can contradict the scene. Only a program of one TOGGLE is
/// looked at: one that toggles twice means both directions.
pub(super) fn contradiction(
    scene: &Scene,
    words: &[String],
    program: &Program,
) -> Option<(usize, String)> {
    let [step] = &program.steps[..] else { return None };
    let action @ Action::Toggle(_) = Action::read(step).ok()? else { return None };
    let wanted = wanted(words)?;
    let Bound::One(index) = act(&mut scene.clone(), &Task::free(), action).ok()? else {
        return None;
    };
    if scene.object(index).is(State::On) != wanted {
        return None;
    }
    let state = if wanted { "on" } else { "off" };
    Some((0, format!("the {} is already {state}", scene.name(index))))
}

/// `true` for on, `false` for off, none when the words do not say.
///
/// "off" counts at every place ("turn the lamp on the desk off"). "on" may also name a place
/// ("toggle the lamp on the desk"), so it counts only together with a verb that takes it.
fn wanted(words: &[String]) -> Option<bool> {
    const TAKE_ON: [&str; 10] =
        ["turn", "turns", "turning", "switch", "power", "flip", "click", "put", "get", "flick"];
    const MEAN_ON: [&str; 5] = ["activate", "start", "illuminate", "ignite", "enable"];
    const MEAN_OFF: [&str; 6] = ["off", "deactivate", "stop", "extinguish", "disable", "unlight"];
    let any = |known: &[&str]| words.iter().any(|word| known.contains(&word.as_str()));
    let (on, off) = (any(&["on"]) && any(&TAKE_ON) || any(&MEAN_ON), any(&MEAN_OFF));
    match (on, off) {
        (_, true) => Some(false),
        (true, false) => Some(true),
        (false, false) => None,
    }
}

/// Whether the thing that a TOGGLE would switch is on.
pub(super) fn is_on(scene: &Scene, step: &Step) -> bool {
    let Ok(action @ Action::Toggle(_)) = Action::read(step) else { return false };
    match act(&mut scene.clone(), &Task::free(), action) {
        Ok(Bound::One(index)) => scene.object(index).is(State::On),
        _ => false,
    }
}

/// Whether all things of a type are in the state opposite to the one that a word names. A thing may
/// be in neither ("the hot potato", when the potato is neither hot nor cold); then this is false.
pub(super) fn unlike(scene: &Scene, kind: &Symbol, word: &str) -> bool {
    let Some(opposite) = StateWord::read(word).and_then(StateWord::opposite) else {
        return false;
    };
    let Some(kind) = Kind::named(kind.as_str()) else { return false };
    let mut things = scene.of(kind).peekable();
    things.peek().is_some() && things.all(|index| scene.object(index).is(opposite))
}
