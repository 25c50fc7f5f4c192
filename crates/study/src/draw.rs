//! Drawing by seed: every draw has a generator of its own, named by what it is for, so that one
//! more draw somewhere changes nothing elsewhere.

use apprentice::ids::Digest;
use apprentice::numerics::Rng;

/// The generator for one purpose of one seed: `draw::rng(2, &["scene", row.id])`.
pub fn rng(seed: u64, purpose: &[&str]) -> Rng {
    let mut bytes = b"apprentice evaluation draw".to_vec();
    bytes.extend(seed.to_be_bytes());
    for part in purpose {
        bytes.extend((part.len() as u64).to_be_bytes());
        bytes.extend(part.as_bytes());
    }
    Rng::from_digest(Digest::of(&bytes))
}

/// `count` of the items (all when there are fewer), each equally likely, in their own order.
pub fn some<T: Clone>(rng: &mut Rng, items: &[T], count: usize) -> Vec<T> {
    let mut places: Vec<usize> = (0..items.len()).collect();
    rng.shuffle(&mut places);
    places.truncate(count);
    places.sort_unstable();
    places.into_iter().map(|place| items[place].clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_draw_is_a_sample_without_repetition_and_the_same_each_time() {
        let items: Vec<u32> = (0..100).collect();
        let drawn = some(&mut rng(7, &["rows"]), &items, 10);
        assert_eq!(drawn.len(), 10);
        assert!(drawn.windows(2).all(|pair| pair[0] < pair[1]), "{drawn:?}");
        assert_eq!(drawn, some(&mut rng(7, &["rows"]), &items, 10));
        assert_ne!(drawn, some(&mut rng(8, &["rows"]), &items, 10));
        assert_ne!(drawn, some(&mut rng(7, &["r", "ows"]), &items, 10));
        assert_eq!(some(&mut rng(7, &[]), &items, 1000), items);
    }
}
