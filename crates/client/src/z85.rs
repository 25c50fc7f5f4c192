//! ZeroMQ's printed form of a key (RFC 32): 40 characters for 32 bytes.

use apprentice_core::ids::PublicKey;

const DIGITS: &[u8; 85] =
    b"0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ.-:+=^!/*?&<>()[]{}@%$#";
/// Characters of a key of 32 bytes.
pub const KEY_CHARACTERS: usize = 40;

/// The 40 characters of a public key.
pub fn show(key: &PublicKey) -> String {
    encode(&key.0)
}

/// Reads a public key.
///
/// - returns: none if `text` is not the printed form of a key.
pub fn read(text: &str) -> Option<PublicKey> {
    decode(text).map(PublicKey)
}

pub(crate) fn encode(bytes: &[u8; 32]) -> String {
    let mut text = String::with_capacity(KEY_CHARACTERS);
    for four in bytes.chunks_exact(4) {
        let value = u32::from_be_bytes(four.try_into().expect("chunks of four have four bytes"));
        for place in (0..5).rev() {
            let digit = value / 85u32.pow(place) % 85;
            text.push(char::from(DIGITS[digit as usize]));
        }
    }
    text
}

/// - returns: none for another length, for a character that is not a digit, and for five characters
///   that mean more than 32 bits. So each key has one printed form.
pub(crate) fn decode(text: &str) -> Option<[u8; 32]> {
    if text.len() != KEY_CHARACTERS {
        return None;
    }
    let mut bytes = [0; 32];
    for (five, four) in text.as_bytes().chunks_exact(5).zip(bytes.chunks_exact_mut(4)) {
        let mut value = 0u64;
        for character in five {
            let digit = DIGITS.iter().position(|digit| digit == character)?;
            value = value * 85 + digit as u64;
        }
        four.copy_from_slice(&u32::try_from(value).ok()?.to_be_bytes());
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_printed_as_zeromq_prints_them_and_read_back() {
        for _ in 0..64 {
            let pair = zmq::CurveKeyPair::new().unwrap();
            let key = PublicKey(pair.public_key);
            assert_eq!(show(&key), zmq::z85_encode(&pair.public_key).unwrap());
            assert_eq!(read(&show(&key)), Some(key));
        }
        for key in [PublicKey([0; 32]), PublicKey([0xff; 32])] {
            assert_eq!(read(&show(&key)), Some(key));
        }
    }

    #[test]
    fn what_is_no_key_is_not_read() {
        let long = "0".repeat(41);
        let above = format!("#####{}", "0".repeat(35));
        for text in ["", "0", &long, &above, &"~".repeat(40), &"ä".repeat(20), &" ".repeat(40)] {
            assert_eq!(read(text), None, "{text:?}");
        }
    }
}
