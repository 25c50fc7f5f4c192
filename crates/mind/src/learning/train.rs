use super::history::history;
use super::lift::lift;
use super::parsing::AnyParser;
use super::{Lesson, Mind, Recipe, Report, TrainError};
use crate::grounding::Reranker;
use crate::ids::Digest;
use crate::language::{Clause, Exemplar, Symbol};
use crate::limits::LESSONS_MAX;
use crate::parser::SemanticParser;
use crate::world::{Features, Words};

/// Trains a mind. Seeds and lifted lessons become exemplars. The parser is trained on these, with
/// its threshold. Then the whole history is parsed again, and the reranker learns from it (paper,
/// section 3.3).
///
/// A pure function: the training seed comes from the recipe's digest alone, so the same recipe and
/// lessons give the same mind, bit for bit, on every machine. Without lessons it is the base mind,
/// with which every person starts.
///
/// - errors: too many lessons, a training that diverges, or a seed that no longer gets its own
///   program. The previous mind is then the one to keep.
pub fn train<D: Words + Features>(
    domain: &D,
    recipe: &Recipe,
    lessons: &[Lesson<D::Scene, D::Task>],
) -> Result<Mind, TrainError> {
    if lessons.len() > LESSONS_MAX {
        return Err(TrainError::TooManyLessons { found: lessons.len() });
    }
    let seeds = domain.seeds();
    let mut exemplars = seeds.exemplars.clone();
    exemplars.extend(lessons.iter().map(|lesson| lift(domain, recipe, lesson)));

    let (parser, figures) = AnyParser::train(recipe, domain, seed(recipe, "parser"), &exemplars)?;
    seeds_keep_their_programs(&parser, &seeds.exemplars, lessons)?;
    let report =
        Report { exemplars: exemplars.len() as u32, threshold: parser.threshold(), figures };
    let seed_count = seeds.exemplars.len() as u32;
    let mut mind = Mind::new(recipe.clone(), parser, None, seed_count, report);
    // A parser that is sure of its order asks a reranker only where one form has two programs.
    let choices = mind.parser.offers_choices();
    let never_asked = mind.parser.sure_of_order() && !(choices && clashes(&exemplars));
    if lessons.is_empty() || never_asked {
        return Ok(mind);
    }

    let history = history(domain, &mind, lessons, seed(recipe, "history"));
    let (reranker, figures) = Reranker::train(
        &recipe.settings().reranker,
        recipe.words(),
        symbols(domain, recipe, &exemplars),
        domain.feature_count(),
        seed(recipe, "reranker"),
        &history,
    );
    let named = [
        ("reranker_choices", figures.choices as f64),
        ("reranker_loss", figures.loss as f64),
        ("reranker_right", reranker.share_right(&history)),
        ("reranker_steps", figures.steps as f64),
    ];
    let mut report = mind.report.clone();
    report.figures.extend(named.map(|(name, value)| (name.to_owned(), value)));
    mind = Mind::new(recipe.clone(), mind.parser, Some(reranker), seed_count, report);
    Ok(mind)
}

/// The seed of one part of a training.
fn seed(recipe: &Recipe, part: &str) -> Digest {
    let mut hasher = blake3::Hasher::new_derive_key("apprentice 2026 training seed");
    hasher.update(&recipe.digest().0);
    hasher.update(part.as_bytes());
    Digest(*hasher.finalize().as_bytes())
}

/// Whether two exemplars with the same lifted form have different programs.
fn clashes(exemplars: &[Exemplar]) -> bool {
    let mut sorted: Vec<&Exemplar> = exemplars.iter().collect();
    sorted.sort_by_key(|exemplar| &exemplar.utterance);
    sorted
        .windows(2)
        .any(|two| two[0].utterance == two[1].utterance && two[0].program != two[1].program)
}

/// Everything that programs may consist of.
fn symbols<D: Words>(domain: &D, recipe: &Recipe, exemplars: &[Exemplar]) -> Vec<Symbol> {
    let operators = domain.signature().operators.iter().map(|operator| operator.name.clone());
    let meanings = domain.lexicon(recipe.settings().words.edition).names.values().flatten();
    let kinds = meanings.map(|meaning| meaning.kind.clone());
    let args = exemplars.iter().flat_map(|exemplar| &exemplar.program.steps).flat_map(|s| &s.args);
    let constants = args.filter_map(|arg| match arg {
        crate::language::LiftedArg::Constant(symbol) => Some(symbol.clone()),
        _ => None,
    });
    operators.chain(kinds).chain(constants).collect()
}

/// Checks that every seed still means its program: no lesson may take it away.
///
/// - errors: [`TrainError::SeedUnheard`], [`TrainError::SeedLost`].
fn seeds_keep_their_programs<S, T>(
    parser: &AnyParser,
    seeds: &[Exemplar],
    lessons: &[Lesson<S, T>],
) -> Result<(), TrainError> {
    for seed in seeds {
        let parse = parser.parse(&Clause::of(&seed.utterance));
        let Some(first) = parse.candidates.first() else {
            return Err(TrainError::SeedUnheard {
                seed: seed.utterance.to_string(),
                threshold: parse.threshold.to_string(),
            });
        };
        if first.program != seed.program {
            let number = first.number as usize;
            let swallower = match number.checked_sub(seeds.len()).and_then(|i| lessons.get(i)) {
                Some(lesson) => format!("the lesson {:?}", lesson.utterance.as_str()),
                None => match parser.exemplars().get(number) {
                    Some(known) => format!("the seed {:?}", known.utterance.to_string()),
                    None => "what the parser learned".to_owned(),
                },
            };
            return Err(TrainError::SeedLost {
                seed: seed.utterance.to_string(),
                program: seed.program.to_string(),
                found: first.program.to_string(),
                swallower,
            });
        }
    }
    Ok(())
}
