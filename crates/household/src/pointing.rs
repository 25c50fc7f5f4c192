//! Which instance of a kind the words mean: "mug 2", "the other mug", "the dirty one on the table".

use super::facts::Kind;
use super::refusal::preposition;
use super::scene::{Index, Scene};
use super::state_words::StateWord;
use crate::language::Symbol;
use crate::world::Pointing;

/// The instance that the words choose; none when they choose nothing, or when all of several fit.
///
/// A thing that is known to fit comes first, then one of which nothing is known. Of several, the
/// nearest in sight is taken.
///
/// - errors: a sentence, when no instance is as the words say.
pub(super) fn choose(
    scene: &Scene,
    kind: &Symbol,
    pointing: &Pointing,
) -> Result<Option<String>, String> {
    if !points(pointing) {
        return Ok(None);
    }
    let mut choice = Choice::among(scene, kind)?;
    if let Some(number) = pointing.number {
        choice.number(number)?;
    }
    let several = scene.of(choice.kind).count() > 1;
    if let Some(ordinal) = pointing.ordinal.filter(|_| several || !choice.kind.comes_several()) {
        choice.number(ordinal)?;
    }
    if pointing.same && several {
        choice.same(&choice.handled(pointing))?;
    }
    if pointing.other {
        choice.other(&choice.handled(pointing))?;
    }
    let known_place = |p: &&Vec<Symbol>| (several || pointing.strictly) && is_here(scene, p);
    // The words about a place are ignored when there is only one such thing, or when the scene has
    // no such place: people name places as they see them.
    if let Some(places) = pointing.place.as_ref().filter(|p| known_place(p)) {
        choice.place(places)?;
    }
    if pointing.here {
        choice.narrow("in reach", |index| Some(scene.in_reach(index)))?;
    }
    // Each state once: an utterance may repeat it many times.
    let mut asked: Vec<StateWord> = Vec::new();
    for word in &pointing.words {
        let Some(state) = StateWord::read(word).filter(|state| !asked.contains(state)) else {
            continue;
        };
        let known = |holds: Option<bool>| holds.or(pointing.strictly.then_some(false));
        choice.narrow(word, |index| known(state.holds(scene, index)))?;
        asked.push(state);
    }
    // Last of those that fit: "the last mug on the table" is on the table.
    if pointing.last_of_all {
        choice.last();
    }
    Ok(choice.result())
}

/// Whether any of the words chooses between instances.
fn points(pointing: &Pointing) -> bool {
    pointing.number.is_some()
        || pointing.ordinal.is_some()
        || pointing.last_of_all
        || pointing.here
        || pointing.other
        || pointing.same
        || pointing.place.as_ref().is_some_and(|places| !places.is_empty())
        || pointing.words.iter().any(|word| StateWord::read(word).is_some())
}

/// Whether a thing of one of these types is in the scene.
fn is_here(scene: &Scene, kinds: &[Symbol]) -> bool {
    let mut kinds = kinds.iter().filter_map(|kind| Kind::named(kind.as_str()));
    kinds.any(|kind| scene.of(kind).next().is_some())
}

struct Choice<'a> {
    scene: &'a Scene,
    kind: Kind,
    /// In the view's order, never empty.
    left: Vec<Index>,
    /// Whether words singled out one of the things, even if it is the only one.
    named: bool,
    /// `Mug`, or `other Mug`.
    noun: String,
    /// What is true of all that are left: `dirty`, `on the DiningTable`.
    said: Vec<String>,
}

