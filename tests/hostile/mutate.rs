//! Makes hostile bytes from valid ones.

use apprentice_testkit::dice::Dice;

/// Length of the longest case; longer cases are cut.
const BYTES_MAX: usize = 64 * 1024;

/// Beginnings of MessagePack values that claim four billion items or bytes, or somewhat too many.
const BOMBS: [&[u8]; 12] = [
    b"\xdd\xff\xff\xff\xff",
    b"\xdf\xff\xff\xff\xff",
    b"\xdb\xff\xff\xff\xff",
    b"\xc6\xff\xff\xff\xff",
    b"\xc9\xff\xff\xff\xff\x01",
    b"\xdd\x7f\xff\xff\xff",
    b"\xdc\xff\xff",
    b"\xde\xff\xff",
    b"\xda\xff\xff",
    b"\xd9\xff",
    b"\xff\xff\xff\xff",
    b"\x7f\xff\xff\xff\xff\xff\xff\xff",
];

/// Values that nest: MessagePack lists and maps, JSON, TOML.
const NESTS: [&[u8]; 9] =
    [b"\x91", b"\x81\xa1a", b"\xdd\x00\x00\x00\x01", b"[", b"{\"a\":", b"a.", b"{a=", b"[[", b"(("];

/// Text that is difficult for readers of text.
const WORDS: [&str; 14] = [
    "\u{0}",
    "\u{202e}",
    "\u{feff}",
    "é",
    "\r",
    "\n\n",
    "\t",
    "\"",
    "\\u0000",
    "9999999999999999999999",
    "-1",
    "1e400",
    "NaN",
    "'''",
];

pub fn mutate(dice: &mut Dice, corpus: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = corpus[dice.below(corpus.len())].clone();
    for _ in 0..1 + dice.below(3) {
        once(dice, corpus, &mut bytes);
    }
    bytes.truncate(BYTES_MAX);
    bytes
}

/// Nests values as deep as the bytes allow, alone and at the end of each example.
pub fn deepest(corpus: &[Vec<u8>], length: usize) -> Vec<Vec<u8>> {
    let mut cases = Vec::new();
    for nest in NESTS {
        let deep = nest.repeat(length / nest.len());
        cases.push(deep.clone());
        cases.push([&corpus[0], &deep[..]].concat());
        let half = corpus[0].len() / 2;
        cases.push([&corpus[0][..half], &deep, &corpus[0][half..]].concat());
    }
    cases
}

fn once(dice: &mut Dice, corpus: &[Vec<u8>], bytes: &mut Vec<u8>) {
    let place = dice.below(bytes.len() + 1);
    match dice.below(12) {
        0 | 1 => {
            for _ in 0..1 + dice.below(8) {
                if let Some(length) = bytes.len().checked_sub(1) {
                    let place = dice.below(length + 1);
                    bytes[place] ^= 1 << dice.below(8);
                }
            }
        }
        2 => bytes.truncate(place),
        3 => {
            // The beginning of one with the end of another.
            let other = &corpus[dice.below(corpus.len())];
            bytes.truncate(place);
            bytes.extend_from_slice(&other[dice.below(other.len() + 1)..]);
        }
        4 => overwrite(bytes, place, BOMBS[dice.below(BOMBS.len())]),
        5 => insert(bytes, place, BOMBS[dice.below(BOMBS.len())]),
        6 => {
            let times = 1 << dice.below(16);
            insert(bytes, place, &NESTS[dice.below(NESTS.len())].repeat(times));
        }
        7 => {
            let piece = piece(dice, bytes);
            insert(bytes, place, &piece.repeat(1 + dice.below(4)));
        }
        8 => {
            let length = dice.below(16);
            let end = (place + length).min(bytes.len());
            bytes.drain(place..end);
        }
        9 => {
            let random: Vec<u8> = (0..dice.below(32)).map(|_| dice.below(256) as u8).collect();
            insert(bytes, place, &random);
        }
        10 => insert(bytes, place, WORDS[dice.below(WORDS.len())].as_bytes()),
        _ => {
            // One byte is changed: a length, a kind, a digit.
            if let Some(byte) = bytes.get_mut(place) {
                *byte = [0, 1, 0x7f, 0x80, 0xff, b'9', dice.below(256) as u8][dice.below(7)];
            }
        }
    }
}

fn insert(bytes: &mut Vec<u8>, place: usize, piece: &[u8]) {
    bytes.splice(place..place, piece.iter().copied());
}

fn overwrite(bytes: &mut Vec<u8>, place: usize, piece: &[u8]) {
    let end = (place + piece.len()).min(bytes.len());
    bytes.splice(place..end, piece.iter().copied());
}

fn piece(dice: &mut Dice, bytes: &[u8]) -> Vec<u8> {
    let from = dice.below(bytes.len() + 1);
    let to = (from + dice.below(64)).min(bytes.len());
    bytes[from..to].to_vec()
}
