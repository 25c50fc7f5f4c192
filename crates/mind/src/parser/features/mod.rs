//! The parser of recipe `default`: two judges, each a logistic regression over a few features of
//! words, with weights learned once from recorded people. Only thresholds are trained per person,
//! so a lesson is known from the moment it is taught. Source: `docs/features.md`.

mod lesson;
mod primitive;
mod sentence;
mod settings;
#[cfg(test)]
mod tests;
mod unread;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub use sentence::Background;
pub use settings::{FeaturesSettings, LessonSettings, LessonWeights, PrimitiveWeights};

use super::exemplar::{Calibration, Figures, TrainFault};
use super::{Parse, Scored, SemanticParser, WordTable};
use crate::language::{Clause, Exemplar, LiftedProgram, LiftedUtterance, Near, Roles, Word};
use crate::limits::{CANDIDATES_MAX, EVIDENCE_NEAREST_MAX};
use crate::numerics::sigmoid;
use lesson::LessonJudge;
use primitive::{Judged, PrimitiveJudge};
use sentence::{Knowledge, Sentence};

/// A primitive this much (in logits) less likely than the likeliest one was not meant, even if the
/// world does not allow the likeliest.
const RIVAL_WITHIN: f32 = 2.5;
/// A verb that people used at least so often for going somewhere may stand without a goal.
const MOVES_MIN: u32 = 3;

/// What a training found. Settings, word table, exemplars and these weights make the parser.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeaturesWeights {
    /// A primitive is understood from this probability on.
    pub threshold: f32,
    /// Per lesson the probability from which on an utterance asks for the same.
    pub lessons: Vec<f32>,
}

/// Compares each clause with the primitives, and each utterance with the lessons.
#[derive(Debug, Clone)]
pub struct FeaturesParser {
    settings: FeaturesSettings,
    knowledge: Knowledge,
    roles: Roles,
    exemplars: Vec<Exemplar>,
    seeds: usize,
    /// Exemplar numbers by lifted form without determiners, oldest first.
    by_form: BTreeMap<Vec<Word>, Vec<u32>>,
    primitives: PrimitiveJudge,
    lessons: LessonJudge,
    weights: FeaturesWeights,
}

impl FeaturesParser {
    /// Sets the thresholds from `calibration` and the seeds. A pure function.
    ///
    /// - `seeds`: how many of the examples, from the first, are seeds.
    pub fn train(
        settings: &FeaturesSettings,
        words: &'static WordTable,
        background: Background<'_>,
        examples: &[Exemplar],
        seeds: usize,
        calibration: Calibration<'_>,
    ) -> Result<(FeaturesParser, Figures), TrainFault> {
        let lessons = vec![settings.lesson_max; examples.len().saturating_sub(seeds)];
        let weights = FeaturesWeights { threshold: settings.threshold_max, lessons };
        let mut parser =
            FeaturesParser::restore(settings, words, background, examples, seeds, weights)?;
        let figures = parser.calibrate(calibration);
        Ok((parser, figures))
    }

    /// The parser that `weights` came from, given the same settings, table and exemplars.
    ///
    /// - errors: exemplars or weights that cannot belong together.
    pub fn restore(
        settings: &FeaturesSettings,
        words: &'static WordTable,
        background: Background<'_>,
        examples: &[Exemplar],
        seeds: usize,
        weights: FeaturesWeights,
    ) -> Result<FeaturesParser, TrainFault> {
        if examples.is_empty() {
            return Err(TrainFault::NoExemplars);
        }
        if let Some(number) = examples.iter().position(|e| e.utterance.words.is_empty()) {
            return Err(TrainFault::NoWords { number });
        }
        let taught = examples.len().saturating_sub(seeds);
        let probability = |p: &f32| (0.0..=1.0).contains(p);
        let fits = weights.lessons.len() == taught
            && weights.lessons.iter().chain([&weights.threshold]).all(probability);
        if !fits {
            let found = weights.lessons.len();
            let reason =
                format!("{found} thresholds for {taught} lessons, each expected between 0 and 1");
            return Err(TrainFault::Weights { reason });
        }
        let knowledge = Knowledge::new(words, background);
        let seeds = seeds.min(examples.len());
        let primitives = PrimitiveJudge::new(&knowledge, &examples[..seeds]);
        let roles = background.roles.clone();
        let lessons = LessonJudge::new(&knowledge, &roles, &examples[seeds..]);
        let mut by_form: BTreeMap<Vec<Word>, Vec<u32>> = BTreeMap::new();
        for (number, exemplar) in examples.iter().enumerate() {
            let form = form(&knowledge, &exemplar.utterance);
            by_form.entry(form).or_default().push(number as u32);
        }
        Ok(FeaturesParser {
            settings: settings.clone(),
            knowledge,
            roles,
            exemplars: examples.to_vec(),
            seeds,
            by_form,
            primitives,
            lessons,
            weights,
        })
    }

