use std::collections::BTreeSet;

use super::settings::Accounting;
use crate::language::{
    Clause, Grammar, LiftedArg, LiftedProgram, Mention, Program, Roles, Step, Symbol, Word,
    WordLists,
};
use crate::world::{Edition, Words};

/// Chooses the things that fill the slots of an open program: the first mention, in the order of
/// the words, of a type that the operator can ever act on.
///
/// A name that could be the argument is never skipped, even if the scene has no such thing: "take
/// the spatula from the plate" without a spatula is not about the plate.
pub(super) struct Arguments<'a, D: Words> {
    /// The world.
    pub domain: &'a D,
    /// The recipe's lists.
    pub lists: &'a WordLists,
    /// The words.
    pub clause: &'a Clause,
    /// Per mention the types it may mean here, best first.
    pub types: &'a [Vec<Symbol>],
    /// What is in the hand.
    pub held: Option<Symbol>,
    /// What the robot stands at.
    pub here: Option<Symbol>,
    /// What was named last before this clause.
    pub last: Option<&'a Symbol>,
    /// The types of what was acted on, newest first.
    pub recent: Vec<Symbol>,
    /// Per mention whether nothing of its likeliest type is in the scene.
    pub absent: Vec<bool>,
    /// What needs no use, if words are accounted for. If so, each of several things named side by
    /// side gets the operator, and a pronoun means a thing that the operator can work on.
    pub accounting: Option<&'a Accounting>,
    /// Of the world's words.
    pub edition: Edition,
}

/// A way to fill an open program.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Filling {
    /// In the order to be tried. They differ in types that share a name.
    pub programs: Vec<Program>,
    /// How far the choice is from the obvious one; 0 is obvious.
    pub penalty: f32,
}

