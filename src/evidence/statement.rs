//! What a tenant's key signs beside checkpoints: short statements in the tenant's own stream.

use ed25519_dalek::{Signer, SigningKey, VerifyingKey};

use crate::ids::Signature;

/// Signs `statement` with Ed25519 (RFC 8032).
///
/// - `secret`: 32 bytes.
pub fn sign(secret: &[u8; 32], statement: &[u8]) -> Signature {
    Signature(SigningKey::from_bytes(secret).sign(statement).to_bytes())
}

/// Whether the holder of `secret` signed `statement`.
pub fn is_signed(secret: &[u8; 32], statement: &[u8], signature: &Signature) -> bool {
    let key: VerifyingKey = SigningKey::from_bytes(secret).verifying_key();
    key.verify_strict(statement, &ed25519_dalek::Signature::from_bytes(&signature.0)).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signature_fits_its_statement_and_key_alone() {
        let signature = sign(&[1; 32], b"erased");
        assert!(is_signed(&[1; 32], b"erased", &signature));
        assert!(!is_signed(&[1; 32], b"erases", &signature));
        assert!(!is_signed(&[2; 32], b"erased", &signature));
    }
}
