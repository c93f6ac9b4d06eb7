//! Arithmetic of parameters: `${$speed / 3.6 + sqrt($a * $a)}` (OpenSCENARIO 1.1, "Expressions").

use std::collections::BTreeMap;

/// Parentheses and signs may stand in one another this deep.
const DEPTH_MAX: usize = 64;

/// The value of what stands between `${` and `}`.
///
/// # Errors
/// The part that is not understood.
pub fn value(text: &str, parameters: &BTreeMap<String, String>) -> Result<f64, String> {
    let mut reader = Reader { rest: text, parameters, depth: 0 };
    let found = reader.sum()?;
    match reader.rest.trim() {
        "" if found.is_finite() => Ok(found),
        "" => Err("it has no finite value".to_owned()),
        rest => Err(format!("`{rest}` is not understood: a number is expected, of + - * / and functions")),
    }
}

/// Texts that `+` joins, of parameters and words, if one of them is no number: esmini's way to compose names.
pub fn joined(text: &str, parameters: &BTreeMap<String, String>) -> Option<String> {
    let is_word = |part: &str| part.chars().all(|letter| letter.is_alphanumeric() || "_. ".contains(letter));
    let part = |part: &str| match part.trim().strip_prefix('$') {
        Some(name) => parameters.get(name).map(|value| value.trim().to_owned()),
        None => is_word(part).then(|| part.trim().to_owned()),
    };
    let parts: Vec<String> = text.split('+').map(part).collect::<Option<_>>()?;
    let is_text = parts.len() > 1 && parts.iter().any(|part| part.parse::<f64>().is_err());
    (is_text && parts.iter().all(|part| !part.is_empty())).then(|| parts.concat())
}

struct Reader<'a> {
    rest: &'a str,
    parameters: &'a BTreeMap<String, String>,
    depth: usize,
}

impl<'a> Reader<'a> {
    fn sum(&mut self) -> Result<f64, String> {
        let mut value = self.product()?;
        loop {
            if self.takes('+') {
                value += self.product()?;
            } else if self.takes('-') {
                value -= self.product()?;
            } else {
                return Ok(value);
            }
        }
    }

    fn product(&mut self) -> Result<f64, String> {
        let mut value = self.factor()?;
        loop {
            if self.takes('*') {
                value *= self.factor()?;
            } else if self.takes('/') {
                value /= self.factor()?;
            } else if self.takes('%') {
                value %= self.factor()?;
            } else {
                return Ok(value);
            }
        }
    }

    fn factor(&mut self) -> Result<f64, String> {
        self.depth += 1;
        if self.depth > DEPTH_MAX {
            return Err(format!("more than {DEPTH_MAX} parentheses stand in one another"));
        }
        let value = self.whole_factor();
        self.depth -= 1;
        value
    }

    fn whole_factor(&mut self) -> Result<f64, String> {
        if self.takes('-') {
            return Ok(-self.factor()?);
        }
        if self.takes('+') {
            return self.factor();
        }
        if self.takes('(') {
            let value = self.sum()?;
            return self.close().map(|()| value);
        }
        if self.takes('$') {
            let name = self.word(|letter| letter.is_alphanumeric() || letter == '_' || letter == '.');
            let text = self.parameters.get(name).ok_or_else(|| format!("no parameter is called `{name}`"))?;
            return text.trim().parse().map_err(|_| format!("`{name}` is `{text}`, which is no number"));
        }
        self.rest = self.rest.trim_start();
        if self.rest.starts_with(|letter: char| letter.is_ascii_digit() || letter == '.') {
            return self.literal();
        }
        let name = self.word(|letter| letter.is_alphanumeric() || letter == '_');
        if name == "pi" {
            return Ok(core::f64::consts::PI);
        }
        if name.is_empty() || !self.takes('(') {
            return Err(if name.is_empty() { "a number is missing".to_owned() } else { unknown(name) });
        }
        let first = self.sum()?;
        let second = if self.takes(',') { Some(self.sum()?) } else { None };
        self.close()?;
        match (name, second) {
            ("sin", None) => Ok(libm::sin(first)),
            ("cos", None) => Ok(libm::cos(first)),
            ("tan", None) => Ok(libm::tan(first)),
            ("asin", None) => Ok(libm::asin(first)),
            ("acos", None) => Ok(libm::acos(first)),
            ("atan", None) => Ok(libm::atan(first)),
            ("sqrt", None) => Ok(first.sqrt()),
            ("abs", None) => Ok(first.abs()),
            ("sign", None) => Ok(if first == 0.0 { 0.0 } else { first.signum() }),
            ("round", None) => Ok(first.round()),
            ("floor", None) => Ok(first.floor()),
            ("ceil", None) => Ok(first.ceil()),
            ("min", Some(second)) => Ok(first.min(second)),
            ("max", Some(second)) => Ok(first.max(second)),
            ("pow", Some(second)) => Ok(libm::pow(first, second)),
            _ => Err(unknown(name)),
        }
    }

    fn close(&mut self) -> Result<(), String> {
        if self.takes(')') { Ok(()) } else { Err("a `)` is missing".to_owned()) }
    }

    fn literal(&mut self) -> Result<f64, String> {
        let rest = self.rest;
        let belongs = |(at, letter): &(usize, char)| match letter {
            '+' | '-' => rest[..*at].ends_with(['e', 'E']),
            letter => letter.is_ascii_digit() || matches!(letter, '.' | 'e' | 'E'),
        };
        let end = rest.char_indices().find(|letter| !belongs(letter)).map_or(rest.len(), |(at, _)| at);
        self.rest = &rest[end..];
        rest[..end].parse().map_err(|_| format!("`{}` is no number", &rest[..end]))
    }

    fn word(&mut self, belongs: impl Fn(char) -> bool) -> &'a str {
        let rest = self.rest;
        let end = rest.find(|letter| !belongs(letter)).unwrap_or(rest.len());
        self.rest = &rest[end..];
        &rest[..end]
    }

    fn takes(&mut self, letter: char) -> bool {
        let rest = self.rest.trim_start().strip_prefix(letter);
        self.rest = rest.unwrap_or(self.rest);
        rest.is_some()
    }
}

fn unknown(name: &str) -> String {
    format!(
        "`{name}` is neither a number nor a function that is read: sqrt, abs, sign, round, floor, ceil, \
         min, max, pow, sin, cos, tan, asin, acos, atan"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arithmetic_binds_as_in_school_and_bad_texts_are_refused() {
        let parameters =
            BTreeMap::from([("v".to_owned(), "60".to_owned()), ("n".to_owned(), "x".to_owned())]);
        let value = |text: &str| value(text, &parameters);
        assert_eq!(value("$v / 3.6 + 2 * (1 - 3)"), Ok(60.0 / 3.6 - 4.0));
        assert_eq!(value("-sqrt( $v * $v )"), Ok(-60.0));
        assert_eq!(value("max(1e1, pow(2, 3))"), Ok(10.0));
        assert_eq!(value("sin(pi / 2) + acos(1)"), Ok(1.0));
        let joined = |text: &str| joined(text, &parameters);
        assert_eq!(joined("$n + speed 2 + $v"), Some("xspeed 260".to_owned()));
        assert_eq!(
            [joined("$v + 1"), joined("$w + a"), joined("$n"), joined("sin(1) + $n")],
            [const { None }; 4]
        );
        for wrong in ["", "1 +", "$w", "$n", "(1", "1 / 0", "sinh(1)", "a", "1 2", "é", &"(".repeat(1000)] {
            assert!(value(wrong).is_err(), "{wrong}");
        }
    }
}
