//! Verbs of carrying. They take the thing along, and never only walk.

use super::arguments::{Arguments, Filling};
use super::settings::Carrying;
use crate::language::{Grammar, Program, Step, Symbol};
use crate::world::Words;

impl<D: Words> Arguments<'_, D> {
    /// The program of a clause with a verb of carrying. It takes the thing along, and never only
    /// walks.
    ///
    /// - `operator`: the primitive that the clause is read as.
    /// - `last`: whether this is the last clause.
    /// - returns: none for a clause without such a verb.
    pub(super) fn carry(
        &self,
        carrying: &Carrying,
        operator: &Symbol,
        last: bool,
    ) -> Option<Filling> {
        let roles = &self.domain.lexicon(self.edition).roles;
        let operators = [&roles.going, &roles.taking, &roles.putting].map(Option::as_ref);
        let [Some(going), Some(taking), Some(putting)] = operators else { return None };
        let (leaves, place) = self.carries(carrying)?;
        let thing = self.fitting(taking, 0, self.types.first()?).into_iter().next()?;
        let step = |operator: &Symbol, args: Vec<Symbol>| Step { operator: operator.clone(), args };
        let in_hand = self.held.as_ref() == Some(&thing);
        let mut steps = Vec::new();
        if !in_hand {
            steps.push(step(taking, vec![thing.clone()]));
        }
        if place.is_none() && !roles.goes(operator) {
            return None;
        }
        let Some(place) = place else {
            return (!in_hand).then(|| Filling { programs: vec![Program { steps }], penalty: 0.0 });
        };
        let kinds = match self.is_pronoun(place) {
            true => self.here.as_slice(),
            false => self.types[place].as_slice(),
        };
        let goal = self.fitting(putting, 1, kinds).into_iter().find(|kind| *kind != thing);
        match goal.filter(|_| last && (leaves || !in_hand)) {
            Some(goal) => steps.push(step(putting, vec![thing, goal])),
            None => {
                let goal = kinds.iter().find(|kind| **kind != thing)?;
                steps.push(step(going, vec![goal.clone()]));
            }
        }
        Some(Filling { programs: vec![Program { steps }], penalty: 0.0 })
    }

    /// Whether the verb leaves the thing at the place, and which mention is the place; none for
    /// another verb.
    fn carries(&self, carrying: &Carrying) -> Option<(bool, Option<usize>)> {
        let grammar = Grammar {
            lists: self.lists,
            adjectives: &self.domain.lexicon(self.edition).adjectives,
        };
        let verb = grammar.main_verb(&self.clause.lifted.words)?.word;
        let leaves = carrying.leaving.contains(&verb);
        if !leaves && !carrying.keeping.contains(&verb) {
            return None;
        }
        let direct = self
            .before(0)
            .iter()
            .all(|word| self.lists.passed.contains(*word) || !self.lists.stop.contains(*word));
        let purpose = self.clause.words.windows(2).any(|two| {
            (self.lists.purposes.contains(&two[0]) && self.lists.verbs.contains(&two[1]))
                || (two[0] == "for" && two[1].ends_with("ing"))
        });
        if !direct || purpose || self.is_joined(1) {
            return None;
        }
        // "On the desk" is where the cup is taken from, "into the sink" is where it goes.
        let says_to =
            |word: &str| self.lists.destination.contains(word) || matches!(word, "into" | "onto");
        let says_in = |word: &str| self.lists.inside.contains(word) || word == "on";
        let behind = |place: usize, says: &dyn Fn(&str) -> bool| {
            let before = self.before(place);
            let Some((last, rest)) = before.split_last() else { return false };
            let aside = |word: &&str| {
                self.lists.leaving.contains(*word) || self.lists.landmarks.contains(*word)
            };
            says(last) && !rest.iter().any(|word| aside(word) || says_in(word))
        };
        let places = 1..self.types.len();
        let to = places.clone().find(|&place| behind(place, &says_to));
        let place = to.or_else(|| places.clone().find(|&place| leaves && behind(place, &says_in)));
        // "Carry the tomato with the plate to the sink" asks for more.
        let explained = |between: usize| {
            let before = self.before(between);
            let from = before.last().is_some_and(|word| {
                self.lists.leaving.contains(*word) || matches!(*word, "on" | "in" | "of")
            });
            from || self.is_landmark(between)
        };
        let more = place.is_some_and(|place| (1..place).any(|between| !explained(between)));
        (!more && (place.is_some() || self.types.len() == 1)).then_some((leaves, place))
    }
}
