//! `avastra new`: a small space of one's own, with its road, to begin with.

use super::arguments::NewArguments;
use super::error::Failure;
use super::files::write;
use super::output::Output;

/// What is written: name in the directory, and text.
const FILES: [(&str, &str); 3] = [
    ("space.ava", include_str!("starter/space.ava")),
    ("roads.ava", include_str!("starter/roads.ava")),
    ("roads/corner.xodr", include_str!("../../scenarios/roads/corner.xodr")),
];

/// Writes the files; none is ever replaced.
pub fn new(output: &Output, arguments: &NewArguments) -> Result<(), Failure> {
    let paths = FILES.map(|(name, text)| (arguments.directory.join(name), text));
    if let Some((path, _)) = paths.iter().find(|(path, _)| path.exists()) {
        return Err(Failure::usage(format!("`{}` exists: name another directory", path.display())));
    }
    for (path, text) in &paths {
        write(path, text)?;
        output.tell(&path.display().to_string());
    }
    let space = paths[0].0.display().to_string();
    output.tell(&format!("next: avastra check {space}, then avastra run {space} --episodes 20"));
    let files: Vec<String> = paths.iter().map(|(path, _)| path.display().to_string()).collect();
    output.result(serde_json::json!({ "files": files }));
    Ok(())
}
