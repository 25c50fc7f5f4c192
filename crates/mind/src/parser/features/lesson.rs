use std::collections::{BTreeMap, BTreeSet};

use super::sentence::{Knowledge, Sentence};
use super::settings::{LessonSettings, LessonWeights};
use crate::language::{Clause, Exemplar, LiftedArg, Roles, Word};
use crate::numerics::{dot, ln, sigmoid};

/// The values of `new` and `new_back` if neither side has a word that simple requests hardly use.
const NOTHING_NEW: f32 = 0.6;

/// Judges how likely an utterance asks for the same as each lesson. Everything about the lessons is
/// computed once, when the mind is made.
#[derive(Debug, Clone)]
pub(super) struct LessonJudge {
    /// The vectors of all words of all lessons, each word once.
    vocabulary: Vec<Vec<f32>>,
    lessons: Vec<Facts>,
}

/// What is known of a lesson.
#[derive(Debug, Clone)]
struct Facts {
    request: bool,
    /// Per item: its place in the vocabulary and its weight by rarity.
    items: Vec<(usize, f32)>,
    new: Vec<usize>,
    verbs: Vec<usize>,
    whole: Vec<f32>,
    rare_whole: Vec<f32>,
    /// The words of the fixtures that its program uses, and their vectors.
    fixtures: BTreeSet<String>,
    fixture_words: Vec<usize>,
}

impl LessonJudge {
    pub(super) fn new(knowledge: &Knowledge, roles: &Roles, lessons: &[Exemplar]) -> LessonJudge {
        let mut vocabulary = Vec::new();
        let mut places: BTreeMap<String, usize> = BTreeMap::new();
        let mut place = |word: &str| {
            *places.entry(word.to_owned()).or_insert_with(|| {
                vocabulary.push(knowledge.vector(word));
                vocabulary.len() - 1
            })
        };
        let facts = |lesson: &Exemplar| {
            let sentence = knowledge.sentence(&lesson.utterance.words);
            let items: Vec<(usize, f32)> =
                sentence.items.iter().map(|item| (place(&item.word), item.rare)).collect();
            let verbs = verbs(knowledge, &Clause::of(&lesson.utterance));
            let fixtures = fixtures(knowledge, lesson);
            Facts {
                request: is_request(roles, lesson),
                new: sentence.new.iter().map(|&new| items[new].0).collect(),
                verbs: verbs.iter().map(|verb| place(verb)).collect(),
                fixture_words: fixtures.iter().map(|word| place(word)).collect(),
                items,
                whole: sentence.whole,
                rare_whole: sentence.rare_whole,
                fixtures,
            }
        };
        let lessons = lessons.iter().map(facts).collect();
        LessonJudge { vocabulary, lessons }
    }

    /// Per lesson a probability.
    ///
    /// - `seed_cosine`: the cosine of the utterance to the nearest seed.
    pub(super) fn judge(
        &self,
        knowledge: &Knowledge,
        weights: &LessonSettings,
        clause: &Clause,
        sentence: &Sentence,
        seed_cosine: f32,
    ) -> Vec<f32> {
        if self.lessons.is_empty() || sentence.items.is_empty() {
            return vec![0.0; self.lessons.len()];
        }
        let rows = |vector: &Vec<f32>| -> Vec<f32> {
            self.vocabulary.iter().map(|other| dot(vector, other)).collect()
        };
        let near: Vec<Vec<f32>> = sentence.items.iter().map(|item| rows(&item.vector)).collect();
        let verbs = verbs(knowledge, clause);
        let verbs: Vec<Vec<f32>> = verbs.iter().map(|verb| rows(&knowledge.vector(verb))).collect();
        let heard = Heard { sentence, near, verbs, seed_cosine };
        let weigh = |lesson: &Facts| {
            let weights = if lesson.request { &weights.request } else { &weights.task };
            if lesson.items.is_empty() { 0.0 } else { sigmoid(heard.logit(lesson, weights)) }
        };
        self.lessons.iter().map(weigh).collect()
    }
}

/// An utterance, with its nearness to every word of the lessons.
struct Heard<'a> {
    sentence: &'a Sentence,
    /// Items × vocabulary.
    near: Vec<Vec<f32>>,
    /// Main verbs × vocabulary.
    verbs: Vec<Vec<f32>>,
    seed_cosine: f32,
}

