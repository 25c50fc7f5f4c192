use std::fmt;
use std::ops::{Deref, DerefMut};

use serde::de::{self, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Learned numbers. Stored as little-endian bytes, four per number, so that what is read back has
/// the bits that were written and a digest over the bytes is a digest over the bits.
#[derive(Clone, PartialEq, Default)]
pub struct Floats(pub Vec<f32>);

impl Floats {
    /// So many zeros.
    pub fn zeros(count: usize) -> Floats {
        Floats(vec![0.0; count])
    }

    /// Whether no number is infinite or NaN.
    pub fn all_finite(&self) -> bool {
        self.0.iter().all(|value| value.is_finite())
    }
}

impl Deref for Floats {
    type Target = [f32];
    fn deref(&self) -> &[f32] {
        &self.0
    }
}

impl DerefMut for Floats {
    fn deref_mut(&mut self) -> &mut [f32] {
        &mut self.0
    }
}

impl fmt::Debug for Floats {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Floats({} numbers)", self.0.len())
    }
}

impl Serialize for Floats {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let bytes: Vec<u8> = self.0.iter().flat_map(|value| value.to_le_bytes()).collect();
        serializer.serialize_bytes(&bytes)
    }
}

impl<'de> Deserialize<'de> for Floats {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Floats, D::Error> {
        struct Bytes;
        impl<'de> Visitor<'de> for Bytes {
            type Value = Floats;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("bytes, four for each number")
            }
            fn visit_bytes<E: de::Error>(self, bytes: &[u8]) -> Result<Floats, E> {
                let chunks = bytes.chunks_exact(4);
                if !chunks.remainder().is_empty() {
                    return Err(E::invalid_length(bytes.len(), &self));
                }
                let read =
                    |four: &[u8]| f32::from_le_bytes(four.try_into().expect("chunks of four"));
                Ok(Floats(chunks.map(read).collect()))
            }
            // Formats without bytes, JSON for one, write them as a list of numbers.
            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Floats, A::Error> {
                let mut bytes = Vec::new();
                while let Some(byte) = list.next_element::<u8>()? {
                    bytes.push(byte);
                }
                self.visit_bytes(&bytes)
            }
        }
        deserializer.deserialize_bytes(Bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_with_their_bits() {
        let floats = Floats(vec![0.1, -0.0, f32::MIN_POSITIVE / 2.0, f32::INFINITY]);
        let text = serde_json::to_string(&floats).unwrap();
        let back: Floats = serde_json::from_str(&text).unwrap();
        let bits = |floats: &Floats| floats.iter().map(|f| f.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&back), bits(&floats));
        assert!(serde_json::from_str::<Floats>("[1,2,3]").is_err());
    }
}
