use std::fmt;

use data_encoding::HEXLOWER;
use sha2::{Digest as _, Sha256};

/// A hash of a Merkle tree: SHA-256, 32 bytes. Another type than [`crate::ids::Digest`], which is
/// BLAKE3, so that neither is taken for the other.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TreeHash(pub [u8; 32]);

impl fmt::Display for TreeHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&HEXLOWER.encode(&self.0))
    }
}

impl fmt::Debug for TreeHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "TreeHash({self})")
    }
}

impl TreeHash {
    /// The root of a tree without leaves: SHA-256 of nothing.
    pub fn empty() -> TreeHash {
        hash(&[])
    }

    /// A leaf. The first byte keeps leaves and nodes apart: without it a node could pass for a
    /// leaf (RFC 6962, section 2.1).
    pub fn of_leaf(data: &[u8]) -> TreeHash {
        hash(&[&[0], data])
    }

    pub fn of_node(left: TreeHash, right: TreeHash) -> TreeHash {
        hash(&[&[1], &left.0, &right.0])
    }
}

fn hash(parts: &[&[u8]]) -> TreeHash {
    let mut hasher = Sha256::new();
    parts.iter().for_each(|part| hasher.update(part));
    TreeHash(hasher.finalize().into())
}

/// The Merkle tree of RFC 6962, section 2.1, over leaves that are hashed already.
#[derive(Debug, Clone, Copy)]
pub struct Tree<'a>(pub &'a [TreeHash]);

impl Tree<'_> {
    pub fn root(self) -> TreeHash {
        match self.0 {
            [] => TreeHash::empty(),
            [leaf] => *leaf,
            leaves => {
                let (left, right) = leaves.split_at(split(leaves.len()));
                TreeHash::of_node(Tree(left).root(), Tree(right).root())
            }
        }
    }

    /// The path that leads from the leaf at `index` to the root, lowest first; none when there is
    /// no such leaf.
    pub fn path(self, index: usize) -> Option<Vec<TreeHash>> {
        let mut leaves = self.0;
        if index >= leaves.len() {
            return None;
        }
        let (mut index, mut path) = (index, Vec::new());
        while leaves.len() > 1 {
            let (left, right) = leaves.split_at(split(leaves.len()));
            match index.checked_sub(left.len()) {
                None => {
                    path.push(Tree(right).root());
                    leaves = left;
                }
                Some(inner) => {
                    path.push(Tree(left).root());
                    (leaves, index) = (right, inner);
                }
            }
        }
        path.reverse();
        Some(path)
    }

    /// What shows that the tree of the first `size` leaves is the beginning of this one; none when
    /// there are fewer. Empty for none of the leaves and for all.
    pub fn consistency(self, size: usize) -> Option<Vec<TreeHash>> {
        let mut leaves = self.0;
        if size > leaves.len() {
            return None;
        }
        let (mut size, mut known, mut path) = (size, true, Vec::new());
        if size == 0 {
            return Some(path);
        }
        while size < leaves.len() {
            let (left, right) = leaves.split_at(split(leaves.len()));
            if size <= left.len() {
                path.push(Tree(right).root());
                leaves = left;
            } else {
                path.push(Tree(left).root());
                (leaves, size) = (right, size - left.len());
                known = false;
            }
        }
        // The verifier knows the root of the old tree, but no other subtree of it.
        if !known {
            path.push(Tree(leaves).root());
        }
        path.reverse();
        Some(path)
    }
}

/// The largest power of two below `count`, for a count of at least 2.
fn split(count: usize) -> usize {
    1 << (count - 1).ilog2()
}

/// The root of a tree of `size` leaves in which `leaf` stands at `index`; none when a path of this
/// length leads from there to no root. (RFC 9162, section 2.1.3.2.)
pub fn root_by_path(index: u64, size: u64, leaf: TreeHash, path: &[TreeHash]) -> Option<TreeHash> {
    if index >= size {
        return None;
    }
    // The leaf's place and the last one's, level by level.
    let (mut place, mut last, mut root) = (index, size - 1, leaf);
    for &beside in path {
        if last == 0 {
            return None;
        }
        if place & 1 == 1 || place == last {
            root = TreeHash::of_node(beside, root);
            // The last node of a level with an odd count moves up without a neighbour.
            while place & 1 == 0 && place != 0 {
                (place, last) = (place >> 1, last >> 1);
            }
        } else {
            root = TreeHash::of_node(root, beside);
        }
        (place, last) = (place >> 1, last >> 1);
    }
    (last == 0).then_some(root)
}

/// Whether `path` shows that the tree `new` begins with the tree `old`; each is a size and a root.
/// (RFC 9162, section 2.1.4.2; every tree begins with the empty one.)
pub fn is_consistent(old: (u64, TreeHash), new: (u64, TreeHash), path: &[TreeHash]) -> bool {
    if old.0 == 0 || old.0 >= new.0 {
        let same = match old.0 {
            0 => old.1 == TreeHash::empty(),
            size => size == new.0 && old.1 == new.1,
        };
        return same && path.is_empty();
    }
    let (mut place, mut last) = (old.0 - 1, new.0 - 1);
    while place & 1 == 1 {
        (place, last) = (place >> 1, last >> 1);
    }
    // A whole power of two is a node of the new tree, and its hash is the old root.
    let (start, rest) = match (old.0.is_power_of_two(), path) {
        (true, rest) => (old.1, rest),
        (false, [start, rest @ ..]) => (*start, rest),
        (false, []) => return false,
    };
    let (mut old_root, mut new_root) = (start, start);
    for &beside in rest {
        if last == 0 {
            return false;
        }
        if place & 1 == 1 || place == last {
            old_root = TreeHash::of_node(beside, old_root);
            new_root = TreeHash::of_node(beside, new_root);
            while place & 1 == 0 && place != 0 {
                (place, last) = (place >> 1, last >> 1);
            }
        } else {
            new_root = TreeHash::of_node(new_root, beside);
        }
        (place, last) = (place >> 1, last >> 1);
    }
    last == 0 && old_root == old.1 && new_root == new.1
}

#[cfg(test)]
mod tests;
