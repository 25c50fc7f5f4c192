use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::ids::Digest;

/// A scene or a task of any world, in a form that can be carried, stored and printed without
/// knowing the world. It has no floating-point numbers: worlds use integer units.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Document(serde_json::Value);

impl Document {
    /// The value as a document.
    ///
    /// - panics: when a map of the value has keys that are not strings; that is a bug of the world.
    pub fn of<T: Serialize>(value: &T) -> Document {
        Document(serde_json::to_value(value).expect("a domain's data is plain data"))
    }

    /// The value that [`Document::of`] was given.
    ///
    /// - errors: the sentence of the decoder, when the document is not a `T`.
    pub fn decode<T: DeserializeOwned>(&self) -> Result<T, String> {
        T::deserialize(&self.0).map_err(|error| error.to_string())
    }

    /// BLAKE3 over the compact JSON text, whose map keys are sorted.
    pub fn digest(&self) -> Digest {
        Digest::of(self.0.to_string().as_bytes())
    }

    /// The value itself.
    pub fn as_json(&self) -> &serde_json::Value {
        &self.0
    }
}
