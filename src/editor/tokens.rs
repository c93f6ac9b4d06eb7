//! A text cut into words and marks: what an editor asks about a call that is being written, or about a word.
//!
//! Text literals and comments end as the grammar says. A unit is not put together: `m/s` is three tokens.

/// A word, a number, a text or a mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Token<'a> {
    pub start: usize,
    pub text: &'a str,
}

impl Token<'_> {
    pub fn is_word(&self) -> bool {
        self.text.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
    }

    pub fn end(&self) -> usize {
        self.start + self.text.len()
    }
}

/// The tokens of a text.
pub fn tokens(text: &str) -> Vec<Token<'_>> {
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(first) = text[at..].chars().next() {
        let rest = &text[at..];
        let len = if rest.starts_with("//") {
            let Some(newline) = rest.find('\n') else { return found };
            at += newline;
            continue;
        } else if first == '"' {
            match end_of_text(rest) {
                Some(len) => len,
                None if rest.contains('\n') => 1,
                None => return found,
            }
        } else if is_word(first) {
            rest.find(|next: char| !is_word(next)).unwrap_or(rest.len())
        } else if first.is_whitespace() {
            at += first.len_utf8();
            continue;
        } else {
            let marks = ["->", "=>", "==", "!=", "<=", ">=", ".."];
            marks.iter().find(|mark| rest.starts_with(**mark)).map_or(first.len_utf8(), |mark| mark.len())
        };
        found.push(Token { start: at, text: &rest[..len] });
        at += len;
    }
    found
}

/// The word at a byte, or that ends there, and its start; `None` in a comment.
pub fn word_at(text: &str, byte: usize) -> Option<(usize, &str)> {
    let line_start = text[..byte.min(text.len())].rfind('\n').map_or(0, |newline| newline + 1);
    let line_end = text[line_start..].find('\n').map_or(text.len(), |newline| line_start + newline);
    let tokens = tokens(&text[line_start..line_end]);
    let around = |token: &&Token<'_>| line_start + token.start <= byte && byte <= line_start + token.end();
    let token = tokens.iter().filter(|token| token.is_word()).find(around)?;
    Some((line_start + token.start, token.text))
}

fn is_word(character: char) -> bool {
    character.is_ascii_alphanumeric() || character == '_'
}

/// Length of the literal at the start of a text, quotes included; `None` if it does not end on its line.
fn end_of_text(text: &str) -> Option<usize> {
    let mut escaped = false;
    for (at, character) in text.char_indices().skip(1) {
        match character {
            '\n' => return None,
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return Some(at + 1),
            _ => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_marks() {
        let words = |text| tokens(text).iter().map(|token| token.text).collect::<Vec<_>>();
        assert_eq!(
            words("a->b // c\n\"x \\\" y\"<=12 m/s"),
            ["a", "->", "b", "\"x \\\" y\"", "<=", "12", "m", "/", "s"]
        );
        assert_eq!(words("use \"ro"), ["use"]);
        assert_eq!(word_at("set time = to", 5), Some((4, "time")));
        assert_eq!(word_at("// set", 4), None);
    }
}
