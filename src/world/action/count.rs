//! Reasons, counted.

/// Something that happened several times, for one reason.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Count {
    pub count: usize,
    /// The reason, with the figures of its first occurrence.
    pub reason: String,
}

impl Count {
    /// Counts a reason; reasons that differ only in their figures count as one.
    pub fn add(counts: &mut Vec<Count>, reason: &str) {
        let words = |text: &str| text.replace(|c: char| c.is_ascii_digit() || "-.".contains(c), "");
        match counts.iter_mut().find(|known| words(&known.reason) == words(reason)) {
            Some(known) => known.count += 1,
            None => counts.push(Count { count: 1, reason: reason.to_owned() }),
        }
    }
}
