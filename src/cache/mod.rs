//! What one compilation keeps for the next, found again by a digest of all that it depends on.
//!
//! In: a [`Key`] and bytes. Out: the same bytes, or nothing. A result never depends on whether it was kept: whoever asks
//! makes it anew when it is not there, and what comes back damaged counts as not there. [`Cache`] is all that the stages
//! know; [`folder`] keeps the bytes in files and is the only part of this room that touches a disk.

pub mod bytes;
pub mod folder;

pub use folder::Folder;

use serde::Serialize;
use std::fmt;

/// Names a result by what it depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Key([u8; 32]);

impl Key {
    /// The key of what `purpose` makes of `inputs`, by this version of the compiler.
    pub fn new(purpose: &str, inputs: &impl Serialize) -> Key {
        let text = ron::to_string(inputs).expect("plain data always serialises");
        let mut hasher = blake3::Hasher::new();
        for part in [env!("CARGO_PKG_VERSION"), purpose, &text] {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part.as_bytes());
        }
        Key(*hasher.finalize().as_bytes())
    }

    /// This key together with more that its result depends on.
    pub fn with(&self, more: &impl Serialize) -> Key {
        Key::new(&self.to_hex(), more)
    }

    pub fn as_bytes(&self) -> &[u8; 32] {
        &self.0
    }

    /// 64 lower-case digits.
    pub fn to_hex(&self) -> String {
        blake3::Hash::from(self.0).to_hex().to_string()
    }
}

/// Somewhere to keep results. Asked from several threads at once.
pub trait Cache: fmt::Debug + Send + Sync {
    /// The bytes kept under `key`, whole and unchanged; `None` if there are none.
    fn get(&self, key: &Key) -> Option<Vec<u8>>;
    /// Keeps bytes, or fails to, in silence: the next run makes them anew.
    fn put(&self, key: &Key, value: &[u8]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_tells_purposes_and_inputs_apart() {
        let keys = [
            Key::new("shots", &("ab", "c")),
            Key::new("shots", &("a", "bc")),
            Key::new("model", &("ab", "c")),
            Key::new("shots", &("ab", "c")).with(&1),
            Key::new("shots", &("ab", "c")).with(&2),
        ];
        for (i, key) in keys.iter().enumerate() {
            assert!(keys[..i].iter().all(|other| other != key), "{i}");
        }
        assert_eq!(keys[0], Key::new("shots", &("ab", "c")));
        assert_eq!(keys[0].to_hex().len(), 64);
    }
}