    /// Primitives: above 95 % of the requests that no exemplar covers. Lessons: above every seed
    /// and every variant of one. Both within the limits of the settings.
    fn calibrate(&mut self, calibration: Calibration<'_>) -> Figures {
        let settings = self.settings.clone();
        let mut unknown: Vec<f32> =
            calibration.unknown.iter().map(|utterance| self.surest(utterance).1).collect();
        unknown.sort_by(f32::total_cmp);
        let high = unknown.get(unknown.len() * 95 / 100).copied().unwrap_or(0.0);
        self.weights.threshold = high.clamp(settings.threshold_min, settings.threshold_max);

        let seeds: Vec<&LiftedUtterance> =
            self.exemplars[..self.seeds].iter().map(|seed| &seed.utterance).collect();
        let variants = calibration.variants.iter().map(|variant| &variant.utterance);
        let mut highest = vec![settings.lesson_min; self.weights.lessons.len()];
        for utterance in variants.chain(seeds) {
            let clause = Clause::of(utterance);
            let sentence = self.knowledge.sentence(&utterance.words);
            for (highest, p) in highest.iter_mut().zip(self.lesson_scores(&clause, &sentence)) {
                *highest = highest.max(p).min(settings.lesson_max);
            }
        }
        self.weights.lessons = highest;

        let threshold = self.weights.threshold;
        let right = |exemplar: &&Exemplar| {
            let (operator, p) = self.surest(&exemplar.utterance);
            let step = exemplar.program.steps.first().map(|step| step.operator.as_str());
            p >= threshold && operator.is_some() && operator == step
        };
        let share = |count: usize, of: usize| count as f64 / of.max(1) as f64;
        let heard = calibration.variants.iter().filter(right).count();
        let accepted = unknown.iter().filter(|p| **p >= threshold).count();
        let lessons = &self.weights.lessons;
        let mean =
            lessons.iter().fold(0.0, |sum, t| sum + f64::from(*t)) / lessons.len().max(1) as f64;
        Figures::from([
            ("lesson_threshold".to_owned(), mean),
            ("unknown_accepted".to_owned(), share(accepted, unknown.len())),
            ("variants_understood".to_owned(), share(heard, calibration.variants.len())),
        ])
    }

    /// The surest operator of the last clause, and how sure all clauses are.
    fn surest(&self, utterance: &LiftedUtterance) -> (Option<&str>, f32) {
        let clauses = self.knowledge.grammar().cut(&Clause::of(utterance));
        let mut found = (None, 1.0);
        for clause in clauses {
            let sentence = self.knowledge.sentence(&clause.lifted.words);
            let judged = self.judge(&clause, &sentence);
            let Some(best) = judged.first() else { return (None, 0.0) };
            let name = self.primitives.operators[best.operator].name.as_str();
            found = (Some(name), found.1 * sigmoid(best.logit));
        }
        found
    }

    /// What training found.
    pub fn weights(&self) -> &FeaturesWeights {
        &self.weights
    }

    /// The exemplars, in the order of training. A [`Scored::number`] is a place in this list.
    pub fn exemplars(&self) -> &[Exemplar] {
        &self.exemplars
    }

