use super::*;
use crate::evidence::draws::Draws;

/// The leaves and roots that implementations of Certificate Transparency share.
const LEAVES: [&str; 8] = [
    "",
    "00",
    "10",
    "2021",
    "3031",
    "40414243",
    "5051525354555657",
    "606162636465666768696a6b6c6d6e6f",
];
const ROOTS: [&str; 9] = [
    "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855",
    "6e340b9cffb37a989ca544e6bb780a2c78901d3fb33738768511a30617afa01d",
    "fac54203e7cc696cf0dfcb42c92a1d9dbaf70ad9e621f4bd8d98662f00e3c125",
    "aeb6bcfe274b70a14fb067a5e5578264db0fa9b51af5e0ba159158f329e06e77",
    "d37ee418976dd95753c1c73862b9398fa2a2cf9b4ff0fdfe8b30cd95209614b7",
    "4e3bbb1f7b478dcfe71fb631631519a3bca12c9aefca1612bfce4c13a86264d4",
    "76e67dadbcdf1e10e1b74ddc608abd2f98dfb16fbce75277b5232a127f2087ef",
    "ddb89be403809e325750d3d263cd78929c2942b7942a34b77e122c9594a74c8c",
    "5dc9da79a70659a9ad559cb701ded9a2ab9d823aad2f4960cfe370eff4604328",
];

fn known() -> Vec<TreeHash> {
    let bytes = |hex: &&str| HEXLOWER.decode(hex.as_bytes()).unwrap();
    LEAVES.iter().map(|leaf| TreeHash::of_leaf(&bytes(leaf))).collect()
}

fn shown(path: Vec<TreeHash>) -> Vec<String> {
    path.iter().map(ToString::to_string).collect()
}

fn drawn(rng: &mut Draws, count: usize) -> Vec<TreeHash> {
    (0..count).map(|_| TreeHash::of_leaf(&rng.next_u64().to_be_bytes())).collect()
}

/// The definition of RFC 6962, section 2.1, word by word.
fn defined(leaves: &[TreeHash]) -> TreeHash {
    if leaves.len() < 2 {
        return leaves.first().copied().unwrap_or_else(TreeHash::empty);
    }
    let mut k = 1;
    while 2 * k < leaves.len() {
        k *= 2;
    }
    TreeHash::of_node(defined(&leaves[..k]), defined(&leaves[k..]))
}

#[test]
fn the_roots_of_certificate_transparency_come_out() {
    let leaves = known();
    for (size, root) in ROOTS.iter().enumerate() {
        assert_eq!(Tree(&leaves[..size]).root().to_string(), *root, "{size} leaves");
    }
}

#[test]
fn the_paths_of_certificate_transparency_come_out() {
    let leaves = known();
    let inclusion: [(usize, usize, &[&str]); 4] = [
        (
            0,
            8,
            &[
                "96a296d224f285c67bee93c30f8a309157f0daa35dc5b87e410b78630a09cfc7",
                "5f083f0a1a33ca076a95279832580db3e0ef4584bdff1f54c8a360f50de3031e",
                "6b47aaf29ee3c2af9af889bc1fb9254dabd31177f16232dd6aab035ca39bf6e4",
            ],
        ),
        (
            5,
            8,
            &[
                "bc1a0643b12e4d2d7c77918f44e0f4f79a838b6cf9ec5b5c283e1f4d88599e6b",
                "ca854ea128ed050b41b35ffc1b87b8eb2bde461e9e3b5596ece6b9d5975a0ae0",
                ROOTS[4],
            ],
        ),
        (2, 3, &[ROOTS[2]]),
        (
            1,
            5,
            &[
                ROOTS[1],
                "5f083f0a1a33ca076a95279832580db3e0ef4584bdff1f54c8a360f50de3031e",
                "bc1a0643b12e4d2d7c77918f44e0f4f79a838b6cf9ec5b5c283e1f4d88599e6b",
            ],
        ),
    ];
    for (index, size, path) in inclusion {
        assert_eq!(shown(Tree(&leaves[..size]).path(index).unwrap()), path, "{index} of {size}");
    }
    let consistency: [(usize, usize, &[&str]); 3] = [
        (
            1,
            8,
            &[
                "96a296d224f285c67bee93c30f8a309157f0daa35dc5b87e410b78630a09cfc7",
                "5f083f0a1a33ca076a95279832580db3e0ef4584bdff1f54c8a360f50de3031e",
                "6b47aaf29ee3c2af9af889bc1fb9254dabd31177f16232dd6aab035ca39bf6e4",
            ],
        ),
        (
            6,
            8,
            &[
                "0ebc5d3437fbe2db158b9f126a1d118e308181031d0a949f8dededebc558ef6a",
                "ca854ea128ed050b41b35ffc1b87b8eb2bde461e9e3b5596ece6b9d5975a0ae0",
                ROOTS[4],
            ],
        ),
        (
            2,
            5,
            &[
                "5f083f0a1a33ca076a95279832580db3e0ef4584bdff1f54c8a360f50de3031e",
                "bc1a0643b12e4d2d7c77918f44e0f4f79a838b6cf9ec5b5c283e1f4d88599e6b",
            ],
        ),
    ];
    for (old, new, path) in consistency {
        let found = Tree(&leaves[..new]).consistency(old).unwrap();
        assert_eq!(shown(found), path, "{old} of {new}");
    }
}

