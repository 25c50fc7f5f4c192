use std::collections::BTreeMap;

use super::{Lesson, Mind};
use crate::grounding::{Choice, Featured, Moment, featured};
use crate::ids::Digest;
use crate::language::{Clause, Exemplar, Program, Symbol, Word};
use crate::numerics::Rng;
use crate::parser::SemanticParser;
use crate::world::{Edition, Features, Words, World};

/// The history that the reranker learns from. Each lesson is parsed again by the new parser at its
/// own moment. Each seed is added, with things of a lesson's scene in its slots, so that a few
/// lessons do not make the reranker forget the primitives.
///
/// - `mind`: the mind so far, without a reranker.
pub(super) fn history<D: Words + Features>(
    domain: &D,
    mind: &Mind,
    lessons: &[Lesson<D::Scene, D::Task>],
    seed: Digest,
) -> Vec<Choice> {
    let taught = lessons.iter().map(|lesson| taught(domain, mind, lesson));
    let mut rng = Rng::from_digest(seed);
    let names = names(domain, mind.recipe.settings().words.edition);
    // Lessons keep their order, so the i-th seed always gets the same scene.
    let seeded = domain.seeds().exemplars.iter().enumerate().filter_map(|(index, exemplar)| {
        let lesson = &lessons[index % lessons.len()];
        seeded(domain, mind, lesson, exemplar, &names, &mut rng)
    });
    taught.chain(seeded).collect()
}

fn taught<D: Words + Features>(
    domain: &D,
    mind: &Mind,
    lesson: &Lesson<D::Scene, D::Task>,
) -> Choice {
    let moment = moment(domain, lesson);
    let known = |word: &str| mind.recipe.words().lookup(word).is_some();
    let candidates = mind.interpreter(&known).candidates(&moment, &lesson.utterance);
    let programs: Vec<Program> = candidates.into_iter().map(|c| c.program).collect();
    choice(lesson.utterance.tokens(), &moment, programs, &lesson.program)
}

/// A seed at the moment of a lesson, about things of that scene. Whether it would run does not
/// matter: the words alone tell PICKUP from OPEN.
fn seeded<D: Words + Features>(
    domain: &D,
    mind: &Mind,
    lesson: &Lesson<D::Scene, D::Task>,
    exemplar: &Exemplar,
    names: &BTreeMap<Symbol, String>,
    rng: &mut Rng,
) -> Option<Choice> {
    let moment = moment(domain, lesson);
    let mut kinds: Vec<Symbol> = domain.present(&lesson.scene).into_iter().collect();
    kinds.retain(|kind| names.contains_key(kind));
    if kinds.is_empty() {
        return None;
    }
    let slots = exemplar.utterance.slots();
    let meant: Vec<Symbol> = (0..slots).map(|_| kinds[rng.below(kinds.len())].clone()).collect();
    let mut fillers = meant.iter().map(|kind| &names[kind]);
    let mut words = Vec::new();
    for word in &exemplar.utterance.words {
        match word {
            Word::Text(text) => words.push(text.clone()),
            Word::Slot { .. } => {
                let name = fillers.next().expect("a filler was drawn for each slot");
                words.extend(name.split(' ').map(str::to_owned));
            }
        }
    }
    let held = domain.held(&lesson.scene);
    let fill = |program: &crate::language::LiftedProgram| program.fill(&meant, held.as_ref());
    let right = fill(&exemplar.program)?;
    let parse = mind.parser.parse(&Clause::of(&exemplar.utterance));
    let programs = parse.candidates.iter().filter_map(|scored| fill(&scored.program)).collect();
    Some(choice(words, &moment, programs, &right))
}

fn choice<D: Features>(
    words: Vec<String>,
    moment: &Moment<'_, D>,
    mut programs: Vec<Program>,
    right: &Program,
) -> Choice {
    let place = programs.iter().position(|program| program == right).unwrap_or_else(|| {
        programs.push(right.clone());
        programs.len() - 1
    });
    let candidates: Vec<Featured> =
        programs.iter().map(|program| featured(moment, program)).collect();
    Choice { words, candidates, right: place }
}

fn moment<'a, D: World>(domain: &'a D, lesson: &'a Lesson<D::Scene, D::Task>) -> Moment<'a, D> {
    Moment {
        domain,
        scene: &lesson.scene,
        task: &lesson.task,
        mentioned: lesson.mentioned.as_ref(),
        handled: &[],
    }
}

/// The commonest name of each type.
fn names<D: Words>(domain: &D, edition: Edition) -> BTreeMap<Symbol, String> {
    let mut best: BTreeMap<Symbol, (u32, String)> = BTreeMap::new();
    for (name, meanings) in &domain.lexicon(edition).names {
        for meaning in meanings {
            let known = best.get(&meaning.kind);
            if known.is_none_or(|(count, _)| meaning.count > *count) {
                best.insert(meaning.kind.clone(), (meaning.count, name.clone()));
            }
        }
    }
    best.into_iter().map(|(kind, (_, name))| (kind, name)).collect()
}
