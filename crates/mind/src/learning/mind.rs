use super::bundle::{self, Bundle};
use super::parsing::AnyParser;
use super::{Recipe, Report, TrainError};
use crate::grounding::{Interpreter, Moment, Reranker};
use crate::ids::Digest;
use crate::language::{Answer, Exemplar, Utterance};
use crate::world::{Features, Words};

/// Parser, reranker and threshold, ready to use. A pure function of the recipe and the lessons.
#[derive(Debug, Clone)]
pub struct Mind {
    pub(super) recipe: Recipe,
    pub(super) parser: AnyParser,
    /// None before the first lesson.
    pub(super) reranker: Option<Reranker>,
    /// How many of the exemplars, from the first, are seeds.
    pub(super) seeds: u32,
    pub(super) report: Report,
    digest: Digest,
}

impl Mind {
    pub(super) fn new(
        recipe: Recipe,
        parser: AnyParser,
        reranker: Option<Reranker>,
        seeds: u32,
        report: Report,
    ) -> Mind {
        let digest = Digest::ZERO;
        let mut mind = Mind { recipe, parser, reranker, seeds, report, digest };
        mind.digest = Digest::of(&mind.to_bytes());
        mind
    }

    /// BLAKE3 over [`Mind::to_bytes`].
    pub fn digest(&self) -> Digest {
        self.digest
    }

    /// The digest of the recipe it was trained with.
    pub fn recipe(&self) -> Digest {
        self.recipe.digest()
    }

    /// What its training measured.
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// Everything that training found, in MessagePack; see [`Mind::from_bytes`]. The word table
    /// and the recipe's settings are not in it.
    pub fn to_bytes(&self) -> Vec<u8> {
        bundle::encode(&Bundle {
            version: Bundle::VERSION,
            recipe: self.recipe.digest(),
            seeds: self.seeds,
            exemplars: self.parser.exemplars().to_vec(),
            parser: self.parser.weights(),
            reranker: self.reranker.as_ref().map(|reranker| reranker.weights().clone()),
            report: self.report.clone(),
        })
    }

    /// The mind that [`Mind::to_bytes`] wrote, with the same digest.
    ///
    /// - errors: bytes that are not a mind, of another version, of another recipe or other seeds,
    ///   or whose parts do not fit together. Never panics, whatever the bytes.
    pub fn from_bytes<D: Words + Features>(
        domain: &D,
        recipe: &Recipe,
        bytes: &[u8],
    ) -> Result<Mind, TrainError> {
        let Bundle { version: _, recipe: of, seeds, exemplars, parser, reranker, report } =
            bundle::decode(bytes)?;
        if of != recipe.digest() {
            let reason = format!(
                "the mind was trained with the recipe {}, not with {} ({})",
                of.short(),
                recipe.digest().short(),
                recipe.name()
            );
            return Err(TrainError::Unreadable { reason });
        }
        let known = &domain.seeds().exemplars;
        if seeds as usize != known.len() || exemplars.get(..known.len()) != Some(&known[..]) {
            let reason = format!("the mind was trained on other seeds than the {}'s", domain.id());
            return Err(TrainError::Unreadable { reason });
        }
        let parser = AnyParser::restore(recipe, domain, &exemplars, parser)?;
        let features = domain.feature_count();
        let restore = |weights| Reranker::restore(recipe.words(), weights, features);
        let reranker = reranker.map(restore).transpose();
        let reranker = reranker.map_err(|reason| TrainError::Unreadable { reason })?;
        let mind = Mind::new(recipe.clone(), parser, reranker, seeds, report);
        // A second encoding of the same mind would have a second digest.
        if mind.digest != Digest::of(bytes) {
            let reason = "the bytes are no mind as this binary writes it".to_owned();
            return Err(TrainError::Unreadable { reason });
        }
        Ok(mind)
    }

    /// What the utterance asks for at this moment; see [`Interpreter::interpret`].
    pub fn interpret<D: Words + Features>(
        &self,
        moment: Moment<'_, D>,
        utterance: &Utterance,
    ) -> Answer {
        let known = |word: &str| self.recipe.words().lookup(word).is_some();
        self.interpreter(&known).interpret(&moment, utterance)
    }

    /// [`Mind::interpret`] with another threshold than the mind's own. Weights, exemplars and
    /// reranker stay as they are. For questions about the past; no user is answered with it.
    ///
    /// - `threshold`: in the unit of the parser's distances.
    /// - returns: none when the parser has no threshold.
    pub fn interpret_within<D: Words + Features>(
        &self,
        moment: Moment<'_, D>,
        utterance: &Utterance,
        threshold: f32,
    ) -> Option<Answer> {
        let parser = self.parser.within(threshold)?;
        let known = |word: &str| self.recipe.words().lookup(word).is_some();
        Some(self.interpreter_of(&parser, &known).interpret(&moment, utterance))
    }

    pub(super) fn interpreter<'a>(
        &'a self,
        known: &'a dyn Fn(&str) -> bool,
    ) -> Interpreter<'a, AnyParser> {
        self.interpreter_of(&self.parser, known)
    }

    fn interpreter_of<'a, P>(
        &'a self,
        parser: &'a P,
        known: &'a dyn Fn(&str) -> bool,
    ) -> Interpreter<'a, P> {
        let settings = self.recipe.settings();
        Interpreter {
            abstraction: &settings.abstraction,
            execution: &settings.execution,
            parser,
            known,
            reranker: self.reranker.as_ref(),
            seeds: self.seeds,
            edition: settings.words.edition,
            ask_below: settings.dialogue.as_ref().map_or(0, |dialogue| dialogue.which_below),
        }
    }

    /// The exemplars: seeds first, then lessons in order, each with its 0-based number.
    pub fn exemplars(&self) -> Vec<(Exemplar, Option<usize>)> {
        let numbered = self.parser.exemplars().iter().enumerate();
        numbered.map(|(number, exemplar)| (exemplar.clone(), self.lesson_of(number))).collect()
    }

    fn lesson_of(&self, number: usize) -> Option<usize> {
        number.checked_sub(self.seeds as usize)
    }
}
