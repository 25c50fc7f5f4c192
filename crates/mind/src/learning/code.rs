use super::bundle::Bundle;
use crate::ids::Digest;
use crate::numerics::NumericsVersion;

/// What this code makes of known histories, one line each: `mind` or `state`, two names, a digest.
/// Tests compare the code with it.
const PINS: &str = include_str!("../../data/pins.txt");

/// Names the behaviour of this code: BLAKE3 over the version of the arithmetic, the form of minds,
/// and the pinned digests of known minds and states. A change of one bit in any of them fails a
/// test until its pin is changed, and a changed pin changes this digest.
pub fn code_digest() -> Digest {
    let (arithmetic, minds) = (NumericsVersion::CURRENT.0, Bundle::VERSION);
    Digest::of(
        format!("apprentice code · numerics {arithmetic} · minds {minds}\n{PINS}").as_bytes(),
    )
}

/// Names the form in which minds are stored.
pub fn mind_schema() -> Digest {
    Digest::of(format!("apprentice minds {}", Bundle::VERSION).as_bytes())
}

/// The digest that is pinned for `kind` (`mind` or `state`) under these two names.
pub fn pinned(kind: &str, first: &str, second: &str) -> Option<Digest> {
    PINS.lines().find_map(|line| {
        let mut words = line.split_whitespace();
        let names = [words.next()?, words.next()?, words.next()?];
        let digest = words.next()?;
        (names == [kind, first, second]).then(|| digest.parse().ok())?
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_of_the_pins_is_a_comment_or_a_digest_under_a_name_of_its_own() {
        let mut seen = Vec::new();
        for line in PINS.lines().filter(|line| !line.starts_with('#')) {
            let words: Vec<&str> = line.split_whitespace().collect();
            let [kind, first, second, digest] = words[..] else { panic!("{line}") };
            assert!(matches!(kind, "mind" | "state"), "{line}");
            assert_eq!(pinned(kind, first, second), Some(digest.parse().unwrap()), "{line}");
            assert!(!seen.contains(&[kind, first, second]), "twice: {line}");
            seen.push([kind, first, second]);
        }
        assert!(seen.len() >= 8, "only {seen:?}");
        assert_eq!(pinned("mind", "paper", "of nobody"), None);
    }
}
