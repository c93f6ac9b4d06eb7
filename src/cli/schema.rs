//! What `--format json` prints: the fields of every command's result, for `avastra explain json`.
//!
//! A table and no derived schema, because most of it is what a field means: a result is made by `json!` where it arises, and
//! has no type that could be asked. `tests/it/json.rs` compares the table with what the commands print, both ways.

use super::output::folded;

/// A field of a result.
#[derive(Debug, serde::Serialize)]
pub struct Field {
    /// Where it stands: `files[].file` is the field `file` of each entry of the list `files`.
    pub path: &'static str,
    /// `text`, `number`, `bool`, `list`, or `object` with fields that follow or that the meaning names; with `?` it
    /// may be null.
    pub kind: &'static str,
    pub meaning: &'static str,
}

/// A command, with the option that leads to another result, and the fields of its result.
#[derive(Debug, serde::Serialize)]
pub struct Shape {
    pub command: &'static str,
    pub fields: &'static [Field],
}

const fn f(path: &'static str, kind: &'static str, meaning: &'static str) -> Field {
    Field { path, kind, meaning }
}

const INTRODUCTION: &str = "\
With `--format json` the last line on stdout is one object with the result of the
command, whether it failed or not. Diagnostics go to stderr, one object a line.
Every result has these fields:";

/// Fields of every command's result.
pub const ALWAYS: &[Field] = &[
    f("schema", "number", "rises when a field changes its meaning or goes away"),
    f("command", "text", "the command"),
    f("status", "number", "the exit status"),
    f("error", "text?", "why the command failed"),
];

const AFTER: &str = "\
Below are the fields of each command. A command that failed early has found nothing:
its own fields are absent. `?` is for what may be null, `[]` for each entry of a list.";

/// A file that could not be dealt with.
const FAILED: Field = f("failed[]", "object", "a file for which nothing was found: `file` and `error`");

/// Whether the same command leads to the same result again.
const REPRODUCIBLE: Field = f(
    "reproducible",
    "bool",
    "false if a driving system of your own is not deterministic, as it says or as was found, or missed steps",
);

/// What would be played.
const PLANNED: Field = f(
    "planned",
    "object",
    "with `--dry-run`, and then alone: `units` and `episodes` that would be played, `shards_max` into which it can be cut",
);

