use std::sync::OnceLock;

use crate::ids::Digest;
use crate::numerics::Rng;

/// Word vectors: what is known about words before anybody has taught anything.
///
/// Little-endian: magic `APWT`, `u32` version 1, `u32` dims, `u32` count; then `count` words in
/// byte order, each a `u8` length and its UTF-8; then a scale per word (`f32`; entry = byte ×
/// scale); then each word's relative frequency (`f32`); then `count × dims` signed bytes.
pub struct WordTable {
    dims: usize,
    /// End of each word in `text`; the words stand one after another.
    ends: Vec<u32>,
    text: String,
    scales: Vec<f32>,
    frequencies: Vec<f32>,
    entries: Vec<i8>,
    /// The mean length of a vector; hashed vectors of unknown words get it too.
    typical_norm: f32,
    /// The frequency of the rarest word.
    rarest: f32,
    digest: Digest,
}

/// Why bytes are not a word table.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WordTableError {
    /// The bytes do not begin with the magic.
    #[error("no word table: it starts with {found:02x?}, expected the letters APWT")]
    Magic {
        /// The first four bytes.
        found: Vec<u8>,
    },
    /// Another version wrote them.
    #[error("word table of version {found}; this build reads version {}", WordTable::VERSION)]
    Version {
        /// Its number.
        found: u32,
    },
    /// There are too few bytes.
    #[error("the word table ends early: {what} needs {needed} bytes, {left} are left")]
    Short {
        /// The part that is cut off.
        what: &'static str,
        /// Bytes of that part.
        needed: usize,
        /// Bytes that are there.
        left: usize,
    },
    /// There are too many bytes.
    #[error("the word table has {extra} bytes too many")]
    Long {
        /// How many too many.
        extra: usize,
    },
    /// A word is not UTF-8.
    #[error("word {index} of the word table is not UTF-8")]
    Text {
        /// 0-based.
        index: usize,
    },
    /// The words are not sorted, or one is there twice.
    #[error("word {index} of the word table, {word:?}, is not after its predecessor in byte order")]
    Order {
        /// 0-based.
        index: usize,
        /// The word.
        word: String,
    },
    /// A number of a word is not one that a table may have.
    #[error("word {word:?} of the word table has the {what} {value}")]
    Value {
        /// The word.
        word: String,
        /// `scale` or `frequency`.
        what: &'static str,
        /// The number.
        value: String,
    },
    /// There is nothing in the table.
    #[error("a word table of {dims} dimensions and {count} words; both must be at least 1")]
    Empty {
        /// Numbers per vector.
        dims: u32,
        /// Words.
        count: u32,
    },
}

impl WordTable {
    /// The version of the form that this build reads.
    pub const VERSION: u32 = 1;

