//! "Did you mean …?": the name nearest to a misspelt one, for every message that suggests one.

/// Most names that are compared with a misspelt one: a file may have thousands of both.
const CANDIDATES_MAX: usize = 1000;

/// Most characters of a word that is compared: two words cost their lengths multiplied.
const COMPARED_MAX: usize = 64;

/// The candidate that the author may have meant by `word`, if one is near enough.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = word.chars().count();
    if length > COMPARED_MAX {
        return None;
    }
    // At most a third of the word may be wrong; beyond that the guess is noise.
    let distance_max = (length / 3).max(1);
    candidates
        .into_iter()
        .take(CANDIDATES_MAX)
        // Words are at least as far apart as their lengths.
        .filter(|candidate| candidate.chars().count().abs_diff(length) <= distance_max)
        .map(|candidate| (strsim::damerau_levenshtein(word, candidate), candidate))
        .filter(|(distance, candidate)| *distance <= distance_max && *candidate != word)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}
