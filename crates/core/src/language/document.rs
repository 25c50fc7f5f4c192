use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::ids::Digest;

/// Data of a domain (a scene, a task) in a form that the rest of the house can carry, store and
/// print without knowing the domain. No floating-point numbers: domains use integer units.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Document(serde_json::Value);

impl Document {
    /// - panics: never for plain data types; a map with keys that are no strings would be a bug of
    ///   the domain.
    pub fn of<T: Serialize>(value: &T) -> Document {
        Document(serde_json::to_value(value).expect("a domain's data is plain data"))
    }

    /// - errors: the sentence of the decoder, when the document is not a `T`.
    pub fn decode<T: DeserializeOwned>(&self) -> Result<T, String> {
        T::deserialize(&self.0).map_err(|error| error.to_string())
    }

    /// BLAKE3 over the compact JSON text, whose map keys are sorted.
    pub fn digest(&self) -> Digest {
        Digest::of(self.0.to_string().as_bytes())
    }

    pub fn as_json(&self) -> &serde_json::Value {
        &self.0
    }
}