    /// The distance, 1 − probability, up to which a reading counts.
    pub fn threshold(&self) -> f32 {
        1.0 - self.weights.threshold
    }

    /// The exemplars of this lifted form, determiners aside, oldest first.
    pub fn exact(&self, lifted: &LiftedUtterance) -> &[u32] {
        let mut form = form(&self.knowledge, lifted);
        let known = self.by_form.get(&form).map_or(&[][..], Vec::as_slice);
        if !known.is_empty() || !self.settings.seeds_of_any_fixture {
            return known;
        }
        for word in &mut form {
            if let Word::Slot { fixture, .. } = word {
                *fixture = None;
            }
        }
        let known = self.by_form.get(&form).map_or(&[][..], Vec::as_slice);
        let seeds = known.iter().take_while(|number| (**number as usize) < self.seeds).count();
        &known[..seeds]
    }

    fn judge(&self, clause: &Clause, sentence: &Sentence) -> Vec<Judged> {
        let words = &clause.lifted.words;
        let mut judged =
            self.primitives.judge(&self.knowledge, &self.settings.primitive, words, sentence);
        let verb = self.knowledge.grammar().main_verb(words);
        let unread = self.knowledge.unread(words, verb.as_ref());
        judged.iter_mut().for_each(|judged| judged.logit += self.settings.unread * unread as f32);
        judged
    }

    fn lesson_scores(&self, clause: &Clause, sentence: &Sentence) -> Vec<f32> {
        let seed_cosine = self.primitives.seed_cosine(sentence);
        let weights = &self.settings.lesson;
        self.lessons.judge(&self.knowledge, weights, clause, sentence, seed_cosine)
    }

    /// A lesson's probability as a distance that the common threshold divides where the lesson's
    /// own threshold divides the probability.
    fn lesson_distance(&self, lesson: usize, p: f32) -> f32 {
        let (own, common) = (self.weights.lessons[lesson], self.weights.threshold);
        match p >= own {
            true => (1.0 - common) * (1.0 - p) / (1.0 - own),
            false => 1.0 - common * p / own,
        }
    }

    /// The readings of one clause as a primitive, likeliest first.
    fn primitive_offers(&self, clause: &Clause, judged: &[Judged], threshold: f32) -> Vec<Scored> {
        let Some(top) = judged.first() else { return Vec::new() };
        let operator = &self.primitives.operators[top.operator].name;
        let nothing_named = clause.lifted.slots() == 0;
        let idle = |distance| Scored {
            program: LiftedProgram { steps: Vec::new() },
            distance,
            number: top.nearest,
            open: true,
            by: None,
        };
        if nothing_named && self.moves(clause, self.roles.goes(operator)) {
            return vec![idle(0.0)];
        }
        let mut offers: Vec<Scored> = judged
            .iter()
            .filter(|judged| top.logit - judged.logit <= RIVAL_WITHIN)
            .map(|judged| Scored {
                program: self.exemplars[judged.nearest as usize].program.clone(),
                distance: 1.0 - sigmoid(judged.logit),
                number: judged.nearest,
                open: true,
                by: None,
            })
            .filter(|scored| scored.distance <= threshold)
            .collect();
        // A landmark on the way that is not here, and "close the door" where nothing is open, hold
        // up nothing else that was said.
        let landmark = clause.mentions.iter().any(|mention| !mention.pronoun);
        if (landmark && self.roles.goes(operator))
            || (nothing_named && self.roles.is_door(operator))
        {
            let distance = 1.0 - sigmoid(top.logit);
            offers.extend(Some(idle(distance)).filter(|_| distance <= threshold));
        }
        offers
    }

    /// "Turn around": nothing that a primitive could do.
    ///
    /// - `goes`: whether it is likeliest to mean going somewhere.
    fn moves(&self, clause: &Clause, goes: bool) -> bool {
        let verb = self.knowledge.grammar().main_verb(&clause.lifted.words);
        verb.is_some_and(|verb| {
            let habits = &self.knowledge.habits;
            let column = habits.order.iter().position(|name| self.roles.goes(name));
            let row = habits.counts(&format!("V:{}", verb.word));
            let often = row.zip(column).is_some_and(|(row, column)| row[column] >= MOVES_MIN);
            let listed = self.knowledge.lists.moving.contains(&verb.word);
            // "Turn on" is about something, though it may not be named.
            if goes { often || listed } else { listed && verb.particle.is_empty() }
        })
    }