    /// The built-in table with this name.
    pub fn builtin(name: &str) -> Option<&'static WordTable> {
        static PAPER: OnceLock<WordTable> = OnceLock::new();
        static DEFAULT: OnceLock<WordTable> = OnceLock::new();
        let (table, bytes): (_, &[u8]) = match name {
            "paper" => (&PAPER, include_bytes!("../../data/words/paper.words")),
            "default" => (&DEFAULT, include_bytes!("../../data/words/default.words")),
            _ => return None,
        };
        let read = || WordTable::parse(bytes).expect("a test reads every table that ships");
        Some(table.get_or_init(read))
    }

    /// Reads a table.
    ///
    /// - errors: [`WordTableError`], bytes in another form.
    pub fn parse(bytes: &[u8]) -> Result<WordTable, WordTableError> {
        let mut rest = Reader { rest: bytes };
        let magic = rest.take("the magic", 4)?;
        if magic != b"APWT" {
            return Err(WordTableError::Magic { found: magic.to_vec() });
        }
        let version = rest.number("the version")?;
        if version != WordTable::VERSION {
            return Err(WordTableError::Version { found: version });
        }
        let (dims, count) = (rest.number("the dimensions")?, rest.number("the word count")?);
        if dims == 0 || count == 0 {
            return Err(WordTableError::Empty { dims, count });
        }
        let (dims, count) = (dims as usize, count as usize);
        let mut ends: Vec<u32> = Vec::new();
        let mut text = String::new();
        let mut previous: &str = "";
        for index in 0..count {
            let length = rest.take("the length of a word", 1)?[0] as usize;
            let word = rest.take("a word", length)?;
            let word = std::str::from_utf8(word).map_err(|_| WordTableError::Text { index })?;
            if word <= previous {
                return Err(WordTableError::Order { index, word: word.to_owned() });
            }
            text.push_str(word);
            ends.push(text.len() as u32);
            previous = word;
        }
        let scales = rest.floats("the scales", count)?;
        let frequencies = rest.floats("the frequencies", count)?;
        // Saturating: the bytes never have so large a size.
        let entries = rest.take("the entries", count.saturating_mul(dims))?;
        let entries: Vec<i8> = entries.iter().map(|&byte| byte as i8).collect();
        if !rest.rest.is_empty() {
            return Err(WordTableError::Long { extra: rest.rest.len() });
        }
        let digest = Digest::of(bytes);
        let rarest = frequencies.iter().copied().fold(1.0, f32::min);
        let mut table = WordTable {
            dims,
            ends,
            text,
            scales,
            frequencies,
            entries,
            typical_norm: 0.0,
            rarest,
            digest,
        };
        table.check_values()?;
        table.typical_norm = table.mean_norm();
        Ok(table)
    }

    fn check_values(&self) -> Result<(), WordTableError> {
        for index in 0..self.ends.len() {
            let bad = |what, value: f32| {
                let (word, value) = (self.word(index).to_owned(), value.to_string());
                Err(WordTableError::Value { word, what, value })
            };
            let (scale, frequency) = (self.scales[index], self.frequencies[index]);
            if !scale.is_finite() || scale < 0.0 {
                return bad("scale", scale);
            }
            if !(0.0..=1.0).contains(&frequency) {
                return bad("frequency", frequency);
            }
        }
        Ok(())
    }

    fn mean_norm(&self) -> f32 {
        let norm = |(row, &scale): (&[i8], &f32)| {
            // Whole numbers, so exact in any order.
            let square: i64 = row.iter().map(|&entry| (entry as i64).pow(2)).sum();
            (square as f64).sqrt() * scale as f64
        };
        let total: f64 = self.entries.chunks_exact(self.dims).zip(&self.scales).map(norm).sum();
        (total / self.ends.len() as f64) as f32
    }

    /// BLAKE3 over the file's bytes.
    pub fn digest(&self) -> Digest {
        self.digest
    }

    /// Numbers per vector.
    pub fn dims(&self) -> usize {
        self.dims
    }

    /// How many words there are.
    pub fn count(&self) -> usize {
        self.ends.len()
    }

    /// The word at a 0-based place.
    ///
    /// - panics: `index` is not below [`WordTable::count`].
    pub fn word(&self, index: usize) -> &str {
        let start = if index == 0 { 0 } else { self.ends[index - 1] };
        &self.text[start as usize..self.ends[index] as usize]
    }

    /// The 0-based place of a word; none if the table does not have it.
    pub fn lookup(&self, word: &str) -> Option<usize> {
        let (mut low, mut high) = (0, self.count());
        while low < high {
            let middle = low + (high - low) / 2;
            match self.word(middle).cmp(word) {
                std::cmp::Ordering::Equal => return Some(middle),
                std::cmp::Ordering::Less => low = middle + 1,
                std::cmp::Ordering::Greater => high = middle,
            }
        }
        None
    }

    /// Writes the word's vector to `out`, `[dims]`.
    ///
    /// A word that is not in the table gets a vector of typical length, made from its hash: an
    /// unknown word is far from all others, and equal to itself. It is never zero, which would make
    /// the word invisible.
    ///
    /// - panics: `out` does not have `dims` numbers.
    pub fn write_vector(&self, word: &str, out: &mut [f32]) {
        assert_eq!(out.len(), self.dims, "room for one vector");
        match self.lookup(word) {
            Some(index) => {
                let row = &self.entries[index * self.dims..][..self.dims];
                let scale = self.scales[index];
                out.iter_mut().zip(row).for_each(|(x, &entry)| *x = entry as f32 * scale);
            }
            None => self.write_hashed(word, out),
        }
    }

    /// See [`WordTable::write_vector`].
    pub fn vector(&self, word: &str) -> Vec<f32> {
        let mut out = vec![0.0; self.dims];
        self.write_vector(word, &mut out);
        out
    }

    /// How often the word is among all words of the table's source, between 0 and 1; for a word
    /// that the table lacks, the frequency of the rarest word.
    pub fn frequency(&self, word: &str) -> f32 {
        match self.lookup(word) {
            Some(index) => self.frequencies[index],
            None => self.rarest,
        }
    }

    fn write_hashed(&self, word: &str, out: &mut [f32]) {
        let seed = blake3::derive_key("apprentice 2026 vector of an unknown word", word.as_bytes());
        let mut rng = Rng::from_digest(Digest(seed));
        out.iter_mut().for_each(|x| *x = rng.normal());
        crate::numerics::normalise(out);
        out.iter_mut().for_each(|x| *x *= self.typical_norm);
    }
}

