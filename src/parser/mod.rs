//! Lifted semantic parsing: from a lifted utterance to candidate lifted programs, or an honest
//! *not sure*.

mod semantic;

pub use semantic::{Parse, Scored, SemanticParser};
