use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::parser::TrainFault;
use crate::parser::ranges::{size, within};

/// Every choice of the sequence-to-sequence parser. Two equal settings, word tables and lists of
/// exemplars give the same parser, bit for bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Seq2SeqSettings {
    /// Units of each of the three LSTMs: the encoder's two directions and the decoder.
    pub units: usize,
    /// Numbers per token in the input of the decoder.
    pub token: usize,
    /// How far a step goes.
    pub learning_rate: f32,
    /// Gradients longer than this are shortened to it.
    pub clip: f32,
    /// Examples per step.
    pub batch: usize,
    /// The most passes over all examples.
    pub epochs_max: usize,
    /// Training ends when no example that can be learned costs more than this, in nats for its
    /// whole program.
    pub stop_loss: f32,
    /// Programs that the search for the likeliest keeps at once.
    pub beam: usize,
    /// The word whose vector stands for a sort; else the sort's own name.
    pub slot_words: BTreeMap<String, String>,
    /// Word vectors are multiplied by this.
    pub word_scale: f32,
    /// Mixed into the training seed.
    pub salt: String,
}

impl Default for Seq2SeqSettings {
    /// Jia and Liang (2016), made smaller: for dozens of short sentences, not hundreds.
    fn default() -> Seq2SeqSettings {
        Seq2SeqSettings {
            units: 32,
            token: 16,
            learning_rate: 0.01,
            clip: 5.0,
            batch: 16,
            epochs_max: 300,
            stop_loss: 0.1,
            beam: 3,
            slot_words: BTreeMap::from([("obj".to_owned(), "object".to_owned())]),
            word_scale: 1.0,
            salt: String::new(),
        }
    }
}

impl Seq2SeqSettings {
    /// Checks every value.
    ///
    /// - errors: [`TrainFault::Setting`], a value that no training can use.
    pub fn check(&self) -> Result<(), TrainFault> {
        size("units", self.units, 512)?;
        size("token", self.token, 512)?;
        size("batch", self.batch, 1_024)?;
        size("epochs_max", self.epochs_max, 10_000)?;
        size("beam", self.beam, 32)?;
        within("learning_rate", self.learning_rate, 1e-9, 1.0)?;
        within("clip", self.clip, 1e-3, 1e6)?;
        within("stop_loss", self.stop_loss, 0.0, 100.0)?;
        within("word_scale", self.word_scale, 0.0, 1e3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_impossible_setting_is_refused_by_name() {
        assert_eq!(Seq2SeqSettings::default().check(), Ok(()));
        let bad = Seq2SeqSettings { beam: 0, ..Seq2SeqSettings::default() };
        assert_eq!(
            bad.check().unwrap_err().to_string(),
            "the parser setting beam is 0; allowed is between 1 and 32"
        );
        let bad = Seq2SeqSettings { clip: f32::NAN, ..Seq2SeqSettings::default() };
        assert!(bad.check().is_err());
        assert!(serde_json::from_str::<Seq2SeqSettings>(r#"{"beems": 3}"#).is_err());
    }
}