impl<D: Words> Arguments<'_, D> {
    /// Whether words are accounted for.
    pub(super) fn accounts(&self) -> bool {
        self.accounting.is_some()
    }

    /// - returns: `None` when the words leave a slot open.
    pub(super) fn fill(&self, program: &LiftedProgram) -> Option<Filling> {
        let roles = &self.domain.lexicon(self.edition).roles;
        let slot = |arg: &LiftedArg| matches!(arg, LiftedArg::Slot { .. });
        match program.steps.as_slice() {
            [step] if step.args.iter().all(slot) => match step.args.len() {
                1 => self.one(roles, &step.operator),
                2 if roles.puts(&step.operator) => self.put(&step.operator),
                _ => self.in_turn(roles, program),
            },
            _ => self.each_in_turn(program).or_else(|| self.in_turn(roles, program)),
        }
    }

    /// Applies a lesson about one thing to several things named side by side: "wash the apple and
    /// the plate".
    fn each_in_turn(&self, program: &LiftedProgram) -> Option<Filling> {
        if !self.accounts() || program.slots() != 1 || !self.is_next_to(1) {
            return None;
        }
        let joined = (1..self.types.len()).take_while(|&place| self.is_next_to(place)).count();
        let kinds = self.types[..=joined].iter().map(|kinds| kinds.first().cloned());
        let each = kinds.map(|kind| program.fill(&[kind?], self.held.as_ref()));
        let programs: Vec<Program> = each.collect::<Option<_>>()?;
        let steps = programs.into_iter().flat_map(|program| program.steps).collect();
        Some(Filling { programs: vec![Program { steps }], penalty: 0.0 })
    }

    fn one(&self, roles: &Roles, operator: &Symbol) -> Option<Filling> {
        if roles.goes(operator) {
            return self.goal(operator);
        }
        let named = self.types.len();
        let works = !roles.takes(operator) && !roles.is_door(operator);
        for (place, kinds) in self.types.iter().enumerate() {
            let fitting = self.fitting(operator, 0, kinds);
            if !fitting.is_empty() {
                // "Take the mug to the sink" and "turn to the stove" are ways.
                let way = if roles.takes(operator) { place + 1 } else { place };
                if (works || roles.takes(operator)) && self.is_way_to(way) {
                    return None;
                }
                // One hand cannot take two things.
                let another = || {
                    self.types
                        .get(place + 1)
                        .is_some_and(|kinds| !self.fitting(operator, 0, kinds).is_empty())
                };
                if roles.takes(operator) && self.is_joined(place + 1) && another() {
                    return None;
                }
                // "Pick up the … next to the mug": the object has no known name.
                if self.accounts() && roles.takes(operator) && self.is_landmark(place) {
                    return None;
                }
                if self.accounts() && self.is_next_to(place + 1) {
                    return self.side_by_side(operator, place);
                }
                return Some(filling(operator, fitting, place as f32));
            }
            if (roles.is_door(operator) || (self.accounts() && works)) && self.is_pronoun(place) {
                let mut here = self.fitting(operator, 0, self.here.as_slice());
                if self.accounts() {
                    here.extend(self.fitting(operator, 0, &self.recent));
                }
                return Some(filling(operator, here, place as f32))
                    .filter(|f| !f.programs.is_empty());
            }
            if roles.takes(operator) && self.names_unknown() {
                return None;
            }
        }
        if named > 0 {
            return None;
        }
        let (unnamed, penalty) = match () {
            () if roles.is_door(operator) => (self.here.as_ref(), 0.0),
            () if roles.takes(operator) && !self.names_unknown() => (self.last, 1.0),
            () => (None, 0.0),
        };
        let fitting = self.fitting(operator, 0, unnamed.cloned().as_slice());
        Some(filling(operator, fitting, penalty)).filter(|f| !f.programs.is_empty())
    }

    /// "Open the fridge and the microwave": a step for each.
    fn side_by_side(&self, operator: &Symbol, first: usize) -> Option<Filling> {
        let joined = (first + 1..self.types.len()).take_while(|&place| self.is_next_to(place));
        let kinds = std::iter::once(first)
            .chain(joined)
            .map(|place| self.fitting(operator, 0, &self.types[place]).into_iter().next());
        let kinds: Vec<Symbol> = kinds.collect::<Option<_>>()?;
        let step = |kind: Symbol| Step { operator: operator.clone(), args: vec![kind] };
        let steps = kinds.into_iter().map(step).collect();
        Some(Filling { programs: vec![Program { steps }], penalty: first as f32 })
    }

    /// Whether a mention is named side by side with the one before it.
    pub(super) fn is_next_to(&self, place: usize) -> bool {
        place < self.types.len() && self.is_side_by_side(place, &self.between(place))
    }

    /// Whether a mention is joined to the one before it, with a mark or a joining word.
    pub(super) fn is_side_by_side(&self, place: usize, before: &[&str]) -> bool {
        place > 0
            && (before.is_empty()
                || before.iter().all(|word| {
                    self.lists.cuts.contains(*word) || self.lists.adverbs.contains(*word)
                }))
    }

    /// Whether only a verb and its particles are before a mention.
    pub(super) fn is_object(&self, place: usize, before: &[&str]) -> bool {
        let aside = |word: &&str| {
            self.lists.passed.contains(*word)
                || self.lists.verb_particles.contains(*word)
                || self.lists.adverbs.contains(*word)
                || self.lists.cuts.contains(*word)
        };
        let verb =
            |word: &&str| self.lists.verbs.contains(*word) || self.lists.noun_verbs.contains(*word);
        // "The bowl with the sliced tomato": after a preposition it says where or how.
        if before.iter().any(|word| self.lists.stop.contains(*word) && !aside(word)) {
            return false;
        }
        let last = before.iter().rev().find(|word| !aside(word));
        last.is_some_and(|word| place == 0 || verb(word))
    }

    /// The first mention that something goes "to", else the first.
    fn goal(&self, operator: &Symbol) -> Option<Filling> {
        let mut order: Vec<(bool, usize)> = Vec::new();
        let mut lost = false;
        for place in 0..=self.types.len() {
            let before = self.before(place);
            lost |= self.unknown_way(&before);
            if place == self.types.len() {
                break;
            }
            let directed = before.iter().any(|word| self.lists.toward.contains(*word));
            if directed && before.iter().any(|word| self.lists.wherever.contains(*word)) {
                // "Back to where the potato is": the place, not the potato.
                return None;
            }
            if !before.last().is_some_and(|word| self.lists.leaving.contains(*word)) {
                order.push((!directed, place));
            }
        }
        order.sort_unstable();
        // "To the dishwasher", which is unknown, does not mean another thing that was named.
        if lost && order.first().is_some_and(|(aimless, _)| *aimless) {
            return None;
        }
        let alone = self.types.len() == 1;
        let first = order.first().map(|(_, place)| *place);
        let several = |first: &usize| self.is_next_to(first + 1) && !self.is_landmark(*first);
        if let Some(first) = first.filter(|first| self.accounts() && several(first)) {
            return self.side_by_side(operator, first);
        }
        order.into_iter().find_map(|(_, place)| {
            let kinds = self.types.get(place)?.iter();
            let kinds: Vec<Symbol> =
                kinds.filter(|kind| alone || self.held.as_ref() != Some(kind)).cloned().collect();
            Some(filling(operator, kinds, 0.0)).filter(|filling| !filling.programs.is_empty())
        })
    }

    /// Puts the thing in the hand at the named place, else where the robot stands.
    fn put(&self, operator: &Symbol) -> Option<Filling> {
        let held = self.held.clone()?;
        let named = self.types.len();
        let says = |word: &str| {
            self.clause.lifted.words.iter().any(|w| matches!(w, Word::Text(text) if text == word))
        };
        let is_own = |place: &usize| {
            self.is_pronoun(*place) || self.said(*place).is_some_and(|m| m.types.contains(&held))
        };
        let mut own = (0..named).find(is_own);
        let mut penalty = 0.0;
        if let (true, None, Some(other)) = (self.accounts(), own, self.another_thing(operator)) {
            return Some(other);
        }
        if own.is_none() && !self.names_unknown() {
            let placed = self.lists.onto.iter().any(|word| says(word))
                || self.lists.inside.iter().any(|word| says(word));
            match named {
                0 => return None,
                1 if placed => penalty = 1.0,
                1 => return None,
                _ => (own, penalty) = (Some(0), 2.0),
            }
        }
        let put = |place: &Symbol| Program {
            steps: vec![Step {
                operator: operator.clone(),
                args: vec![held.clone(), place.clone()],
            }],
        };
        // "From the counter" is not a place to put it. "Next to the cup" is one only if there is no
        // other.
        let leaves = |place: &usize| {
            self.before(*place).last().is_some_and(|word| self.lists.leaving.contains(*word))
        };
        let mut rest: Vec<usize> =
            (0..named).filter(|place| Some(*place) != own && !leaves(place)).collect();
        rest.sort_by_key(|&place| self.is_landmark(place));
        // "On the top shelf of the fridge", and the fridge has no shelf of its own.
        if let Some(&first) = rest.first().filter(|&&first| self.is_part(first)) {
            let whole = |place: &usize| {
                let before = self.before(*place);
                let of = before
                    .last()
                    .is_some_and(|word| *word == "of" || self.lists.inside.contains(*word));
                of && *place > first && !self.absent.get(*place).is_some_and(|absent| *absent)
            };
            match rest.iter().any(whole) {
                true => rest.retain(|place| *place != first),
                false if self.just_opened(operator) => {
                    let here = self.here.as_ref().filter(|here| **here != held)?;
                    return Some(Filling { programs: vec![put(here)], penalty });
                }
                false => {}
            }
        }
        for (skipped, place) in rest.iter().enumerate() {
            // "Next to the cup" means where the robot stands, and not in the cup.
            let stands = !self.fitting(operator, 1, self.here.as_slice()).is_empty();
            if stands && self.is_landmark(*place) {
                continue;
            }
            let kinds = match self.is_pronoun(*place) {
                true => self.here.as_slice(),
                false => self.types[*place].as_slice(),
            };
            let named = kinds.iter().find(|kind| **kind != held).cloned();
            let mut kinds = self.fitting(operator, 1, kinds);
            kinds.retain(|kind| *kind != held);
            // If nothing can be put there, the world says so; no other place is taken.
            if self.accounts() && kinds.is_empty() && self.is_place(*place) {
                kinds.extend(named);
            }
            if !kinds.is_empty() {
                let programs = kinds.iter().map(put).collect();
                return Some(Filling { programs, penalty: penalty + 0.5 * skipped as f32 });
            }
        }
        let here = self.fitting(operator, 1, self.here.as_slice());
        let here = here.first().filter(|kind| **kind != held)?;
        let penalty = if rest.is_empty() { penalty } else { penalty + 1.0 };
        Some(Filling { programs: vec![put(here)], penalty })
    }

    /// Whether a mention has a name for parts of many things, and nothing of its type is here.
    pub(super) fn is_part(&self, place: usize) -> bool {
        let part = |parts: &BTreeSet<String>| {
            let name = self.said(place).map_or("", |mention| mention.surface.as_str());
            name.rsplit(' ').next().is_some_and(|last| parts.contains(last))
        };
        self.absent.get(place) == Some(&true) && self.accounting.is_some_and(|a| part(&a.parts))
    }

    /// Whether the robot stands at something that holds things and was acted on last.
    fn just_opened(&self, operator: &Symbol) -> bool {
        let here = self.here.as_ref().filter(|here| self.recent.first() == Some(here));
        !self.fitting(operator, 1, here.cloned().as_slice()).is_empty()
    }

    /// Whether a mention is right after a word that says where something is put.
    pub(super) fn is_place(&self, place: usize) -> bool {
        let before = self.before(place);
        before.last().is_some_and(|word| {
            let onto = self.lists.onto.contains(*word) || self.lists.inside.contains(*word);
            onto && !self.lists.destination.contains(*word)
        }) && !self.is_landmark(place)
    }

    /// "Put the mug on the table" with something else in the hand: the world says so.
    fn another_thing(&self, operator: &Symbol) -> Option<Filling> {
        let named = |place: usize| self.types.get(place).and_then(|kinds| kinds.first()).cloned();
        let direct = self.is_object(0, &self.between(0)) && !self.is_pronoun(0);
        let (thing, place) = (named(0).filter(|_| direct)?, named(1)?);
        let step = Step { operator: operator.clone(), args: vec![thing, place] };
        Some(Filling { programs: vec![Program { steps: vec![step] }], penalty: 0.0 })
    }

    /// Each slot in turn gets the first unused mention that fits all its uses. The thing that is
    /// taken or put is the one in the hand, if there is one.
    fn in_turn(&self, roles: &Roles, program: &LiftedProgram) -> Option<Filling> {
        let mut used = BTreeSet::new();
        let mut meant: Vec<Option<Symbol>> = vec![None; program.slots()];
        let constants: BTreeSet<&Symbol> = args(program)
            .filter_map(|(_, _, arg)| match arg {
                LiftedArg::Constant(kind) => Some(kind),
                _ => None,
            })
            .collect();
        for number in 1..=program.slots() {
            let uses: Vec<(&Symbol, usize)> = args(program)
                .filter(|(_, _, arg)| {
                    matches!(arg, LiftedArg::Slot { number: n, .. } if *n as usize == number)
                })
                .map(|(operator, place, _)| (operator, place))
                .collect();
            if uses.is_empty() {
                continue;
            }
            let fits = |kind: &&Symbol| {
                uses.iter().all(|(operator, place)| self.domain.fits(operator, *place, kind))
            };
            // A lesson about a fridge also fits a table: a thing without a door need not be opened.
            let fits_but_for_doors = |kind: &&Symbol| {
                let mut uses = uses.iter().filter(|(operator, _)| !roles.is_door(operator));
                self.accounts()
                    && uses.all(|(operator, place)| self.domain.fits(operator, *place, kind))
            };
            let moved =
                uses.iter().any(|(o, place)| *place == 0 && (roles.takes(o) || roles.puts(o)));
            if let Some(held) = self.held.as_ref().filter(fits).filter(|_| moved) {
                let own = (0..self.types.len())
                    .find(|&place| self.is_pronoun(place) || self.types[place].contains(held));
                used.extend(own);
                meant[number - 1] = Some(held.clone());
                continue;
            }
            let free = |constants: bool, fits: &dyn Fn(&&Symbol) -> bool| {
                (0..self.types.len()).filter(|place| !used.contains(place)).find_map(|place| {
                    let other =
                        |kind: &&Symbol| !meant.iter().flatten().any(|taken| taken == *kind);
                    let kinds = self.types[place].iter().filter(fits).filter(other);
                    let mut kinds =
                        kinds.filter(|kind| constants || !self.is_constant(kind, program));
                    Some((place, kinds.next()?.clone()))
                })
            };
            // If it does not fit, the world says so: "a Fridge cannot be picked up".
            let unfit = || {
                let mut left = (0..self.types.len()).filter(|place| !used.contains(place));
                left.find_map(|place| Some((place, self.types[place].first()?.clone())))
            };
            let (place, kind) = free(constants.is_empty(), &fits)
                .or_else(|| free(constants.is_empty(), &fits_but_for_doors))
                .or_else(|| free(true, &fits))
                .or_else(unfit)?;
            used.insert(place);
            meant[number - 1] = Some(kind);
        }
        let spare = self.held.clone().or_else(|| meant.iter().flatten().next().cloned());
        let meant: Vec<Symbol> =
            meant.into_iter().map(|kind| kind.or(spare.clone())).collect::<Option<_>>()?;
        let program = program.fill(&meant, self.held.as_ref())?;
        Some(Filling { programs: vec![program], penalty: 0.0 })
    }

    fn is_constant(&self, kind: &Symbol, program: &LiftedProgram) -> bool {
        args(program).any(|(_, _, arg)| matches!(arg, LiftedArg::Constant(other) if other == kind))
    }

    pub(super) fn fitting(&self, operator: &Symbol, place: usize, kinds: &[Symbol]) -> Vec<Symbol> {
        kinds.iter().filter(|kind| self.domain.fits(operator, place, kind)).cloned().collect()
    }

    fn said(&self, place: usize) -> Option<&Mention> {
        self.clause.mentions.get(place)
    }

    pub(super) fn is_pronoun(&self, place: usize) -> bool {
        self.said(place).is_some_and(|mention| mention.pronoun)
    }

    /// The words between the mention before a place and the one at it, without determiners, and
    /// without adjectives right before it; for the place behind the last mention, those to the end.
    pub(super) fn before(&self, place: usize) -> Vec<&str> {
        let adjectives = &self.domain.lexicon(self.edition).adjectives;
        let mut found = self.between(place);
        while found.last().is_some_and(|word| adjectives.iter().any(|a| a == word)) {
            found.pop();
        }
        found
    }

    /// As [`Arguments::before`], with the adjectives: "the knife NEAR the bottle".
    pub(super) fn between(&self, place: usize) -> Vec<&str> {
        let mut slot = 0;
        let mut found = Vec::new();
        for word in &self.clause.lifted.words {
            match word {
                Word::Slot { .. } => slot += 1,
                Word::Text(text) if slot == place => found.push(text.as_str()),
                Word::Text(_) => {}
            }
        }
        found.retain(|word| !self.lists.determiners.contains(*word));
        found
    }

    /// Whether a mention is the end of a way: "to the sink", "back to the sink".
    fn is_way_to(&self, place: usize) -> bool {
        let before = self.before(place);
        let Some((last, rest)) = before.split_last() else { return false };
        let passed = |word: &&str| {
            self.lists.passed.contains(*word) || self.lists.verb_particles.contains(*word)
        };
        // The verb is before the first mention.
        let rest = if place == 0 { rest.get(1..).unwrap_or(&[]) } else { rest };
        place < self.types.len()
            && self.lists.destination.contains(*last)
            && rest.iter().all(passed)
    }

    /// Whether the words give a direction to something unknown: "to the dishwasher".
    fn unknown_way(&self, words: &[&str]) -> bool {
        let aside = |word: &str| {
            self.lists.stop.contains(word)
                || self.lists.adverbs.contains(word)
                || self.lists.toward.contains(word)
                || self.lists.verbs.contains(word)
                || self.lists.noun_verbs.contains(word)
        };
        words.windows(2).any(|two| self.lists.destination.contains(two[0]) && !aside(two[1]))
    }

    /// Whether a mention follows another of the same part: "the cup and the knife".
    pub(super) fn is_joined(&self, place: usize) -> bool {
        matches!(self.before(place)[..], [word] if self.lists.cuts.contains(word))
    }

    /// Whether a mention only helps to find a place: "next to the cup", "between the cup and the
    /// knife".
    pub(super) fn is_landmark(&self, place: usize) -> bool {
        if place > 0 && self.is_joined(place) && self.is_landmark(place - 1) {
            return true;
        }
        let before = self.before(place).join(" ");
        self.lists.landmarks.iter().any(|phrase| {
            before.strip_suffix(phrase.as_str()).is_some_and(|b| b.is_empty() || b.ends_with(' '))
        })
    }

    /// Whether there are words that name nothing known between the verb and the first preposition.
    fn names_unknown(&self) -> bool {
        let adjectives = &self.domain.lexicon(self.edition).adjectives;
        let grammar = Grammar { lists: self.lists, adjectives };
        let words = &self.clause.lifted.words;
        let after = grammar.main_verb(words).map_or(0, |verb| verb.at + 1);
        let first = words[after..].iter().find(|word| match word {
            Word::Slot { .. } => true,
            Word::Text(text) => {
                !self.lists.determiners.contains(text)
                    && !grammar.is_adjective(text)
                    && !self.lists.passed.contains(text)
            }
        });
        matches!(first, Some(Word::Text(text)) if !self.lists.stop.contains(text))
    }
}

/// Every argument with its operator and 0-based place.
fn args(program: &LiftedProgram) -> impl Iterator<Item = (&Symbol, usize, &LiftedArg)> {
    program.steps.iter().flat_map(|step| {
        step.args.iter().enumerate().map(|(place, arg)| (&step.operator, place, arg))
    })
}

fn filling(operator: &Symbol, kinds: Vec<Symbol>, penalty: f32) -> Filling {
    let program = |kind: Symbol| Program {
        steps: vec![Step { operator: operator.clone(), args: vec![kind] }],
    };
    Filling { programs: kinds.into_iter().map(program).collect(), penalty }
}
