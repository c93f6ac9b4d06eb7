//! `avastra new`: writes a small space to begin with, on its own road or on the user's map, or one of the shipped examples.

use std::path::Path;

use clap::builder::PossibleValuesParser;

use avastra_base::outside::{Shown, in_comment, in_line};
use avastra_campaign::emit;
use avastra_road::{RoadMap, Route, propose};

use super::arguments::NewArguments;
use super::error::Failure;
use super::files::{make_way, write_new};
use super::load;
use super::output::{Output, for_shell};

/// The space to begin with.
const STARTER: [(&str, &str); 3] = [
    ("space.ava", include_str!("starter/space.ava")),
    ("roads.ava", include_str!("starter/roads.ava")),
    ("roads/corner.xodr", include_str!("../../scenarios/roads/corner.xodr")),
];

/// The files of the paper's space, which the examples use: their names, from its folder, and their texts.
pub const SHIPPED: [(&str, &str); 7] = [
    ("avastra45.ava", include_str!("../../scenarios/avastra45.ava")),
    ("roads.ava", include_str!("../../scenarios/roads.ava")),
    ("lanes.ava", include_str!("../../scenarios/lanes.ava")),
    ("roads/boulevard.xodr", include_str!("../../scenarios/roads/boulevard.xodr")),
    ("roads/corner.xodr", include_str!("../../scenarios/roads/corner.xodr")),
    ("roads/crossroad.xodr", include_str!("../../scenarios/roads/crossroad.xodr")),
    ("roads/residential.xodr", include_str!("../../scenarios/roads/residential.xodr")),
];

/// The examples, each with its map if it has one.
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

/// Files by their names beside the space, with what they hold.
type Files = &'static [(&'static str, &'static str)];

/// The tests of protocols, each with what it uses.
const CATALOGUE: [(&str, &str, Files); 4] = [
    ("euro_ncap_cars", include_str!("../../scenarios/catalogue/euro_ncap_cars.ava"), PROVING_GROUND),
    (
        "euro_ncap_vulnerable",
        include_str!("../../scenarios/catalogue/euro_ncap_vulnerable.ava"),
        PROVING_GROUND,
    ),
    (
        "pre_crash",
        include_str!("../../scenarios/catalogue/pre_crash.ava"),
        &[("roads/pre_crash.xodr", include_str!("../../scenarios/roads/pre_crash.xodr"))],
    ),
    (
        "r157",
        include_str!("../../scenarios/r157.ava"),
        &[
            ("motorway.ava", include_str!("../../scenarios/motorway.ava")),
            ("moves.ava", include_str!("../../scenarios/moves.ava")),
            ("lanes.ava", include_str!("../../scenarios/lanes.ava")),
            ("roads/motorway.xodr", include_str!("../../scenarios/roads/motorway.xodr")),
        ],
    ),
];
const PROVING_GROUND: Files = &[
    ("proving_ground.ava", include_str!("../../scenarios/catalogue/proving_ground.ava")),
    ("roads/proving_ground.xodr", include_str!("../../scenarios/roads/proving_ground.xodr")),
];

/// The values of `--template`.
pub fn template_names() -> PossibleValuesParser {
    let examples = EXAMPLES.iter().map(|(name, ..)| *name);
    PossibleValuesParser::new(examples.chain(CATALOGUE.iter().map(|(name, ..)| *name)))
}

/// Routes that are proposed on a map.
const ROUTES_MAX: usize = 4;

/// Writes the files; none is ever replaced.
pub fn new(output: &Output, arguments: &NewArguments) -> Result<(), Failure> {
    let files = match (&arguments.map, &arguments.template) {
        (Some(map), _) => on_map(output, map)?,
        (None, Some(name)) => example(name),
        (None, None) => STARTER.map(|(name, text)| (name.to_owned(), text.to_owned())).to_vec(),
    };
    let paths: Vec<_> = files.iter().map(|(name, text)| (arguments.directory.join(name), text)).collect();
    if let Some((path, _)) = paths.iter().find(|(path, _)| path.exists() || path.is_symlink()) {
        return Err(Failure::usage(format!("`{}` exists: name another directory", path.shown())));
    }
    for (path, text) in &paths {
        make_way(&arguments.directory, path)?;
        write_new(path, text)?;
        output.tell(&path.shown().to_string());
    }
    let space = for_shell(&paths[0].0);
    let is_protocol = arguments.template.as_ref().is_some_and(|name| is_of_catalogue(name));
    let how = if is_protocol { "--agent every-row" } else { "--episodes 20" };
    output.tell(&format!("next: avastra check {space}, then avastra run {space} {how}"));
    let files: Vec<String> = paths.iter().map(|(path, _)| path.shown().to_string()).collect();
    output.result(serde_json::json!({ "files": files }));
    Ok(())
}

