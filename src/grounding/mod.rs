//! Everything that needs both the utterance and the scene: from words to *this* mug.

mod moment;

pub use moment::Moment;
