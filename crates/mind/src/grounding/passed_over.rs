//! Things that were named and that a reading does not use. Such a reading is not taken.

use super::accounting::TOOLS;
use super::arguments::Arguments;
use crate::language::{Grammar, LiftedUtterance, Program, Symbol, Word};
use crate::world::Words;

/// "As well as the drawer" means "and the drawer".
const JOINING: [&str; 6] = ["plus", "well", "followed", "along", "together", "including"];

impl<D: Words> Arguments<'_, D> {
    /// The things that were named to be acted on and that the program does not use. For a lesson
    /// also the place where something is to be put, a thing named in the place of its fixture, and
    /// the tool.
    ///
    /// - `lesson`: its words, if the program is a lesson's.
    pub(super) fn passed_over(
        &self,
        program: &Program,
        lesson: Option<&LiftedUtterance>,
    ) -> Vec<String> {
        let uses = |kind: &Symbol| program.steps.iter().any(|step| step.args.contains(kind));
        let mut left = Vec::new();
        // Whether the mention before was named as the place of something.
        let mut aside = false;
        for (place, mention) in self.clause.mentions.iter().enumerate() {
            let used = self.types[place].iter().chain(&mention.types).any(|kind| {
                // A thing in the hand comes along.
                uses(kind) || self.held.as_ref() == Some(kind)
            });
            aside = match self.between(place).as_slice() {
                before if self.is_side_by_side(place, before) => aside,
                before if before.iter().any(|word| JOINING.contains(word)) => false,
                before => !self.is_object(place, before),
            };
            let acted_on = !aside && !mention.pronoun;
            let put_there = |lesson| {
                let instead = self.is_instead(lesson, place);
                match place {
                    0 => instead,
                    _ => (instead || self.ends_put(program)) && self.is_put_there(place),
                }
            };
            let asked = |lesson| put_there(lesson) || self.is_tool_of(lesson, place);
            let unused = !used && (acted_on || lesson.is_some_and(asked));
            if unused || (place > 0 && self.is_lit(program, place)) {
                left.push(mention.surface.clone());
            }
        }
        left
    }

    /// Whether something is to be put on a mention: "wash the spoon and put it on the TABLE".
    fn is_put_there(&self, place: usize) -> bool {
        let lexicon = self.domain.lexicon(self.edition);
        let mut slots = 0;
        let before = self.clause.lifted.words.iter().take_while(|word| {
            slots += usize::from(matches!(word, Word::Slot { .. }));
            slots <= place
        });
        let verbs = before.filter_map(|word| match word {
            Word::Text(text) if self.lists.verbs.contains(text) => Some(text),
            _ => None,
        });
        let (Some(verb), Some(habits)) = (verbs.last(), &lexicon.habits) else { return false };
        let counts = habits.counts(&format!("V:{verb}")).unwrap_or_default();
        let most = (0..counts.len()).max_by_key(|&at| counts[at]);
        let puts = most.is_some_and(|most| lexicon.roles.puts(&habits.order[most]));
        puts && self.is_place(place) && !self.is_part(place)
    }

    /// Whether a mention is a tool, and the lesson has no tool: "wash the tomato with the FORK",
    /// after "wash the mug".
    fn is_tool_of(&self, lesson: &LiftedUtterance, place: usize) -> bool {
        let with = |word: &&str| TOOLS.contains(word);
        let in_lesson = lesson.words.iter().any(|word| match word {
            Word::Text(text) => TOOLS.contains(&text.as_str()),
            Word::Slot { .. } => false,
        });
        let before = self.before(place);
        let mut last = before.iter().rev().filter(|word| !self.lists.determiners.contains(**word));
        place > 0 && !in_lesson && last.next().is_some_and(with)
    }

    /// Whether a mention is in the place of a fixture that the lesson names and the clause does
    /// not: "look into the DRAWER", after a lesson about looking into the fridge.
    fn is_instead(&self, lesson: &LiftedUtterance, place: usize) -> bool {
        let said = &self.clause.lifted.words;
        let missing = |word: &&Word| {
            matches!(word, Word::Slot { fixture: Some(_), .. }) && !said.contains(word)
        };
        let roles = &self.domain.lexicon(self.edition).roles;
        let kinds = self.types[place].as_slice();
        let taken = |operator| !self.fitting(operator, 0, kinds).is_empty();
        let takeable = roles.taking.as_ref().is_some_and(taken);
        let pronoun = self.is_pronoun(place);
        lesson.words.iter().any(|word| missing(&word))
            && !takeable
            && !pronoun
            && !self.is_part(place)
            && !self.is_landmark(place)
    }

    /// Whether the last thing that is handled is put down, and not taken up again.
    fn ends_put(&self, program: &Program) -> bool {
        let roles = &self.domain.lexicon(self.edition).roles;
        let mut operators = program.steps.iter().rev().map(|step| &step.operator);
        let last = operators.find(|operator| roles.takes(operator) || roles.puts(operator));
        last.is_some_and(|operator| roles.puts(operator))
    }

    /// Whether the words ask to look at something in the light of a mention (a thing that is
    /// switched and holds nothing), and the program only goes somewhere.
    fn is_lit(&self, program: &Program, place: usize) -> bool {
        let roles = &self.domain.lexicon(self.edition).roles;
        let Some(accounting) = self.accounting else { return false };
        let adjectives = &self.domain.lexicon(self.edition).adjectives;
        let grammar = Grammar { lists: self.lists, adjectives };
        let verb = grammar.main_verb(&self.clause.lifted.words);
        let looks = verb.is_some_and(|verb| accounting.looking.contains(&verb.word));
        let kinds = self.types[place].as_slice();
        let operators = || self.domain.signature().operators.iter().map(|known| &known.name);
        let fits = |operator: &Symbol, at: usize| !self.fitting(operator, at, kinds).is_empty();
        let switched = operators().any(|operator| roles.works(operator) && fits(operator, 0));
        let holds = operators().any(|operator| roles.puts(operator) && fits(operator, 1));
        let goes = program.steps.iter().all(|step| roles.goes(&step.operator));
        let before = self.before(place);
        let lights = before.last().is_some_and(|word| accounting.lighting.contains(*word));
        looks && goes && switched && !holds && lights
    }
}
