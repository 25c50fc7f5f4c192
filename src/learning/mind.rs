use crate::grounding::Moment;
use crate::ids::Digest;
use crate::language::{Answer, Exemplar, Utterance};
use crate::learning::{Lesson, Recipe, Report, TrainError};
use crate::world::Domain;

/// Parser, reranker and threshold, ready to use. A pure function of the recipe and the lessons.
#[derive(Debug)]
pub struct Mind {}

impl Mind {
    /// BLAKE3 over [`Mind::to_bytes`].
    pub fn digest(&self) -> Digest {
        unimplemented!()
    }
    pub fn recipe(&self) -> Digest {
        unimplemented!()
    }
    pub fn report(&self) -> &Report {
        unimplemented!()
    }
    pub fn to_bytes(&self) -> Vec<u8> {
        unimplemented!()
    }
    pub fn from_bytes<D: Domain>(
        _domain: &D,
        _recipe: &Recipe,
        _bytes: &[u8],
    ) -> Result<Mind, TrainError> {
        unimplemented!()
    }
    pub fn interpret<D: Domain>(&self, _moment: Moment<'_, D>, _utterance: &Utterance) -> Answer {
        unimplemented!()
    }
    /// Seeds first, then lessons in order; the lesson's index is 0-based.
    pub fn exemplars(&self) -> Vec<(Exemplar, Option<usize>)> {
        unimplemented!()
    }
    /// Another program that the lesson's lifted form already stands for: the exemplar's number.
    pub fn clash<D: Domain>(
        &self,
        _domain: &D,
        _lesson: &Lesson<D::Scene, D::Task>,
    ) -> Option<Clash> {
        unimplemented!()
    }
}

/// What a new lesson collides with.
#[derive(Debug, Clone, PartialEq)]
pub struct Clash {
    pub exemplar: Exemplar,
    /// The 0-based index of the old lesson; none for a seed.
    pub lesson: Option<usize>,
}

pub fn train<D: Domain>(
    _domain: &D,
    _recipe: &Recipe,
    _lessons: &[Lesson<D::Scene, D::Task>],
) -> Result<Mind, TrainError> {
    unimplemented!()
}

pub fn lift<D: Domain>(
    _domain: &D,
    _recipe: &Recipe,
    _lesson: &Lesson<D::Scene, D::Task>,
) -> Exemplar {
    unimplemented!()
}