    fn near(&self, number: u32, distance: f32) -> Near {
        let Exemplar { utterance, program } = self.exemplars[number as usize].clone();
        Near { exemplar: utterance, program, distance, number }
    }
}

/// The words of a lifted form that count when two are compared.
fn form(knowledge: &Knowledge, lifted: &LiftedUtterance) -> Vec<Word> {
    let counts = |word: &&Word| !matches!(word, Word::Text(text) if knowledge.lists.determiners.contains(text));
    lifted.words.iter().filter(counts).cloned().collect()
}

impl FeaturesParser {
    /// As [`SemanticParser::parse`], with another threshold in the place of its own: the same
    /// distances, held against another number.
    pub fn parse_within(&self, clause: &Clause, threshold: f32) -> Parse {
        let lifted = &clause.lifted;
        if lifted.words.is_empty() {
            return Parse { threshold, ..Parse::default() };
        }
        let sentence = self.knowledge.sentence(&lifted.words);
        let exact = self.exact(lifted);
        let mut deciding: Vec<Scored> = Vec::new();
        for &number in exact {
            let program = self.exemplars[number as usize].program.clone();
            deciding.push(Scored { program, distance: 0.0, number, open: false, by: None });
        }
        let mut offers = Vec::new();
        let mut nearest: Vec<(u32, f32)> = exact.iter().map(|&number| (number, 0.0)).collect();
        for (lesson, p) in self.lesson_scores(clause, &sentence).into_iter().enumerate() {
            let number = (self.seeds + lesson) as u32;
            if exact.contains(&number) {
                continue;
            }
            let distance = self.lesson_distance(lesson, p);
            nearest.push((number, distance));
            if distance > threshold {
                continue;
            }
            let program = self.exemplars[number as usize].program.clone();
            let scored = Scored { program, distance, number, open: true, by: None };
            match exact.is_empty() && p >= self.settings.lesson_decides {
                true => deciding.push(scored),
                false => offers.push(scored),
            }
        }
        // Of several clauses each is judged by itself.
        let clauses = self.knowledge.grammar().cut(clause);
        if clauses.len() == 1 && clauses[0].lifted.words.len() == lifted.words.len() {
            let judged = self.judge(clause, &sentence);
            let distances = judged.iter().map(|j| (j.nearest, 1.0 - sigmoid(j.logit)));
            nearest.extend(distances.filter(|(number, _)| !exact.contains(number)));
            offers.extend(self.primitive_offers(clause, &judged, threshold));
        }
        // Stable: at equal distance lessons come before primitives, the older before the newer.
        deciding.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        offers.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        nearest.sort_by(|a, b| a.1.total_cmp(&b.1));
        let mut candidates: Vec<Scored> = Vec::new();
        let mut exact = 0;
        let count = deciding.len();
        for (place, scored) in deciding.into_iter().chain(offers).enumerate() {
            let same =
                |known: &Scored| known.program == scored.program && known.open == scored.open;
            if candidates.len() < CANDIDATES_MAX && !candidates.iter().any(same) {
                candidates.push(scored);
                exact += usize::from(place < count);
            }
        }
        nearest.truncate(EVIDENCE_NEAREST_MAX);
        let nearest = nearest.into_iter().map(|(number, far)| self.near(number, far)).collect();
        Parse { candidates, nearest, threshold, exact }
    }
}

impl SemanticParser for FeaturesParser {
    fn parse(&self, clause: &Clause) -> Parse {
        self.parse_within(clause, self.threshold())
    }

    /// All clauses must be understood: their probabilities multiply.
    fn chain(&self, so_far: f32, next: f32) -> f32 {
        1.0 - (1.0 - so_far) * (1.0 - next)
    }

    fn sure_of_order(&self) -> bool {
        true
    }
}
