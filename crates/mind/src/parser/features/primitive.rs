use super::sentence::{Knowledge, Sentence};
use super::settings::PrimitiveWeights;
use crate::language::{Clause, Exemplar, Habits, LiftedArg, Symbol, Word};
use crate::numerics::{dot, ln};

/// Smoothing of the counts, and the number of words outside the recordings that it allows for.
const SMOOTHING: f32 = 0.3;
const VOCABULARY: f32 = 20.0;

/// Judges how likely a clause means each primitive of a world.
#[derive(Debug, Clone)]
pub(super) struct PrimitiveJudge {
    pub operators: Vec<Operator>,
    seeds: Vec<Seed>,
}

/// An operator that seeds name with a program of nothing but that operator and slots.
#[derive(Debug, Clone)]
pub(super) struct Operator {
    pub name: Symbol,
    /// Its column in the habits, if it has one.
    column: Option<usize>,
}

#[derive(Debug, Clone)]
struct Seed {
    /// Index of its operator.
    of: usize,
    number: u32,
    whole: Vec<f32>,
    verb: Option<Vec<f32>>,
}

/// What the judge found for one operator.
#[derive(Debug, Clone)]
pub(super) struct Judged {
    pub operator: usize,
    pub logit: f32,
    /// The number of its seed nearest to the clause.
    pub nearest: u32,
}

impl PrimitiveJudge {
    pub(super) fn new(knowledge: &Knowledge, seeds: &[Exemplar]) -> PrimitiveJudge {
        let mut operators: Vec<Operator> = Vec::new();
        let mut known = Vec::new();
        for (number, exemplar) in seeds.iter().enumerate() {
            let [step] = exemplar.program.steps.as_slice() else { continue };
            if !step.args.iter().all(|arg| matches!(arg, LiftedArg::Slot { .. })) {
                continue;
            }
            let name = &step.operator;
            let of = operators.iter().position(|known| known.name == *name).unwrap_or_else(|| {
                let column = knowledge.habits.order.iter().position(|other| other == name);
                operators.push(Operator { name: name.clone(), column });
                operators.len() - 1
            });
            let grammar = knowledge.grammar();
            let clauses = grammar.cut(&Clause::of(&exemplar.utterance));
            let last = clauses.last().map_or(&[][..], |clause| &clause.lifted.words);
            let verb = grammar.main_verb(last).map(|verb| knowledge.vector(&verb.word));
            let whole = knowledge.sentence(&exemplar.utterance.words).whole;
            known.push(Seed { of, number: number as u32, whole, verb });
        }
        PrimitiveJudge { operators, seeds: known }
    }

    /// The cosine to the nearest seed.
    pub(super) fn seed_cosine(&self, sentence: &Sentence) -> f32 {
        self.seeds.iter().map(|seed| dot(&seed.whole, &sentence.whole)).fold(-1.0, f32::max)
    }

