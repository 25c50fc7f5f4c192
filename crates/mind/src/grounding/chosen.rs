//! The thing that a reading acts on where words choose one of several of a kind.

use std::collections::BTreeMap;

use super::combine::{Ground, Offer, Partial, Verdict};
use super::pointing::pointing;
use crate::language::{Clause, Grammar, Program, Step, Symbol, WordLists};
use crate::world::{Lexicon, Pointing, Words};

/// Which thing of a type the words of a clause choose.
#[derive(Debug, Clone, Default)]
pub(super) struct Chosen(BTreeMap<Symbol, String>);

impl Chosen {
    /// Per argument of the step; empty when the words choose none of them.
    pub(super) fn on(&self, step: &Step) -> Vec<Option<String>> {
        let on: Vec<Option<String>> =
            step.args.iter().map(|arg| self.0.get(arg).cloned()).collect();
        if on.iter().all(Option::is_none) { Vec::new() } else { on }
    }
}

impl<D: Words> Ground<'_, D> {
    /// "The lamp on the dresser": of the types that share a name, one that is there comes first.
    pub(super) fn prefer_what_is_there(
        &self,
        scene: &D::Scene,
        clause: &Clause,
        types: &mut [Vec<Symbol>],
    ) {
        let (domain, edition) = (self.moment.domain, self.context.edition);
        let Some(lists) = self.context.lists.filter(|_| self.context.execution.instances) else {
            return;
        };
        let nothing = Program { steps: Vec::new() };
        for place in 0..types.len() {
            if types[place].len() < 2 {
                continue;
            }
            let said = pointing(domain, edition, lists, clause, types, place, &nothing);
            let Some(there) = said.place.map(|place| Pointing {
                place: Some(place),
                strictly: true,
                ..Pointing::default()
            }) else {
                continue;
            };
            let is_there =
                |kind: &Symbol| matches!(domain.choose(scene, kind, &there), Ok(Some(_)));
            types[place].sort_by_key(|kind| !is_there(kind));
        }
    }

    /// Which things the words of the clause choose, of the types that a program acts on.
    ///
    /// - `strictly`: see [`Pointing::strictly`].
    /// - errors: a sentence, when nothing here is as the words say.
    pub(super) fn choose(
        &self,
        partial: &Partial<D::Scene>,
        offer: &Offer<'_>,
        types: &[Vec<Symbol>],
        program: &Program,
        strictly: bool,
    ) -> Result<Chosen, String> {
        let mut chosen = Chosen::default();
        let Some(lists) = self.context.lists.filter(|_| self.context.execution.instances) else {
            return Ok(chosen);
        };
        let domain = self.moment.domain;
        // Things that the clauses before handled are the newest.
        let mut handled: Vec<String> = match &partial.candidate.verdict {
            Verdict::Runs { bindings, .. } => bindings.iter().flatten().rev().cloned().collect(),
            _ => Vec::new(),
        };
        handled.extend(self.moment.handled.iter().cloned());
        let mut seen: Vec<Symbol> = Vec::new();
        for (place, kinds) in types.iter().enumerate() {
            let pronoun = offer.clause.mentions.get(place).is_some_and(|m| m.pronoun);
            let acts_on = |kind: &&Symbol| program.steps.iter().any(|s| s.args.contains(kind));
            let kind = kinds.iter().find(acts_on);
            // The first mention of a kind counts: "the bowl beside the other bowl".
            let Some(kind) = kind.filter(|kind| !pronoun && !seen.contains(kind)) else {
                continue;
            };
            seen.push(kind.clone());
            let mut pointing =
                pointing(domain, self.context.edition, lists, offer.clause, types, place, program);
            pointing.handled.clone_from(&handled);
            pointing.strictly = strictly;
            if let Some(state) =
                switched(lists, domain.lexicon(self.context.edition), offer, program)
            {
                // Of several lamps, one that is on is turned off.
                let wished = Pointing { words: vec![state.to_owned()], ..pointing.clone() };
                if let Ok(Some(name)) = domain.choose(&partial.scene, kind, &wished) {
                    chosen.0.insert(kind.clone(), name);
                    continue;
                }
            }
            let found = domain.choose(&partial.scene, kind, &pointing).or_else(|reason| {
                // A lesson may change the state that the words name ("wash the dirty mug").
                let bare = Pointing { words: Vec::new(), ..pointing.clone() };
                match offer.seed {
                    true => Err(reason),
                    false => domain.choose(&partial.scene, kind, &bare),
                }
            });
            if let Some(name) = found? {
                chosen.0.insert(kind.clone(), name);
            }
        }
        Ok(chosen)
    }
}

/// The state that a thing must be in to be switched as the words say.
fn switched<'s>(
    lists: &WordLists,
    lexicon: &Lexicon,
    offer: &Offer<'_>,
    program: &Program,
) -> Option<&'s str> {
    let [step] = program.steps.as_slice() else { return None };
    let works = lexicon.roles.works(&step.operator);
    let grammar = Grammar { lists, adjectives: &lexicon.adjectives };
    let verb = grammar.main_verb(&offer.clause.lifted.words).filter(|_| works && offer.seed)?;
    match verb.particle.as_str() {
        "off" => Some("on"),
        "on" => Some("off"),
        _ => None,
    }
}