/// Every command with a result.
pub const SHAPES: &[Shape] = &[
    Shape {
        command: "check",
        fields: &[
            f("errors", "number", "mistakes in all files"),
            f("warnings", "number", "warnings in all files"),
            f("files[].file", "text", "its path"),
            f("files[].errors", "number", "its mistakes"),
            f("files[].dump", "object?", "with `--dump`: the tree, or the table as in `table`"),
            f("files[].audit", "object?", "with `--audit`: `rules`, each with its rows and what it cuts"),
            FAILED,
        ],
    },
    Shape {
        command: "compile",
        fields: &[f("table", "text", "path of the written table"), f("rows", "number", "rows of the table")],
    },
    Shape {
        command: "table",
        fields: &[
            f("version", "number", "of the table's form"),
            f("space", "text", "path of the space"),
            f("digest", "text", "of the space and all that it uses"),
            f("rules[].name", "text", ""),
            f("rules[].optional", "bool", "off unless `--with` names it"),
            f("rules[].rows", "number", "rows that it binds"),
            f("rows[].row", "number", "from 0"),
            f("rows[].action", "text", ""),
            f("rows[].axes[]", "object", "an `each` parameter: `name` and `value`"),
            f("rows[].rules[]", "text", "names of the rules that bind it"),
            f("rows[].roads[].road", "text", ""),
            f("rows[].roads[].masked", "text", "why it cannot run there; absent if it can"),
            f(
                "rows[].roads[].draws[]",
                "object",
                "what is drawn: `name`, `values` or `low`, `high` and `unit`",
            ),
            f("trials", "object?", "with `--try`: its settings"),
            f("cells[]", "object?", "with `--try`: a row on a road, with its tries and why any failed"),
        ],
    },
    Shape { command: "table --markdown", fields: &[f("text", "text", "Markdown")] },
    Shape {
        command: "table --row",
        fields: &[
            f("row", "number", ""),
            f("label", "text", "the row in words"),
            f("road", "text", ""),
            f("states", "object", "the value of each state, as given or as an episode may begin"),
            f("legal", "bool", "here and now"),
            f("rule", "text?", "the rule that refuses it; null if the world does"),
            f("reason", "text?", "why it is refused"),
        ],
    },
    Shape {
        command: "fmt",
        fields: &[
            f("unformatted", "number", "files that were not formatted"),
            f("texts[]", "text", "what was read from stdin, formatted"),
        ],
    },
    Shape {
        command: "explain",
        fields: &[
            f("pages[].code", "text", ""),
            f("pages[].title", "text", ""),
            f("pages[].text", "text", "Markdown"),
            f("always[]", "object", "with `json`: a field of every result"),
            f("shapes[]", "object", "with `json`: `command` and its `fields`"),
        ],
    },
    Shape {
        command: "diff",
        fields: &[
            f("differences[].change", "text", "what happened to it"),
            f("differences[].subject", "text", "what differs"),
            f("differences[].detail", "text", "may be empty"),
        ],
    },
    Shape { command: "new", fields: &[f("files[]", "text", "paths of the files written")] },
    Shape {
        command: "completions",
        fields: &[f("shell", "text", ""), f("script", "text", "what the shell reads")],
    },
    Shape {
        command: "run",
        fields: &[
            PLANNED,
            f("directory", "text", "the run directory"),
            f("totals", "object", "sums over all episodes: how they ended, collisions by kind"),
            f("refusals[]", "object", "a reason why actions were refused: `reason` and `times`"),
            f(
                "groups[]",
                "object",
                "a distinct failure: how it came about, `count`, an episode that shows it",
            ),
            f("never.rows", "number", "rows of the table"),
            f("never.steps", "number", "steps of all episodes, in each of which every row is offered"),
            f("never.legal[]", "object", "a row that no step allowed; what `refused` it, and how often"),
            f("never.chosen[]", "object", "a row that was legal, but that the agent never chose"),
            f("never.realised[]", "object", "a row that was chosen, but never carried out"),
            f("critical[]", "text", "scenarios with a counted collision"),
            f(
                "failures[]",
                "object",
                "what went wrong with a driving system of your own: `kind`, `problem`, `times`, `detail`, `scenario`",
            ),
            REPRODUCIBLE,
        ],
    },
    Shape {
        command: "ads check",
        fields: &[
            f(
                "checks[]",
                "object",
                "`stage`, `passed`, what was `found`, the `failure` if it is one of PROTOCOL.md",
            ),
            f("speed", "object?", "`questions`, `round_trips_per_s` and `share` of the episode's time"),
        ],
    },
    Shape { command: "ads schema", fields: &[f("protocol", "object", "the JSON Schema of every message")] },
    Shape {
        command: "train",
        fields: &[
            f("directory", "text", "the run directory"),
            f("totals", "object", "as in `run`"),
            f("groups[]", "object", "a distinct failure of the training, as in `run`"),
            f("simulated_h", "number", "time driven"),
            f("policy", "text?", "path of the policy; a search has none"),
            f("rules", "object?", "what its readable rules achieve"),
            f("evaluation", "object", "what it learned, in episodes of its own; its `failures` by kind"),
            f("failures[]", "object", "of the training, as in `run`"),
            REPRODUCIBLE,
        ],
    },
    Shape {
        command: "policy distil",
        fields: &[
            f("policy", "text", "path of the written policy"),
            f("lines", "number", "rules"),
            f("rules", "object?", "what they achieve"),
        ],
    },
    Shape {
        command: "policy explain",
        fields: &[
            f("policy", "text", "its name"),
            f("roads[]", "text", ""),
            f("insight", "object", "rows that it prefers, Q-values in a state, importance of each variable"),
        ],
    },
    Shape {
        command: "policy weights",
        fields: &[
            f("file", "text", "the safetensors file"),
            f("layers[]", "number", "widths of the network"),
            f("dueling", "bool", ""),
        ],
    },
    Shape {
        command: "estimate",
        fields: &[
            PLANNED,
            f("directory", "text", "where the estimate stands"),
            f("results.schema", "number", "of `results`, as in results.json"),
            f("results.event", "text", "`counted` or `collision`"),
            f("results.method", "text", "`count` or `probe`"),
            f("results.parts", "number", "parts that are done"),
            f("results.parts_wanted", "number", "all parts, if it does not stop before"),
            f("results.missing", "number", "share of such estimates whose intervals miss the truth, at most"),
            f("results.missing_at_look", "number", "the same of one look; those of all looks share it"),
            f("results.roads[]", "object", "`road`, with the fields of `results.together` for it"),
            f("results.together.probability", "number", "of the event in an episode"),
            f("results.together.interval", "object", "`low` and `high`"),
            f("results.together.per_1000_km", "number?", "episodes with the event in 1,000 km"),
            f("results.together.per_1000_km_interval", "object?", "`low` and `high`"),
            f("results.together.per_hour", "number?", "the same in an hour of driving"),
            f("results.together.per_hour_interval", "object?", "`low` and `high`"),
            f("results.together.episodes", "number", "played from start to end"),
            f("results.together.driven_km", "number", "in these"),
            f("results.together.simulated_h", "number", "in all, branches, trials and the pilot included"),
            f(
                "results.together.gain",
                "number?",
                "simulated time that counting would need, over that needed",
            ),
            f(
                "results.together.effective_events",
                "number?",
                "as many events of one weight would say as much; of `probe` alone",
            ),
            f("results.together.parts", "number", "samples"),
            f("results.together.parts_without", "number", "those of them whose estimate is 0"),
            f("results.mass[].road", "text", "where the probability lies, the most of it first"),
            f("results.mass[].row", "text?", "absent where what was hit appeared by no action"),
            f("results.mass[].share", "number", "of the probability on all roads"),
            f(
                "results.mass[].events",
                "number",
                "that it was found in; each is in estimate.db, with its weight",
            ),
            f("critical[]", "text", "paths of the scenarios"),
            REPRODUCIBLE,
        ],
    },
    Shape {
        command: "merge",
        fields: &[
            f("directory", "text?", "the merged directory; null with `--missing`"),
            f("shards", "number", "how many there are"),
            f("missing[]", "number", "a shard that is to be played again, or gone on with"),
        ],
    },
    Shape {
        command: "estimate --than",
        fields: &[
            f("sides[]", "text", "the two driving systems"),
            f("results.schema", "number", "of `results`"),
            f("results.event", "text", "`counted` or `collision`"),
            f("results.episodes", "number", "pairs"),
            f("results.both", "number", "pairs with the event under both"),
            f("results.first_only", "number", "under the first alone"),
            f("results.second_only", "number", "under the second alone"),
            f("results.driven_km[]", "number", "of the first, of the second"),
            f("results.probability[]", "number", "of the event in an episode, of the first, of the second"),
            f("results.intervals[]", "object", "of these, 95 %: `low` and `high`"),
            f("results.difference", "number", "the second's probability less the first's"),
            f("results.difference_interval", "object", "95 %: `low` and `high`"),
            f("results.p", "number", "of the sign test"),
            f("results.told_apart_km", "number?", "driven by both until p stays below 0.05"),
            REPRODUCIBLE,
        ],
    },
    Shape {
        command: "study",
        fields: &[
            PLANNED,
            f("directory", "text", "where results.json lies"),
            f("results", "object?", "as in results.json; absent if the driving system failed"),
            f(
                "failures[]",
                "object",
                "a cell that a driving system of your own failed in: `agent`, `road`, `number`, and how often by kind, \
                 `trained` and `evaluated`",
            ),
            f("timing[]", "object", "of an agent: `cells`, mean `wall_s` and `cpu_s`"),
        ],
    },
    Shape {
        command: "study results",
        fields: &[
            f("output", "text", "where the results were written"),
            f(
                "studies[]",
                "object",
                "`study`, its name; of a played one its `cells`, and how it departs from its file: `smaller`, `other`",
            ),
        ],
    },
    Shape {
        command: "replay",
        fields: &[
            f("confirmed", "number", "claims that hold"),
            f("refuted", "number", "claims that do not"),
            f("untried", "number", "claims that only the driving system itself can show"),
            f("policies[]", "object", "`file`, `policy` and the claims `refuted`, in words"),
            f(
                "scenarios[]",
                "object",
                "`file`, `scenario`, what has `changed` since it was written, `ads`, `claims`, `end`, the `failure` of a \
                 driving system of your own, whether it is `reproducible`; what its speed was `held` by, from when on; collisions and how hard they were",
            ),
            FAILED,
        ],
    },
    Shape {
        command: "diagnose",
        fields: &[
            f("causes[]", "object?", "`cause` (one or two modules, or none) and `count`"),
            f("mechanisms[]", "object?", "with `--mechanisms`: a weakness and what vanishes without it"),
            f("placebo", "object?", "with `--mechanisms`: what vanishes by other sensor noise alone"),
            f(
                "scenarios[]",
                "object",
                "`file`, `scenario`; its `diagnosis`, or with `--mechanisms` `without` and `placebo`",
            ),
            FAILED,
        ],
    },
    Shape {
        command: "shrink",
        fields: &[
            f("median_steps_before", "number", ""),
            f("median_actions_before", "number", ""),
            f("median_steps", "number", ""),
            f("median_actions", "number", ""),
            f("kept", "number", "scenarios that keep their verdict and every claim"),
            f(
                "scenarios[]",
                "object",
                "`file`, `output`, steps and actions before and after, claims `refuted`",
            ),
            REPRODUCIBLE,
            FAILED,
        ],
    },
    Shape {
        command: "test",
        fields: &[
            f("still_fails", "number", "scenarios with the same crash"),
            f("fixed", "number", "scenarios without one"),
            f(
                "changed",
                "number",
                "scenarios with another crash, that never meet the obstacle, or whose crash a review finds gone",
            ),
            f("errors", "number", "scenarios that could not be played"),
            f("ads_failed", "number", "scenarios in which an external driving system failed"),
            f("accepted", "number", "scenarios that `--accept` changed"),
            f(
                "reviewed[]",
                "object",
                "with `--review` or `--accept`: `file`, `scenario`, the `change` in a few words, and its `differences`",
            ),
            REPRODUCIBLE,
            f("scenarios[].file", "text", ""),
            f("scenarios[].scenario", "text", "its name"),
            f(
                "scenarios[].outcome",
                "text",
                "`still fails`, `fixed`, `changed`, `gone`, `ads failed`, `error`",
            ),
            f("scenarios[].reason", "text", "may be empty"),
        ],
    },
    Shape {
        command: "report",
        fields: &[
            f("page", "text", "its path"),
            f("scenarios", "number", "on the page"),
            f("left_out", "number", "scenarios beyond `--most`"),
            f("bytes", "number", "size of the page"),
            f("refuted", "number", "claims that do not hold: what only further plays show is not tried"),
            f(
                "compared",
                "object?",
                "with `--ads`: how many crashes are the `same`, at an `other_time`, `gone`, `new` and so on",
            ),
            FAILED,
        ],
    },
    Shape {
        command: "import",
        fields: &[
            f("files[]", "text", "paths of what was written, maps too"),
            f("imported[].file", "text", "the OpenSCENARIO file"),
            f("imported[].scenario", "text?", "path of its scenario; null if it was refused"),
            f("imported[].notes[]", "text", "what drives otherwise than in the file"),
            f("imported[].refused[].line", "number", "where the language cannot say what the file says"),
            f("imported[].refused[].element", "text", ""),
            f("imported[].refused[].reason", "text", ""),
        ],
    },
    Shape {
        command: "export",
        fields: &[
            f("files[]", "text", "paths of what was written, maps too"),
            f("left_out[]", "object", "`file`, and `what` the player of `--profile` cannot be told"),
            f("refuted", "number", "scenarios that do not replay, and were not written"),
            FAILED,
        ],
    },
    Shape {
        command: "render",
        fields: &[
            f("picture", "text", "its path"),
            f("times_s[]", "number", "moments drawn"),
            f("changed", "text?", "what has changed since the scenario was written"),
            f("svg", "text?", "the picture, if its path is `-`"),
        ],
    },
    Shape {
        command: "road",
        fields: &[
            f("file", "text", ""),
            f("name", "text", "of the map"),
            f("pose_fields[]", "text", "what stands where in a pose"),
            f("lanes[]", "object", "`key`, length, limit, links, neighbours, a pose each metre"),
            f("junctions[]", "object", "`id`, `name`, `groups`, `connections`"),
            f("signals[]", "object", "`id`, place, `junction`, `group`, the lanes that it stops"),
            f("crosswalks[]", "object", "`id` and `outline_m`"),
            f("route", "object?", "lanes, lane changes, stop lines and conflicts along the way"),
            f("warnings[]", "text", "what was wrong with the map"),
            f("svg", "text?", "the picture, with `--svg -`"),
        ],
    },
];

/// All of it, for people.
pub fn in_words() -> String {
    let mut text = INTRODUCTION.to_owned();
    add(&mut text, ALWAYS);
    text.push_str(&format!("\n\n{AFTER}"));
    for Shape { command, fields } in SHAPES {
        text.push_str(&format!("\n\n{command}"));
        add(&mut text, fields);
    }
    text
}

fn add(text: &mut String, fields: &[Field]) {
    for Field { path, kind, meaning } in fields {
        let meaning = folded(meaning, 80 - 36);
        text.push_str(format!("\n  {path:<25}{kind:<9}{}", meaning[0]).trim_end());
        meaning[1..].iter().for_each(|line| text.push_str(&format!("\n{:36}{line}", "")));
    }
}