impl<'a> Choice<'a> {
    /// All things of the kind.
    ///
    /// - errors: there is none.
    fn among(scene: &'a Scene, symbol: &Symbol) -> Result<Choice<'a>, String> {
        let none = || {
            let short: String = symbol.as_str().chars().take(40).collect();
            format!("there is no {short} here")
        };
        let kind = Kind::named(symbol.as_str()).ok_or_else(none)?;
        let left: Vec<Index> = scene.of(kind).collect();
        match left.is_empty() {
            true => Err(none()),
            false => Ok(Choice {
                scene,
                kind,
                left,
                named: false,
                noun: kind.to_string(),
                said: Vec::new(),
            }),
        }
    }

    /// The one that the view gives this number.
    fn number(&mut self, number: u32) -> Result<(), String> {
        let place = number.checked_sub(1).and_then(|place| usize::try_from(place).ok());
        let found = place.and_then(|place| self.left.get(place).copied());
        self.named = true;
        match (found, self.left.len()) {
            (Some(index), _) => self.left = vec![index],
            (None, 1) if number > 1 => return Err(self.only_one()),
            (None, _) => return Err(format!("there is no {} {number} here", self.kind)),
        }
        Ok(())
    }

    /// The things of the kind that were handled, newest first. The thing in the hand counts as
    /// handled, even if it was there at the start.
    fn handled(&self, pointing: &Pointing) -> Vec<Index> {
        let named = pointing.handled.iter().filter_map(|name| self.scene.named(name));
        let all = named.chain(self.scene.robot.holds);
        all.filter(|&index| self.scene.object(index).kind == self.kind).collect()
    }

    fn same(&mut self, handled: &[Index]) -> Result<(), String> {
        let Some(newest) = handled.first() else {
            return Err(format!("which {0}: no {0} was handled before", self.kind));
        };
        if !self.left.contains(newest) {
            let (same, said) = (self.name(*newest), self.name(self.left[0]));
            return Err(format!("the same {} is the {same}, not the {said}", self.kind));
        }
        self.left = vec![*newest];
        self.named = true;
        Ok(())
    }

    /// One that was not handled; when all were, one that was not the last.
    fn other(&mut self, handled: &[Index]) -> Result<(), String> {
        let only = self.scene.of(self.kind).count() == 1;
        let Some(newest) = handled.first() else {
            return Err(match only {
                true => self.only_one(),
                false => format!("which other {0}: no {0} was handled before", self.kind),
            });
        };
        let fresh = self.left.iter().any(|index| !handled.contains(index));
        self.left.retain(|index| match fresh {
            true => !handled.contains(index),
            false => index != newest,
        });
        self.named = true;
        self.noun = format!("other {}", self.kind);
        match self.left.is_empty() {
            true => Err(format!("there is no {} here", self.noun)),
            false => Ok(()),
        }
    }

    /// In or on a thing of one of the types, through whatever is between; right in or on it first.
    /// Of what stands on the floor or along a wall, nothing is known.
    fn place(&mut self, places: &[Symbol]) -> Result<(), String> {
        let (scene, kind) = (self.scene, self.kind);
        let kinds: Vec<Kind> =
            places.iter().filter_map(|name| Kind::named(name.as_str())).collect();
        let is_place = |index: Index| kinds.contains(&scene.object(index).kind);
        let inside = |index: Index| match scene.object(index).parent {
            None if !kind.pickupable() => None,
            _ => Some(scene.ancestors(index).any(is_place)),
        };
        let Some(named) = kinds.iter().find(|kind| scene.of(**kind).next().is_some()) else {
            return match (places.first(), self.left.iter().all(|&index| inside(index).is_none())) {
                (None, _) | (_, true) => Ok(()),
                (Some(place), false) => {
                    let short: String = place.as_str().chars().take(40).collect();
                    Err(format!("there is no {short} here"))
                }
            };
        };
        self.narrow(&format!("{} the {named}", preposition(*named)), inside)?;
        let right_there = |index: &Index| scene.object(*index).parent.is_some_and(is_place);
        if self.left.iter().any(right_there) {
            self.left.retain(right_there);
        }
        Ok(())
    }

    /// Keeps what is so; when nothing is known to be, what may be.
    ///
    /// - `what`: completes "the mug is …".
    /// - errors: none is so.
    fn narrow(&mut self, what: &str, fits: impl Fn(Index) -> Option<bool>) -> Result<(), String> {
        let those = |wanted: Option<bool>| -> Vec<Index> {
            self.left.iter().copied().filter(|&index| fits(index) == wanted).collect()
        };
        let (so, unknown) = (those(Some(true)), those(None));
        if so.is_empty() && unknown.is_empty() {
            return Err(self.none_is(what));
        }
        if so.is_empty() {
            self.left = unknown;
        } else {
            self.left = so;
            self.said.push(what.to_owned());
        }
        Ok(())
    }

    fn last(&mut self) {
        self.left.drain(..self.left.len() - 1);
        self.named = true;
    }

    fn result(&self) -> Option<String> {
        let all = self.scene.of(self.kind).count();
        let only = all == 1 && !self.said.is_empty();
        // Words that are true of all leave the choice to the step, which knows what can be used.
        if !self.named && !only && self.left.len() == all {
            return None;
        }
        let away = |index: Index| self.scene.shut_in(index).is_some();
        let nearest =
            self.left.iter().min_by_key(|&&index| (away(index), self.scene.distance(index)));
        nearest.map(|&index| self.name(index))
    }

    fn name(&self, index: Index) -> String {
        self.scene.name(index)
    }

    fn only_one(&self) -> String {
        format!("there is only one {} here", self.kind)
    }

    fn none_is(&self, what: &str) -> String {
        match (&self.left[..], &self.said[..]) {
            (&[index], said) if self.named || !said.is_empty() => {
                format!("the {} is not {what}", self.name(index))
            }
            (_, []) if what.contains(' ') => format!("there is no {} {what}", self.noun),
            (_, []) => format!("no {} here is {what}", self.noun),
            (_, said) => format!("no {} that is {} is {what}", self.noun, said.join(" and ")),
        }
    }
}
