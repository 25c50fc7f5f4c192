//! Lifted semantic parsing: from a lifted utterance to candidate lifted programs, or to *not sure*.

mod backed;
pub mod exemplar;
pub mod features;
pub mod grammar;
mod ranges;
mod semantic;
pub mod seq2seq;
mod words;

pub use backed::BackedParser;
pub use exemplar::{Calibration, ExemplarParser, ExemplarSettings, ExemplarWeights, Figures};
pub use exemplar::{ThresholdReading, TrainFault};
pub use features::{Background, FeaturesParser, FeaturesSettings, FeaturesWeights};
pub use grammar::{GrammarParser, GrammarSettings, GrammarWeights};
pub use semantic::{Parse, Scored, SemanticParser};
pub use seq2seq::{Seq2SeqParser, Seq2SeqSettings, Seq2SeqWeights};
pub use words::{WordTable, WordTableError};
