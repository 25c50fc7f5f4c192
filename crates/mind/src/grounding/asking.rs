//! When a reading is not taken but asked about.

use super::{Candidate, Moment};
use crate::language::{AnswerOption, Mention, Program, Question, Symbol};
use crate::world::{Edition, Lexicon, Words};

/// How many options a question offers at most; with more, it is no help.
const OPTIONS_MAX: usize = 4;

/// What is known when a reading is about to be taken.
pub(super) struct Taken<'a, D: Words> {
    /// When it was said.
    pub moment: &'a Moment<'a, D>,
    /// Of the domain's words.
    pub edition: Edition,
    /// The reading.
    pub candidate: &'a Candidate,
    /// What was named, in order.
    pub mentions: &'a [Mention],
}

/// The question which is meant, where a name fits things of several types here, and the reading would
/// run with each of them.
///
/// - `below`: in percent. Nothing is asked where recorded people who said the name meant the type of
///   the reading at least that often, of the types here.
/// - returns: none when one type fits, when the words or the episode say which, or too many fit.
pub(super) fn which<D: Words>(taken: &Taken<'_, D>, below: u32) -> Option<Question> {
    taken.mentions.iter().filter(|mention| !mention.pronoun).find_map(|mention| {
        let options = taken.options(mention, below)?;
        let labels: Vec<&str> = options.iter().map(|option| option.label.as_str()).collect();
        let text = format!("Which {}: {}?", mention.surface, listed(&labels, "or"));
        Some(Question { text, options })
    })
}

impl<D: Words> Taken<'_, D> {
    fn options(&self, mention: &Mention, below: u32) -> Option<Vec<AnswerOption>> {
        let Moment { domain, scene, .. } = *self.moment;
        let lexicon = domain.lexicon(self.edition);
        let kinds = domain.resolve(self.edition, scene, mention);
        let steps = &self.candidate.program.steps;
        let used = kinds.iter().find(|&kind| steps.iter().any(|step| step.args.contains(kind)))?;
        if self.is_settled(used) {
            return None;
        }
        let others = kinds
            .iter()
            .filter(|&kind| kind != used && !lexicon.rarely_means(&mention.surface, kind));
        let programs = others.map(|other| (other, with(&self.candidate.program, used, other)));
        let first = std::iter::once((used, self.candidate.program.clone()));
        let options = first.chain(programs);
        let options: Vec<AnswerOption> =
            options.filter_map(|(kind, program)| self.option(kind, program)).collect();
        let fits = (2..=OPTIONS_MAX).contains(&options.len());
        let share = share(lexicon, &mention.surface, used, &kinds);
        (fits && share.is_none_or(|share| share < below)).then_some(options)
    }

    /// Whether words chose the thing, or it was acted on before: then it is meant again.
    fn is_settled(&self, kind: &Symbol) -> bool {
        let is = |name: &String| kind.as_str() == name || name.starts_with(&format!("{kind} "));
        let chosen = self.candidate.chosen();
        chosen.iter().flatten().flatten().any(is)
            || self.moment.handled.iter().any(is)
            || self.moment.mentioned == Some(kind)
    }

    /// - returns: none when the program does not run.
    fn option(&self, kind: &Symbol, program: Program) -> Option<AnswerOption> {
        let Moment { domain, scene, task, .. } = *self.moment;
        let (mut scene, chosen) = (scene.clone(), self.candidate.chosen());
        let steps = program.steps.iter().enumerate();
        let bindings = steps.map(|(index, step)| {
            let on = chosen.get(index).map_or(&[][..], Vec::as_slice);
            domain.step_on(&mut scene, task, step, on).ok()
        });
        let bindings = bindings.collect::<Option<_>>()?;
        let label = format!("the {}", domain.called(kind.as_str()));
        let mentioned = Some(kind.clone());
        Some(AnswerOption { label, program, bindings, chosen, mentioned })
    }
}

/// The program with things of another type in the place of these.
fn with(program: &Program, used: &Symbol, other: &Symbol) -> Program {
    let mut program = program.clone();
    let args = program.steps.iter_mut().flat_map(|step| &mut step.args);
    args.filter(|arg| *arg == used).for_each(|arg| arg.clone_from(other));
    program
}

/// How often recorded people meant this type by the name, of the types here, in percent; none where
/// nobody was recorded.
fn share(lexicon: &Lexicon, surface: &str, used: &Symbol, kinds: &[Symbol]) -> Option<u32> {
    let meanings = lexicon.names.get(surface)?;
    let uses = |kind: &Symbol| {
        meanings.iter().filter(|it| it.kind == *kind).map(|it| it.count).sum::<u32>()
    };
    let all: u32 = kinds.iter().map(uses).sum();
    (all > 0).then(|| uses(used) * 100 / all)
}

/// `a, b or c`.
pub(crate) fn listed(items: &[&str], word: &str) -> String {
    match items {
        [] => String::new(),
        [only] => (*only).to_owned(),
        [before @ .., last] => format!("{} {word} {last}", before.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_reads_as_people_write_it() {
        assert_eq!(listed(&["a"], "or"), "a");
        assert_eq!(listed(&["a", "b"], "or"), "a or b");
        assert_eq!(listed(&["a", "b", "c"], "and"), "a, b and c");
    }
}
