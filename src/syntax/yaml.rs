//! What is wrong with a settings file in YAML, in words for its author: line, field, and what is allowed.

use super::diagnostic::{listed, nearest};

/// The message for an error of the YAML reader, whose own words speak of Rust.
pub fn yaml_mistake(error: &serde_yaml::Error, text: &str) -> String {
    let said = error.to_string();
    let first = said.trim().lines().next().unwrap_or_default();
    let first = first.strip_prefix("error: ").unwrap_or(first);
    // `line 3 column 5: what is wrong`
    let placed = first.strip_prefix("line ").and_then(|rest| rest.split_once(' '));
    let placed =
        placed.and_then(|(line, rest)| Some((line.parse::<usize>().ok()?, rest.split_once(": ")?.1)));
    let Some((line, what)) = placed else { return first.to_owned() };
    let written = text.lines().nth(line.saturating_sub(1)).unwrap_or_default();
    let field = written.split_once(':').map(|(field, _)| field.trim().trim_start_matches("- "));
    let of = |field: Option<&str>| field.map_or(String::new(), |field| format!("`{field}`: "));
    let unknown = what.strip_prefix("unknown field `").or(what.strip_prefix("unknown variant `"));
    let what = match unknown.and_then(|rest| rest.split_once("`, expected ")) {
        Some((name, known)) => {
            let known: Vec<&str> = known.trim_start_matches("one of ").split([',', ' ']).collect();
            let known: Vec<&str> = known
                .into_iter()
                .map(|name| name.trim_matches('`'))
                .filter(|name| !name.is_empty())
                .collect();
            match nearest(name, known.iter().copied()) {
                Some(near) => format!("there is no `{name}`; did you mean `{near}`?"),
                None => format!("there is no `{name}`; there are {}", listed(&known)),
            }
        }
        None if what.starts_with("invalid floating point") || what.starts_with("non-finite float") => {
            format!("{}write a number", of(field))
        }
        None if what.starts_with("invalid u") || what.starts_with("invalid i") => {
            format!("{}write a whole number", of(field))
        }
        None if what.starts_with("invalid bool") => format!("{}write `true` or `false`", of(field)),
        None => what.to_owned(),
    };
    format!("line {line}: {what}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "only the reader's mistakes are looked at")]
    struct Settings {
        seed: Option<u64>,
        pace_mps: Option<f64>,
        yields: Option<bool>,
    }

    #[test]
    fn mistakes_name_line_and_field_and_what_is_allowed() {
        let said = |text: &str| {
            let error = serde_yaml::from_str::<Settings>(text).expect_err("it is wrong");
            yaml_mistake(&error, text)
        };
        assert_eq!(said("seed: 3\npace_mp: 4\n"), "line 2: there is no `pace_mp`; did you mean `pace_mps`?");
        assert_eq!(said("x: 3\n"), "line 1: there is no `x`; there are `seed`, `pace_mps` and `yields`");
        assert_eq!(said("seed: abc\n"), "line 1: `seed`: write a whole number");
        assert_eq!(said("pace_mps: fast\n"), "line 1: `pace_mps`: write a number");
        let infinite = "seed: 1\npace_mps: -.inf\n";
        let error = serde_yaml::from_str::<serde_json::Value>(infinite).expect_err("it is wrong");
        assert_eq!(yaml_mistake(&error, infinite), "line 2: `pace_mps`: write a number");
        assert_eq!(said("seed: 1\nyields: maybe\n"), "line 2: `yields`: write `true` or `false`");
        assert_eq!(said("a: [\n").lines().count(), 1);
    }
}
