//! `avastra editor-files`: the parts of the VS Code extension that follow from the language.

use super::arguments::EditorFilesArguments;
use super::error::Failure;
use super::files::{make_way, write};
use super::lsp::editor_files::files;
use super::output::Output;

/// Writes the files, in place of older ones.
pub fn editor_files(output: &Output, arguments: &EditorFilesArguments) -> Result<(), Failure> {
    let mut paths = Vec::new();
    for (name, text) in files() {
        let path = arguments.directory.join(name);
        make_way(&arguments.directory, &path)?;
        write(&path, &text)?;
        output.tell(&path.display().to_string());
        paths.push(path);
    }
    output.result(serde_json::json!({ "files": paths }));
    Ok(())
}