    /// Every operator, likeliest first (ties: the one that seeds name first).
    pub(super) fn judge(
        &self,
        knowledge: &Knowledge,
        weights: &PrimitiveWeights,
        words: &[Word],
        sentence: &Sentence,
    ) -> Vec<Judged> {
        // The features compare an operator with the others, so there must be others.
        if self.operators.len() < 2 || sentence.items.is_empty() {
            return Vec::new();
        }
        let habits = &knowledge.habits;
        let lists = &knowledge.lists;
        let grammar = knowledge.grammar();
        let verb = grammar.main_verb(words);
        let verb_vector = verb.as_ref().map(|verb| knowledge.vector(&verb.word));
        let mut best = vec![(-1.0_f32, 0_u32); self.operators.len()];
        let mut best_verb = vec![-1.0_f32; self.operators.len()];
        for seed in &self.seeds {
            let cosine = dot(&seed.whole, &sentence.whole);
            if cosine > best[seed.of].0 {
                best[seed.of] = (cosine, seed.number);
            }
            let near = match (&seed.verb, &verb_vector) {
                (Some(own), Some(said)) => dot(own, said),
                _ => 0.0,
            };
            best_verb[seed.of] = best_verb[seed.of].max(near);
        }
        let scores = self.habit_scores(habits, &knowledge.habit_words(words, verb.as_ref()));
        let unfamiliar = words.iter().enumerate().map(|(place, word)| match word {
            Word::Text(text)
                if verb.as_ref().is_none_or(|verb| verb.at != place)
                    && text.chars().all(char::is_alphabetic)
                    && !lists.silent.contains(text)
                    && !lists.determiners.contains(text)
                    && !grammar.is_adjective(text)
                    && habits.counts(text).is_none()
                    && habits.counts(&format!("V:{text}")).is_none() =>
            {
                knowledge.weight(text)
            }
            _ => 0.0,
        });
        let unfamiliar = unfamiliar.fold(0.0, |sum, weight| sum + weight).min(3.0);
        let loud = |word: &&Word| !matches!(word, Word::Text(t) if lists.silent.contains(t));
        let length = words.iter().filter(loud).count().min(12) as f32 / 10.0;
        let named = words.iter().any(|word| matches!(word, Word::Slot { .. }));
        let verb_key = verb.as_ref().map(|verb| format!("V:{}", verb.word));
        let particle_key = verb.as_ref().map(|verb| match verb.particle.is_empty() {
            true => format!("V:{}", verb.word),
            false => format!("V:{}_{}", verb.word, verb.particle),
        });
        let log_count = |key: &Option<String>, column: Option<usize>| {
            let row = key.as_ref().and_then(|key| habits.counts(key));
            let count = row.zip(column).map_or(0, |(row, column)| row[column]);
            ln(1.0 + count as f32) / 5.0
        };
        let others = |values: &[f32], own: usize| {
            let rest = values.iter().enumerate().filter(|(other, _)| *other != own);
            rest.map(|(_, value)| *value).fold(f32::NEG_INFINITY, f32::max)
        };
        let cosines: Vec<f32> = best.iter().map(|(cosine, _)| *cosine).collect();
        let mut judged: Vec<Judged> = (0..self.operators.len())
            .map(|own| {
                let column = self.operators[own].column;
                let habit = (scores[own] - others(&scores, own)).clamp(-6.0, 6.0) / 3.0;
                let logit = weights.cosine * cosines[own]
                    + weights.verb * best_verb[own]
                    + weights.margin * (cosines[own] - others(&cosines, own))
                    + weights.verb_margin * (best_verb[own] - others(&best_verb, own))
                    + weights.length * length
                    + weights.habit * habit
                    + weights.verb_habit * log_count(&verb_key, column)
                    + weights.particle_habit * log_count(&particle_key, column)
                    + weights.unfamiliar * unfamiliar
                    + weights.nothing_named * f32::from(u8::from(!named))
                    + weights.one;
                Judged { operator: own, logit, nearest: best[own].1 }
            })
            .collect();
        judged.sort_by(|a, b| b.logit.total_cmp(&a.logit));
        judged
    }

    /// Naive Bayes: one number per operator.
    fn habit_scores(
        &self,
        habits: &Habits,
        words: &std::collections::BTreeSet<String>,
    ) -> Vec<f32> {
        let rows: Vec<&[u32]> = words.iter().filter_map(|word| habits.counts(word)).collect();
        let score = |operator: &Operator| {
            let Some(column) = operator.column else { return 0.0 };
            let clauses = habits.clauses[column] as f32;
            let all = clauses + VOCABULARY * SMOOTHING;
            let prior = 0.5 * ln(clauses.min(2000.0) + 5.0);
            rows.iter().fold(prior, |sum, row| sum + ln((row[column] as f32 + SMOOTHING) / all))
        };
        self.operators.iter().map(score).collect()
    }
}
