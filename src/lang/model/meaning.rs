//! The meaning of a space, as digests: whether two files mean the same, and which declarations differ if not.
//!
//! `check::meaning` says what a digest covers. Here are the digests, and the text that a `use` keeps of them.

use std::collections::BTreeMap;

use crate::model::digest;

/// Letters of a declaration's mark, of six bits each: enough to tell what changed, never used to tell whether.
const MARK_LETTERS: usize = 2;

/// The letters of marks.
const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";

/// Largest number of declarations that are named as different.
const NAMED_MAX: usize = 6;

/// The digest of a space, and a mark for each of its declarations.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Meaning {
    /// `sha256:…`
    digest: String,
    /// The title of each (for example ``rule `npc_gap` ``) and its canonical text, which the digest covers.
    declarations: Vec<(String, String)>,
}

impl Meaning {
    /// The meaning of declarations, each with its title and its canonical text. Their order counts.
    pub fn new(declarations: Vec<(String, String)>) -> Meaning {
        let whole: Vec<&str> = declarations.iter().map(|(_, text)| text.as_str()).collect();
        Meaning { digest: digest(whole.join("\n").as_bytes()), declarations }
    }

    /// The title and the canonical text of each declaration. The digest covers these texts in this order. Two meanings have
    /// one digest if and only if they have the same texts in the same order.
    pub fn declarations(&self) -> impl Iterator<Item = (&str, &str)> {
        self.declarations.iter().map(|(title, text)| (title.as_str(), text.as_str()))
    }

    /// `sha256:…`
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// The record that a file keeps of the space it was made in: the digest, a blank, and the marks.
    pub fn seal(&self) -> String {
        format!("{} {}", self.digest, self.marks()).trim_end().to_owned()
    }

    fn marks(&self) -> String {
        self.declarations.iter().map(|(_, text)| mark(text)).collect()
    }

    /// Whether a seal, or a digest alone, is of this meaning.
    pub fn is_sealed_by(&self, seal: &str) -> bool {
        seal.split(' ').next() == Some(&self.digest)
    }

    /// Which declarations differ from those of a seal, in words; `None` if the seal has no marks.
    pub fn differences(&self, seal: &str) -> Option<String> {
        let (_, marks) = seal.split_once(' ').filter(|(_, marks)| marks.is_ascii() && !marks.is_empty())?;
        // How many declarations had a mark.
        let mut before: BTreeMap<&str, usize> = BTreeMap::new();
        for at in 0..marks.len() / MARK_LETTERS {
            *before.entry(&marks[at * MARK_LETTERS..][..MARK_LETTERS]).or_default() += 1;
        }
        let mut differ: Vec<&str> = Vec::new();
        for (title, text) in &self.declarations {
            match before.get_mut(mark(text).as_str()).filter(|left| **left > 0) {
                Some(left) => *left -= 1,
                None => differ.push(title),
            }
        }
        // A declaration that changed is missing under its old mark, too.
        let missing = before.values().sum::<usize>().saturating_sub(differ.len());
        let mut parts = Vec::new();
        if !differ.is_empty() {
            let more = differ.len().saturating_sub(NAMED_MAX);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let named = differ[..differ.len().min(NAMED_MAX)].join(", ");
            parts.push(format!("changed or new: {named}{more}"));
        }
        if missing > 0 {
            let noun = if missing == 1 { "declaration" } else { "declarations" };
            parts.push(format!("{missing} {noun} of then missing"));
        }
        if parts.is_empty() {
            // A mark is short, and may stay as it was; then the digest alone tells of a change.
            parts.push(match self.marks() == marks {
                true => "no declaration is seen to differ: the digest itself may have been edited".to_owned(),
                false => "the declarations are the same, their order is not".to_owned(),
            });
        }
        Some(parts.join("; "))
    }
}

/// The mark of a declaration: the first bits of its digest.
fn mark(text: &str) -> String {
    let digest = digest(text.as_bytes());
    let bits = u64::from_str_radix(&digest["sha256:".len()..][..16], 16).expect("a digest is hexadecimal");
    let letter = |at: usize| char::from(LETTERS[(bits >> (58 - 6 * at) & 63) as usize]);
    (0..MARK_LETTERS).map(letter).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn meaning(declarations: &[&str]) -> Meaning {
        let titled = |text: &&str| ((*text).split('=').next().unwrap().trim().to_owned(), (*text).to_owned());
        Meaning::new(declarations.iter().map(titled).collect())
    }

    #[test]
    fn a_seal_tells_what_changed() {
        let then = meaning(&["let a = 1", "let b = 2", "let c = 3"]);
        assert!(then.is_sealed_by(&then.seal()) && then.is_sealed_by(then.digest()));
        let found = |now: &[&str]| {
            let now = meaning(now);
            assert!(!now.is_sealed_by(&then.seal()));
            now.differences(&then.seal()).expect("there are marks")
        };
        assert_eq!(found(&["let a = 1", "let b = 7", "let c = 3"]), "changed or new: let b");
        assert_eq!(found(&["let a = 1", "let c = 3"]), "1 declaration of then missing");
        assert_eq!(found(&["let b = 7", "let d = 1", "let e = 2"]), "changed or new: let b, let d, let e");
        assert_eq!(found(&["let d = 7"]), "changed or new: let d; 2 declarations of then missing");
        assert_eq!(
            found(&["let b = 2", "let a = 1", "let c = 3"]),
            "the declarations are the same, their order is not"
        );
        let edited = then.seal().replace("sha256:", "sha256:0");
        assert_eq!(
            then.differences(&edited).as_deref(),
            Some("no declaration is seen to differ: the digest itself may have been edited")
        );
        assert_eq!(then.differences(then.digest()), None);
        assert_eq!(then.differences("sha256:0 ää"), None);
    }
}
