//! `avastra fmt`: the one style.

use std::path::Path;

use avastra_base::outside::Shown;
use avastra_lang::syntax::{FormatError, Sources};

use super::arguments::FmtArguments;
use super::error::Failure;
use super::files::write_again;
use super::load;
use super::output::Output;

/// Rewrites files that are not formatted, or with `--check` counts them.
pub fn fmt(output: &Output, arguments: &FmtArguments) -> Result<(), Failure> {
    let mut unformatted = 0;
    let mut texts = Vec::new();
    for path in &arguments.files {
        let from_stdin = path == Path::new("-");
        let text = match from_stdin {
            true => load::stdin()?,
            false => load::text(path)?,
        };
        let formatted = formatted(output, path, &text)?;
        let is_formatted = formatted == text;
        if arguments.check {
            if !is_formatted {
                unformatted += 1;
                output.say(&format!("{}: not formatted", path.shown()));
            }
        } else if from_stdin {
            output.document(formatted.trim_end_matches('\n'));
            texts.push(formatted);
        } else if !is_formatted {
            write_again(path, &formatted)?;
            output.tell(&format!("{}: formatted", path.shown()));
        }
    }
    output.result(serde_json::json!({ "unformatted": unformatted, "texts": texts }));
    if unformatted > 0 { Err(Failure::Unformatted { files: unformatted }) } else { Ok(()) }
}

fn formatted(output: &Output, path: &Path, text: &str) -> Result<String, Failure> {
    let mut sources = Sources::new();
    let file = sources.add(path.to_string_lossy(), text);
    avastra_lang::syntax::format(file, text).map_err(|error| match error {
        FormatError::Syntax(diagnostics) => {
            output.diagnostics(&sources, &diagnostics);
            Failure::Source { errors: diagnostics.len() }
        }
        FormatError::Meaning => Failure::file("format", path, error),
    })
}
