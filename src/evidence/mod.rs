//! What an operator cannot rewrite unnoticed: a Merkle tree over closed segments of people's
//! streams, signed checkpoints of it, and proofs that stand on their own.
//!
//! ```text
//! record digests ── segment root ┐
//!                    stream, range, head ── leaf ── tree root ── checkpoint, signed
//! ```
//!
//! `schema/proof.md` describes every byte; `tools/verify.py` is a second reader that shares no code.

mod checkpoint;
#[cfg(test)]
mod draws;
mod note;
mod proof;
mod segment;
mod statement;
mod tree;
mod verify;

pub use checkpoint::{Checkpoint, CheckpointError};
pub use note::{KeyNameError, NoteError, NoteSigner, VerifierKey};
pub use proof::{Consistency, Inclusion, Proof, ProofError, Revealed};
pub use segment::Segment;
pub use statement::{is_signed, sign};
pub use tree::{Tree, TreeHash, is_consistent, root_by_path};
pub use verify::{Verified, VerifiedRecord, VerifyError, verify};