#[test]
fn every_tree_up_to_65_leaves_agrees_with_the_definition_and_proves_every_part_of_itself() {
    let leaves = drawn(&mut Draws::new("trees"), 65);
    for size in 0..=leaves.len() {
        let tree = Tree(&leaves[..size]);
        let (count, root) = (size as u64, defined(tree.0));
        assert_eq!(tree.root(), root, "{size} leaves");
        for (index, leaf) in leaves[..size].iter().enumerate() {
            let path = tree.path(index).unwrap();
            let found = root_by_path(index as u64, count, *leaf, &path);
            assert_eq!(found, Some(root), "leaf {index} of {size}");
        }
        for old in 0..=size {
            let path = tree.consistency(old).unwrap();
            let before = (old as u64, defined(&leaves[..old]));
            assert!(is_consistent(before, (count, root), &path), "{old} of {size}");
        }
        assert_eq!((tree.path(size), tree.consistency(size + 1)), (None, None));
    }
}

#[test]
fn a_changed_part_of_a_path_shows_nothing() {
    let mut rng = Draws::new("changed paths");
    for _ in 0..2_000 {
        let size = 2 + rng.below(200);
        let leaves = drawn(&mut rng, size);
        let (tree, count) = (Tree(&leaves), size as u64);
        let root = tree.root();
        let index = rng.below(size);
        let good = tree.path(index).unwrap();
        let old = 1 + rng.below(size - 1);
        let (before, between) = (Tree(&leaves[..old]).root(), tree.consistency(old).unwrap());
        let old = old as u64;
        for bad in changed(&mut rng, &good) {
            let found = root_by_path(index as u64, count, leaves[index], &bad);
            assert_ne!(found, Some(root), "leaf {index} of {size}: {bad:?}");
        }
        for bad in changed(&mut rng, &between) {
            assert!(!is_consistent((old, before), (count, root), &bad), "{old} of {size}");
        }
        // Another place, another leaf, another size, another old tree.
        let other = (index as u64 + 1) % count;
        assert_ne!(root_by_path(other, count, leaves[index], &good), Some(root));
        assert_ne!(root_by_path(index as u64, count, root, &good), Some(root));
        let fork = TreeHash::of_leaf(b"fork");
        assert!(!is_consistent((old, fork), (count, root), &between));
        assert!(!is_consistent((old, before), (count, fork), &between));
        assert!(!is_consistent((count, root), (old, before), &between), "rolled back");
    }
}

/// Paths that differ from a good one in one hash, one bit, one order or one length.
fn changed(rng: &mut Draws, good: &[TreeHash]) -> Vec<Vec<TreeHash>> {
    let mut all = vec![[good, &[TreeHash::empty()]].concat()];
    if let [_, rest @ ..] = good {
        all.push(rest.to_vec());
        let mut flipped = good.to_vec();
        let at = rng.below(good.len());
        flipped[at].0[rng.below(32)] ^= 1 << rng.below(8);
        all.push(flipped);
    }
    if good.len() > 1 {
        let mut turned = good.to_vec();
        turned.reverse();
        all.push(turned);
    }
    all
}

#[test]
fn sizes_and_places_at_the_end_of_their_range_are_refused_and_do_not_panic() {
    let hash = TreeHash::empty();
    for size in [0, 1, 2, u64::MAX - 1, u64::MAX] {
        for index in [0, 1, u64::MAX - 1, u64::MAX] {
            for length in [0, 1, 63, 64, 65, 130] {
                let path = vec![hash; length];
                let found = root_by_path(index, size, hash, &path);
                assert!(found.is_none() || index < size);
                let same = is_consistent((index, hash), (size, hash), &path);
                assert!(!same || path.is_empty(), "{index} {size} {length}");
            }
        }
    }
}
