//! `avastra new`: a small space of one's own, with its road, to begin with; or one of the shipped examples.

use clap::builder::PossibleValuesParser;

use super::arguments::NewArguments;
use super::error::Failure;
use super::files::write;
use super::output::Output;

/// A file that is written: its name in the directory, and its text.
type File = (String, &'static str);

/// The space to begin with.
const STARTER: [(&str, &str); 3] = [
    ("space.ava", include_str!("starter/space.ava")),
    ("roads.ava", include_str!("starter/roads.ava")),
    ("roads/corner.xodr", include_str!("../../scenarios/roads/corner.xodr")),
];

/// The text of a file of the paper's space, which is in the program.
pub fn shipped(name: &str) -> Option<&'static str> {
    USED.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

/// What the examples use.
const USED: [(&str, &str); 6] = [
    ("avastra45.ava", include_str!("../../scenarios/avastra45.ava")),
    ("roads.ava", include_str!("../../scenarios/roads.ava")),
    ("roads/boulevard.xodr", include_str!("../../scenarios/roads/boulevard.xodr")),
    ("roads/corner.xodr", include_str!("../../scenarios/roads/corner.xodr")),
    ("roads/crossroad.xodr", include_str!("../../scenarios/roads/crossroad.xodr")),
    ("roads/residential.xodr", include_str!("../../scenarios/roads/residential.xodr")),
];

/// The examples, each with a map of its own if it has one.
macro_rules! examples {
    ($($name:literal $($map:literal)?),+ $(,)?) => {
        const EXAMPLES: &[(&str, &str, &[(&str, &str)])] = &[$((
            $name,
            include_str!(concat!("../../scenarios/examples/", $name, ".ava")),
            &[$(($map, include_str!(concat!("../../scenarios/examples/", $map))))?],
        )),+];
    };
}

examples! {
    "away_from_junctions",
    "deepqtest142",
    "from_the_right",
    "motorcycle",
    "night_and_fog",
    "own_road" "roads/high_street.xodr",
    "pedestrians_weigh_double",
    "rare",
    "slow_rain",
    "two_vehicles",
    "wet_trucks",
}

/// What `--template` takes.
pub fn template_names() -> PossibleValuesParser {
    PossibleValuesParser::new(EXAMPLES.iter().map(|(name, ..)| *name))
}

/// Writes the files; none is ever replaced.
pub fn new(output: &Output, arguments: &NewArguments) -> Result<(), Failure> {
    let written = |files: &[(&str, &'static str)]| -> Vec<File> {
        files.iter().map(|(name, text)| ((*name).to_owned(), *text)).collect()
    };
    let mut own = String::new();
    let example = EXAMPLES.iter().find(|(name, ..)| Some(*name) == arguments.template.as_deref());
    let files = match example {
        None => written(&STARTER),
        Some((name, text, maps)) => {
            // Here it stands beside what it uses.
            own = text.replace("use \"../", "use \"");
            let mut files = vec![(format!("{name}.ava"), "")];
            files.extend(written(&USED));
            files.extend(written(maps));
            files
        }
    };
    let text = |text: &'static str| if text.is_empty() { own.as_str() } else { text };
    let paths: Vec<_> =
        files.iter().map(|(name, given)| (arguments.directory.join(name), text(given))).collect();
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
