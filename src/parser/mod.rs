//! Lifted semantic parsing: from a lifted utterance to candidate lifted programs, or an honest
//! *not sure*.

pub mod exemplar;
pub mod features;
mod semantic;
mod words;

pub use exemplar::{Calibration, ExemplarParser, ExemplarSettings, ExemplarWeights, Figures};
pub use exemplar::{ThresholdReading, TrainFault};
pub use features::{Background, FeaturesParser, FeaturesSettings, FeaturesWeights};
pub use semantic::{Parse, Scored, SemanticParser};
pub use words::{WordTable, WordTableError};