impl std::fmt::Debug for WordTable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "WordTable({} words × {}, {})", self.count(), self.dims, self.digest.short())
    }
}

struct Reader<'b> {
    rest: &'b [u8],
}

impl<'b> Reader<'b> {
    fn take(&mut self, what: &'static str, needed: usize) -> Result<&'b [u8], WordTableError> {
        let left = self.rest.len();
        if needed > left {
            return Err(WordTableError::Short { what, needed, left });
        }
        let (taken, rest) = self.rest.split_at(needed);
        self.rest = rest;
        Ok(taken)
    }

    fn number(&mut self, what: &'static str) -> Result<u32, WordTableError> {
        let bytes = self.take(what, 4)?;
        Ok(u32::from_le_bytes(bytes.try_into().expect("four bytes were taken")))
    }

    fn floats(&mut self, what: &'static str, count: usize) -> Result<Vec<f32>, WordTableError> {
        let bytes = self.take(what, count.saturating_mul(4))?;
        let read = |four: &[u8]| f32::from_le_bytes(four.try_into().expect("chunks of four"));
        Ok(bytes.chunks_exact(4).map(read).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::{cosine, norm};

    /// `chill` (2, 4), `mug` (−6, 3).
    fn bytes() -> Vec<u8> {
        let mut bytes = b"APWT".to_vec();
        for number in [1u32, 2, 2] {
            bytes.extend(number.to_le_bytes());
        }
        for word in ["chill", "mug"] {
            bytes.push(word.len() as u8);
            bytes.extend(word.as_bytes());
        }
        for float in [2.0f32, 3.0, 0.25, 0.5] {
            bytes.extend(float.to_le_bytes());
        }
        bytes.extend([1i8, 2, -2, 1].map(|entry| entry as u8));
        bytes
    }

    #[test]
    fn known_words_have_their_own_vectors() {
        let table = WordTable::parse(&bytes()).unwrap();
        assert_eq!((table.dims(), table.count()), (2, 2));
        assert_eq!(table.lookup("mug"), Some(1));
        assert_eq!(table.vector("mug"), [-6.0, 3.0]);
        assert_eq!(table.vector("chill"), [2.0, 4.0]);
        assert_eq!(table.frequency("mug"), 0.5);
        assert_eq!(table.frequency("zonk"), 0.25);
        assert_eq!(table.digest(), Digest::of(&bytes()));
    }

    #[test]
    fn broken_tables_are_refused_with_the_reason() {
        let change = |at: usize, byte: u8| {
            let mut bytes = bytes();
            bytes[at] = byte;
            WordTable::parse(&bytes).unwrap_err().to_string()
        };
        assert!(change(0, b'X').contains("APWT"));
        assert!(change(4, 9).contains("version 9"));
        assert!(change(8, 0).contains("0 dimensions"));
        assert!(change(8, 200).contains("the entries needs 400 bytes, 4 are left"));
        assert!(change(16, 255).contains("ends early"));
        assert!(change(17, 0xff).contains("not UTF-8"));
        assert!(change(17, b'z').contains("\"mug\", is not after"));
        assert!(change(29, 0xff).contains("\"chill\" of the word table has the scale"));
        for length in 0..bytes().len() {
            assert!(WordTable::parse(&bytes()[..length]).is_err(), "{length}");
        }
        let long = [bytes(), vec![0]].concat();
        assert_eq!(WordTable::parse(&long).unwrap_err(), WordTableError::Long { extra: 1 });
    }

    #[test]
    fn the_tables_that_ship_are_whole() {
        for name in ["paper", "default"] {
            let table = WordTable::builtin(name).unwrap();
            assert!(table.count() > 1_000, "{name}");
            for word in ["object", "rinse", "chill", "microwave"] {
                assert!(table.lookup(word).is_some(), "{name} lacks {word}");
            }
        }
        assert!(WordTable::builtin("nobody's").is_none());
    }

    #[test]
    fn an_unknown_word_is_like_itself_and_like_nothing_else() {
        let table = WordTable::builtin("paper").unwrap();
        let (one, two) = (table.vector("zonkify"), table.vector("blorp"));
        assert_eq!(one, table.vector("zonkify"));
        assert!(cosine(&one, &two).abs() < 0.5);
        assert!(cosine(&one, &table.vector("object")).abs() < 0.5);
        assert!((norm(&one) / table.typical_norm - 1.0).abs() < 1e-4);
    }
}
