//! From an utterance and a scene to a program about certain things: from words to *this* mug.
//!
//! [`Interpreter::interpret`] is the pipeline: abstract, parse, resolve, combine, keep what runs,
//! rerank.

mod abstractor;
mod accounting;
mod arguments;
mod asking;
#[cfg(test)]
pub(crate) mod bench;
mod carrying;
mod chosen;
mod combine;
mod fill;
mod frames;
mod interpret;
mod moment;
mod mood;
mod names;
mod passed_over;
mod pointing;
mod purpose;
mod rerank_training;
mod reranker;
mod resolver;
mod run;
mod settings;
#[cfg(test)]
mod tests;
mod verbs;

pub use abstractor::{Abstracted, Abstractor, without_locations};
pub(crate) use asking::listed;
pub use combine::{Candidate, Verdict};
pub use interpret::Interpreter;
pub use moment::Moment;
pub(crate) use names::Names;
pub use rerank_training::{Choice, RerankerFigures};
pub use reranker::{Featured, Reranker, RerankerSettings, RerankerWeights, featured};
pub use resolver::{Referents, resolve};
pub use settings::{Abstraction, Execution, Split};