impl Heard<'_> {
    fn logit(&self, lesson: &Facts, weights: &LessonWeights) -> f32 {
        let said = self.sentence;
        let cosine = dot(&said.whole, &lesson.whole);
        let mut cover = (0.0, 0.0);
        for (item, near) in said.items.iter().zip(&self.near) {
            let best = lesson.items.iter().map(|(word, _)| near[*word]).fold(0.0, f32::max);
            cover = (cover.0 + item.rare * best, cover.1 + item.rare);
        }
        let mut back = (0.0, 0.0);
        for (word, rare) in &lesson.items {
            let best = self.near.iter().map(|near| near[*word]).fold(0.0, f32::max);
            back = (back.0 + rare * best, back.1 + rare);
        }
        let (new, new_back) = self.news(lesson);
        let verbs = self.verbs.iter().flat_map(|near| lesson.verbs.iter().map(|&v| near[v]));
        let verb = verbs.reduce(f32::max).unwrap_or(0.0);
        let shared = said.fixtures.iter().any(|fixture| lesson.fixtures.contains(fixture));
        let foreign = said.fixtures.difference(&lesson.fixtures).count().min(2);
        let about = said
            .new
            .iter()
            .flat_map(|&item| lesson.fixture_words.iter().map(move |&word| self.near[item][word]));
        weights.cosine * cosine
            + weights.rare_cosine * dot(&said.rare_whole, &lesson.rare_whole)
            + weights.cover * cover.0 / cover.1
            + weights.cover_back * back.0 / back.1
            + weights.new * new
            + weights.new_back * new_back
            + weights.verb * verb
            + weights.fixture_shared * f32::from(u8::from(shared))
            + weights.fixture_foreign * foreign as f32
            + weights.lead * (cosine - self.seed_cosine)
            + weights.length * ln(1.0 + said.length as f32)
            + weights.about_program * about.fold(0.0, f32::max)
            + weights.one
    }

    /// The best nearness of two new words, and the mean over the lesson's new words of their best
    /// nearness.
    fn news(&self, lesson: &Facts) -> (f32, f32) {
        match (self.sentence.new.is_empty(), lesson.new.is_empty()) {
            (true, true) => return (NOTHING_NEW, NOTHING_NEW),
            (false, false) => {}
            _ => return (0.0, 0.0),
        }
        let best = |word: &usize| {
            self.sentence
                .new
                .iter()
                .map(|&item| self.near[item][*word].max(0.0))
                .fold(0.0, f32::max)
        };
        let bests: Vec<f32> = lesson.new.iter().map(best).collect();
        let mean = bests.iter().fold(0.0, |sum, best| sum + best) / bests.len() as f32;
        (bests.iter().copied().fold(0.0, f32::max), mean)
    }
}

fn verbs(knowledge: &Knowledge, clause: &Clause) -> Vec<String> {
    let grammar = knowledge.grammar();
    let clauses = grammar.cut(clause);
    clauses.iter().filter_map(|c| grammar.main_verb(&c.lifted.words)).map(|v| v.word).collect()
}

/// Whether the lesson begins with the thing in the hand.
fn is_request(roles: &Roles, lesson: &Exemplar) -> bool {
    let mut acts = lesson.program.steps.iter().map(|step| &step.operator);
    acts.find(|operator| !roles.goes(operator) && !roles.is_door(operator))
        .is_some_and(|first| roles.puts(first))
}

/// The words of the fixtures that a lesson's program uses, mentioned or not.
fn fixtures(knowledge: &Knowledge, lesson: &Exemplar) -> BTreeSet<String> {
    let slots: Vec<Option<&String>> = lesson
        .utterance
        .words
        .iter()
        .filter_map(|word| match word {
            Word::Slot { fixture, .. } => Some(fixture.as_ref()),
            Word::Text(_) => None,
        })
        .collect();
    let word = |arg: &LiftedArg| match arg {
        LiftedArg::Constant(kind) => knowledge.fixtures.get(kind).cloned(),
        LiftedArg::Slot { number, .. } => {
            slots.get(*number as usize - 1).copied().flatten().cloned()
        }
        LiftedArg::Held => None,
    };
    lesson.program.steps.iter().flat_map(|step| &step.args).filter_map(word).collect()
}