fn is_of_catalogue(name: &str) -> bool {
    CATALOGUE.iter().any(|(known, ..)| *known == name)
}

/// An example with what it uses: names in the directory, and texts.
fn example(name: &str) -> Vec<(String, String)> {
    if let Some((_, own, used)) = CATALOGUE.iter().find(|(known, ..)| *known == name) {
        let own = (format!("{name}.ava"), *own);
        let files = core::iter::once(own).chain(used.iter().map(|(name, text)| ((*name).to_owned(), *text)));
        // The maps stand beside them here.
        return files.map(|(name, text)| (name, text.replace("\"../roads/", "\"roads/"))).collect();
    }
    let found = EXAMPLES.iter().find(|(known, ..)| *known == name);
    let (_, own, maps) = found.expect("clap takes the names of templates alone");
    // Here it stands beside what it uses.
    let mut files = vec![(format!("{name}.ava"), own.replace("use \"../", "use \""))];
    files.extend(SHIPPED.iter().chain(*maps).map(|(name, text)| ((*name).to_owned(), (*text).to_owned())));
    files
}

/// The limit of the space to begin with, in steps.
const STARTER_STEPS: u32 = 20;
/// Its step, s, and a mean speed at which a driving system arrives that waits at lights and for others, m/s. Ours.
const STARTER_STEP_S: f64 = 6.0;
const ARRIVES_MPS: f64 = 5.0;

/// Steps in which a driving system arrives, at least those of the space to begin with.
fn steps_for(length_m: f64) -> u32 {
    ((length_m / (ARRIVES_MPS * STARTER_STEP_S)).ceil() as u32).max(STARTER_STEPS)
}

/// The space to begin with, on proposed routes of a map, with the map.
fn on_map(output: &Output, path: &Path) -> Result<Vec<(String, String)>, Failure> {
    let text = load::text(path)?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let map = RoadMap::from_opendrive(&stem, &text).map_err(|error| Failure::file("read", path, error))?;
    map.warnings.iter().for_each(|warning| output.warn(&in_line(warning)));
    let proposals = propose(&map, ROUTES_MAX);
    if proposals.is_empty() {
        let message = "no way on it can be driven; `avastra road` tells what it holds";
        return Err(Failure::file("use", path, message));
    }
    let file = format!("roads/{}.xodr", emit::identifier(&stem));
    let mut roads = "//! Routes that `avastra new --map` proposes: each exercises what those before it do not.\nlanguage 1\n".to_owned();
    let mut names: Vec<String> = Vec::new();
    for proposal in &proposals {
        let mut name = emit::identifier(&proposal.title.to_lowercase());
        if names.contains(&name) {
            name = format!("{name}_{}", names.len() + 1);
        }
        let (start, goal) = (emit::lane_point(&map, proposal.start), emit::lane_point(&map, proposal.goal));
        let reason = in_comment(&proposal.reason);
        let reason = format!("{}{}", reason[..1].to_uppercase(), &reason[1..]);
        roads += &format!(
            "\n/// {reason}.\nroad {name} {{\n  map: \"{file}\"\n  start: {start}\n  goal: {goal}\n}}\n"
        );
        output.tell(&format!("{name}: {reason}"));
        names.push(name);
    }
    let routes = proposals.iter().filter_map(|way| Route::find(&map, way.start, way.goal).ok());
    let longest_m = routes.map(|route| route.path.length_m()).fold(0.0, f64::max);
    let space = STARTER[0].1.replace("roads: [corner]", &format!("roads: [{}]", names.join(", ")));
    let limit = |steps: u32| format!("limit: {steps} steps");
    assert!(space.contains(&limit(STARTER_STEPS)), "the space to begin with has its limit");
    let space = space.replace(&limit(STARTER_STEPS), &limit(steps_for(longest_m)));
    Ok(vec![("space.ava".to_owned(), space), ("roads.ava".to_owned(), roads), (file, text)])
}
