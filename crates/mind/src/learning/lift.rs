use super::{Lesson, Recipe};
use crate::grounding::{Abstractor, resolve, without_locations};
use crate::language::{
    Clause, Exemplar, LiftedArg, LiftedProgram, LiftedStep, Program, Roles, Symbol,
};
use crate::world::Words;

/// What a lesson becomes for the parser: its utterance and its program, both lifted (paper,
/// section 3.2).
///
/// An argument that a mention meant becomes that mention's slot; where a name may mean several
/// types, it meant the one that the program acts on. All other arguments stay what they were:
/// "wash the mug" keeps its `SinkBasin`. With [`super::recipe::Lifting::held`], what was in the
/// hand when the utterance was said and was not mentioned becomes `<held>`.
pub fn lift<D: Words>(domain: &D, recipe: &Recipe, lesson: &Lesson<D::Scene, D::Task>) -> Exemplar {
    let settings = recipe.settings();
    let known = |word: &str| recipe.words().lookup(word).is_some();
    let abstractor =
        Abstractor::new(domain.lexicon(settings.words.edition), &settings.abstraction, &known);
    let whole = abstractor.read(&lesson.utterance).whole();
    let lifted = lift_clause(domain, recipe, lesson, &whole);
    // "from the <obj>" is dropped only if the program does not need it. Then it was not an
    // argument.
    let shorter = settings.abstraction.locations.then(|| without_locations(&whole)).flatten();
    let shorter = shorter.map(|clause| (lift_clause(domain, recipe, lesson, &clause), clause));
    match shorter {
        Some((short, clause)) if slots_used(&short) == slots_used(&lifted) => {
            Exemplar { utterance: clause.lifted, program: short }
        }
        _ => Exemplar { utterance: whole.lifted, program: lifted },
    }
}

fn lift_clause<D: Words>(
    domain: &D,
    recipe: &Recipe,
    lesson: &Lesson<D::Scene, D::Task>,
    clause: &Clause,
) -> LiftedProgram {
    let before = lesson.mentioned.as_ref();
    let edition = recipe.settings().words.edition;
    let referents = resolve(domain, edition, &lesson.scene, &clause.mentions, before);
    let acts_on = |kind: &&Symbol| lesson.program.steps.iter().any(|s| s.args.contains(kind));
    let meant: Vec<Option<&Symbol>> = referents
        .types
        .iter()
        .zip(&clause.mentions)
        // A name may also mean a type that was not in sight when it was said.
        .map(|(types, said)| types.iter().chain(&said.types).find(acts_on).or(types.first()))
        .collect();
    let held = domain.held(&lesson.scene).filter(|_| recipe.settings().lifting.held);
    // "In the sink" says how, not what, so other wordings may leave it out. But a person names the
    // place where a task ends every time.
    let lexicon = domain.lexicon(edition);
    let keeps = recipe.settings().abstraction.lists.is_some();
    let goal = goal(&lexicon.roles, &lesson.program);
    let stays = |arg: &Symbol| {
        let word = lexicon.fixtures.get(arg).filter(|_| keeps && goal != Some(arg));
        word.is_some_and(|word| lexicon.fixtures.values().filter(|w| *w == word).count() == 1)
    };
    let lift_arg = |arg: &Symbol| {
        // Of two mentions of one type, the first is it: "the mug on the table beside the mug".
        match meant.iter().position(|kind| *kind == Some(arg)) {
            Some(_) if stays(arg) => LiftedArg::Constant(arg.clone()),
            Some(place) => LiftedArg::Slot {
                sort: clause.mentions[place].sort.clone(),
                number: place as u8 + 1,
            },
            None if held.as_ref() == Some(arg) => LiftedArg::Held,
            None => LiftedArg::Constant(arg.clone()),
        }
    };
    lift_program(&lesson.program, lift_arg)
}

/// Where a program that fetches something leaves it at the end.
fn goal<'p>(roles: &Roles, program: &'p Program) -> Option<&'p Symbol> {
    let fetches =
        program.steps.iter().find(|s| roles.takes(&s.operator) || roles.puts(&s.operator));
    fetches.filter(|first| roles.takes(&first.operator))?;
    let last = program.steps.iter().rfind(|s| roles.takes(&s.operator) || roles.puts(&s.operator));
    last.filter(|last| roles.puts(&last.operator))?.args.last()
}

fn lift_program(program: &Program, lift_arg: impl Fn(&Symbol) -> LiftedArg) -> LiftedProgram {
    let steps = program.steps.iter().map(|step| LiftedStep {
        operator: step.operator.clone(),
        args: step.args.iter().map(&lift_arg).collect(),
    });
    LiftedProgram { steps: steps.collect() }
}

fn slots_used(program: &LiftedProgram) -> usize {
    let mut numbers: Vec<u8> = program
        .steps
        .iter()
        .flat_map(|step| &step.args)
        .filter_map(|arg| match arg {
            LiftedArg::Slot { number, .. } => Some(*number),
            _ => None,
        })
        .collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers.len()
}
