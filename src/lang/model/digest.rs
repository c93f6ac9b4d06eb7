//! Digests of files as the language writes them.

use sha2::{Digest, Sha256};

/// Digest of a file's bytes as the language writes it: `sha256:…`.
pub fn digest(bytes: &[u8]) -> String {
    digest_text(&Sha256::digest(bytes).into())
}

/// A SHA-256 hash as the language writes it.
pub fn digest_text(hash: &[u8; 32]) -> String {
    let hex: String = hash.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("sha256:{hex}")
}
