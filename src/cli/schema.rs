//! The output of `--format json`: the fields of every command's result, for `avastra explain json`.
//!
//! It is a table and no derived schema, because most of it is the meaning of fields. A result is made by `json!` where it
//! arises, and has no type to derive from. `tests/it/json.rs` compares the table with the commands' output, both ways.

use avastra_base::folded;

/// A field of a result.
#[derive(Debug, serde::Serialize)]
pub struct Field {
    /// Where it stands: `files[].file` is the field `file` of each entry of the list `files`.
    path: &'static str,
    /// `text`, `number`, `bool`, `list`, or `object` with fields that follow or that the meaning names; with `?` it
    /// may be null.
    kind: &'static str,
    meaning: &'static str,
}

/// A command, with the option that leads to another result, and the fields of its result.
#[derive(Debug, serde::Serialize)]
pub struct Shape {
    command: &'static str,
    fields: Vec<Field>,
}

const INTRODUCTION: &str = "\
With `--format json` the last line on stdout is one object with the result of the
command, whether it failed or not. Diagnostics go to stderr, one object a line.
Every result has these fields:";

/// Fields of every command's result.
const ALWAYS: &str = "\
schema number rises when a field changes its meaning or goes away
command text the command
status number the exit status
error text? why the command failed";

const AFTER: &str = "\
Below are the fields of each command. A command that failed early has found nothing:
its own fields are absent. `?` is for what may be null, `[]` for each entry of a list.";

/// Fields of several commands, each with the word that stands for it in [`SHAPES`].
const SHARED: [(&str, &str); 3] = [
    ("FAILED", "failed[] object a file for which nothing was found: `file` and `error`"),
    (
        "REPRODUCIBLE",
        "reproducible bool false if a driving system of your own is not deterministic, as it says or as was found, or missed \
         steps",
    ),
    (
        "PLANNED",
        "planned object with `--dry-run`, and then alone: `units` and `episodes` that would be played, `shards_max` into \
         which it can be cut",
    ),
];

/// Every command with a result, and below it the fields: path, kind and meaning, as in [`Field`].
const SHAPES: &str = "\
check
  errors number mistakes in all files
  warnings number warnings in all files
  files[].file text its path
  files[].errors number its mistakes
  files[].dump object? with `--dump`: the tree, or the table as in `table`
  files[].audit object? with `--audit`: `rules`, each with its rows and what it cuts
  FAILED
compile
  table text path of the written table
  rows number rows of the table
table
  version number of the table's form
  space text path of the space
  digest text of the space and all that it uses
  rules[].name text
  rules[].optional bool off unless `--with` names it
  rules[].rows number rows that it binds
  rows[].row number from 0
  rows[].action text
  rows[].axes[] object an `each` parameter: `name` and `value`
  rows[].rules[] text names of the rules that bind it
  rows[].roads[].road text
  rows[].roads[].masked text why it cannot run there; absent if it can
  rows[].roads[].draws[] object what is drawn: `name`, `values` or `low`, `high` and `unit`
  trials object? with `--try`: its settings
  cells[] object? with `--try`: a row on a road, with its tries and why any failed
table --markdown
  text text Markdown
table --row
  row number
  label text the row in words
  road text
  states object the value of each state, as given or as an episode may begin
  legal bool here and now
  rule text? the rule that refuses it; null if the world does
  reason text? why it is refused
fmt
  unformatted number files that were not formatted
  texts[] text what was read from stdin, formatted
explain
  pages[].code text
  pages[].title text
  pages[].text text Markdown
  always[] object with `json`: a field of every result
  shapes[] object with `json`: `command` and its `fields`
diff
  differences[].change text what happened to it
  differences[].subject text what differs
  differences[].detail text may be empty
new
  files[] text paths of the files written
completions
  shell text
  script text what the shell reads
run
  PLANNED
  directory text the run directory
  trained_elsewhere text? of `--policy`: on which other road, or against which other driving system, profile or traffic, it was trained
  totals object sums over all episodes: how they ended; `collisions`, those `counted` and their kinds; `findings` (counted collisions and breached requirements; a requirement counts once an episode), those that were played again (`replayed`), those that recur (`recurring`) and the counted collisions among these (`counted_recurring`); `red_runs`, and episodes with one in which nothing was found (`red_unkept`)
  failed_replays number replays in which your driving system failed, since the command began: they say nothing
  refusals[] object a reason why actions were refused: `reason` and `times`
  groups[] object a distinct failure: its type among NHTSA's pre-crash types (`precrash`, `precrash_number`), the modules at fault, `count`, how many were played again (`tried`) and recur (`recurring`), an episode that shows it with its own `recurrence`, what happened there
  never.rows number rows of the table
  never.steps number steps of all episodes
  never.asked[] object a row for which the agent never asked
  never.legal[] object a row that was never legal when the agent asked for it; what `refused` it, and how often
  never.chosen[] object a row that was legal, but that the agent never chose
  never.realised[] object a row that was chosen, but never carried out
  requirements[] object a requirement in force: for how long it was asked (`asked_s`, `asked_in` episodes), `breaches`, `breached_in`, `tried_in` and `kept_in` (episodes with a breach; of these, those that careful drivers drove, and that one kept), the `smallest` margin in its `unit`, the `nearest` episode, a `scenario` with the worst breach of those that were written
  left object what was found by kinds, and what is left: `simulated_h`; the `kinds` that recur, each with its number of `episodes`, the simulated hours until the first (`first_h`) with its `scenario`, and the `worst` scenario that is about it; the `chance` that the next hour shows a new kind (`next_hour`), with a 90 % interval from `low` to `high`, or null if nothing can be said
  critical[] text scenarios with a counted collision or a breach, the surest and worst first
  found[] object an episode with a finding: `road`, `episode`, whether it has a counted collision or a breach (`critical`), what the rest is about (`finding`: `collision` or a requirement; one that recurs comes first), its `recurrence` (`recurred` of `replays`), its `harm`
  tests[] object of `every-row`: an action that was carried out, or that was refused (why is `refused`; without an `ending`): `episode`, `road`, `action`, its `values`, its `ending` (`avoided`, `near`, `mitigated`, `hit`, `others_crashed`, `failed`: the driving system failed), speeds before and at the first contact (m/s) and its `precrash` type, the least `ttc_s`, whether a collision is `counted`, what was `breached`, whether other road users crashed into each other (`others_crashed`)
  tables[] text of `every-row`: the same as CSV and as JUnit XML
  thinking object? of a driving system of your own that was asked: `answers`, seconds by the wall clock (`median_s`, `most_of_99_s`, `most_s`), the share `beyond_period`, how many were `late`
  kept[] text with `--keep`: paths of episodes without a finding: with a collision that does not count, then those that did not arrive, then the nearest misses
  failures[] object what went wrong with a driving system of your own: `kind`, `problem`, `times`, `detail`, `scenario`
  REPRODUCIBLE
ads check
  checks[] object `stage`, `passed`, what was `found`, the `failure` if it is one of the protocol
  speed object? `questions`, `round_trips_per_s` and `share` of the episode's time
  drives[] object with `--drive`, alone and among vehicles (`ambient`): `drives`, those that `arrived` or `ended` otherwise, `counted` of the `collisions`, the `breaches` of requirements with their first place; medians and 99 of 100 of the offset from the route (`beside_m`) and of what was done after 1 s against what was asked (`astray_m`, `off_mps`)
ads schema
  protocol object the JSON Schema of every message
train
  directory text the run directory
  totals object as in `run`, of the training alone
  groups[] object a distinct failure of the training and its evaluation, as in `run`
  requirements[] object a requirement in force, as in `run`; careful drivers are tried in the first episode of each
  left object the kinds that recur, as in `run`, those of the evaluation included; its `next_hour` is always null
  simulated_h number time driven
  policy text? path of the policy; a search has none
  rules object? what its readable rules achieve
  evaluation object what it learned, in episodes of its own; its `failures` by kind
  failures[] object of the training, as in `run`
  REPRODUCIBLE
policy distil
  policy text path of the written policy
  lines number rules
  rules object? what they achieve
policy explain
  policy text its name
  roads[] text
  insight object rows that it prefers, Q-values in a state, importance of each variable
policy weights
  file text the safetensors file
  layers[] number widths of the network
  dueling bool
estimate
  PLANNED
  directory text where the estimate stands
  results.schema number of `results`, as in results.json
  results.event text `counted`, `collision`, `breach` or the name of a requirement
  results.method text `count` or `probe`
  results.parts number parts that are done
  results.parts_wanted number all parts, if it does not stop before
  results.missed_goals[] text of `--precision` and `--hours`, what was wanted and what was reached
  results.missing number share of such estimates whose intervals miss the truth, at most
  results.missing_at_look number the same of one look; those of all looks share it
  results.roads[] object `road`, with the fields of `results.together` for it
  results.together.probability number of the event in an episode
  results.together.interval object `low` and `high`
  results.together.per_1000_km number? episodes with the event in 1,000 km
  results.together.per_1000_km_interval object? `low` and `high`
  results.together.per_hour number? the same in an hour of driving
  results.together.per_hour_interval object? `low` and `high`
  results.together.episodes number played from start to end
  results.together.driven_km number in these
  results.together.simulated_h number in all, trials and the pilot included
  results.together.gain number? simulated time that counting would need, over that needed
  results.together.effective_events number? as many events of one weight would say as much; of `probe` alone
  results.together.parts number samples
  results.together.parts_without number those of them whose estimate is 0
  results.mass[].road text where the probability lies, the most of it first
  results.mass[].row text? absent where what was hit appeared by no action
  results.mass[].share number of the probability on all roads
  results.mass[].events number that it was found in; each is in estimate.db, with its weight
  critical[] text paths of the scenarios
  REPRODUCIBLE
merge
  directory text? the merged directory; null with `--missing`
  shards number how many there are
  missing[] number a shard that is to be played again, or gone on with
estimate --than
  sides[] text the two driving systems
  results.schema number of `results`
  results.event text `counted`, `collision`, `breach` or the name of a requirement
  results.episodes number pairs
  results.both number pairs with the event under both
  results.first_only number under the first alone
  results.second_only number under the second alone
  results.driven_km[] number of the first, of the second
  results.probability[] number of the event in an episode, of the first, of the second
  results.intervals[] object of these, 95 %: `low` and `high`
  results.difference number the second's probability less the first's
  results.difference_interval object 95 %: `low` and `high`
  results.p number of the sign test
  results.told_apart_km number? driven by both until p stays below 0.05
  REPRODUCIBLE
study
  PLANNED
  directory text where results.json lies
  results object? as in results.json; absent if the driving system failed
  failures[] object a cell that a driving system of your own failed in: `agent`, `road`, `number`, and how often by \
    kind, `trained` and `evaluated`
  timing[] object of an agent: `cells`, mean `wall_s` and `cpu_s`, null where no times are known
study results
  output text where the results were written
  studies[] object `study`, its name; of a played one its `cells`, and how it departs from its file: `smaller`, `other`
replay
  confirmed number claims that hold
  refuted number claims that do not
  untried number claims that only the driving system itself can show
  policies[] object `file`, `policy` and the claims `refuted`, in words
  scenarios[] object `file`, `scenario`, what has `changed` since it was written, `ads`, `claims`, `end`, the \
    `failure` of a driving system of your own, whether it is `reproducible`; what its speed was `held` by, from when \
    on; collisions and how hard they were; the `crashes` of other road users into each other; the `breaches` of requirements: which, from when to when, the smallest `margin`
  FAILED
diagnose
  causes[] object? `cause` (one or two modules, what the finding hangs on, or none) and `count`
  scenarios[] object `file`, `scenario`; of `modular` its `diagnosis`, of others the `swaps`: what was changed, what became of it, and what it `hangs_on`; with `--moment` when it happened (`found_s`), the `moments` looked at with the branches in which it happened again (`recurred` of `replays`; `failed`: others in which the driving system failed), when more than three quarters did (`rises_s`), `avoidable_until_s`, and with `--write` how many were `written`
  FAILED
shrink
  median_steps_before number
  median_actions_before number
  median_steps number
  median_actions number
  kept number scenarios of which every written claim holds
  scenarios[] object `file`, `output`, steps and actions before and after, what was kept and traded (`worth_before`, `worth`, the `requirement` of a breach), other findings that are `gone`, claims `refuted`
  REPRODUCIBLE
  FAILED
triage
  simulated_h number simulated time of the runs, h
  known[].name text a known failure of which something was found
  known[].episodes number episodes with a finding of it that recurs
  known[].scenario text the scenario of the first
  known[].before object? `episodes` and `hours` when it was named
  open list known failures of which findings are there, but none was shown to recur: as `known`
  gone[].name text a known failure of which nothing was found
  gone[].before object? as in `known`
  gone[].chance number? the chance to find nothing of it although it comes as before
  new[].name text the kind of findings that no rule fits
  new[].episodes number as in `known`
  new[].scenario text as in `known`
  new[].before object? always null
  unsure number findings that were not shown to recur; they are left out
  added number kinds that `--add` wrote
test
  still_fails number scenarios with the same crash
  fixed number scenarios without a failure, whose rate of failures under other noise is below `--below` with 95 %
  passed number scenarios without a failure that were not played often enough to be `fixed`, or that were found with another driving system
  recorded number scenarios that were played from recorded answers: no program was asked
  changed number scenarios with another crash, that never meet the obstacle, whose crash a review finds gone, or that no longer fail from recorded answers
  errors number scenarios that could not be played
  ads_failed number scenarios in which an external driving system failed
  accepted number scenarios that `--accept` changed
  reviewed[] object with `--review` or `--accept`: `file`, `scenario`, the `change` in a few words, and its \
    `differences`
  REPRODUCIBLE
  scenarios[].file text
  scenarios[].scenario text its name
  scenarios[].outcome text `still fails`, `fixed`, `passed`, `changed`, `gone`, `ads failed`, `error`
  scenarios[].reason text may be empty
  scenarios[].recorded bool from recorded answers: no program was asked
  scenarios[].found_with text? the driving system that found it, if it is another than the one under test
  scenarios[].again object? plays under other noise (`replays`), and those that failed (`recurred`)
  scenarios[].ads_failed number further such plays in which the driving system itself failed
report
  page text its path
  scenarios number on the page
  shrunk number of them, those in a folder of shrunk copies
  left_out number scenarios beyond `--most`
  bytes number size of the page
  refuted number claims that do not hold: what only further plays show is not tried
  compared object? with `--ads`: how many crashes are the `same`, at an `other_time`, `gone`, `new` and so on
  FAILED
import
  files[] text paths of what was written, maps too
  imported[].file text the OpenSCENARIO file
  imported[].space text? path of its space; null if it was refused, or is an export of avastra
  imported[].scenario text? path of its scenario; null without one: if it was refused, or has many variations
  imported[].notes[] text what drives otherwise than in the file
  imported[].refused[].scenario text? the scenario that a file of variations names, where the line is of that
  imported[].refused[].line number where the language cannot say what the file says
  imported[].refused[].element text
  imported[].refused[].reason text
export
  files[] text paths of what was written, maps too
  left_out[] object `file`, and `what` the player of `--profile` cannot be told
  refuted number scenarios that do not replay, and were not written
  FAILED
render
  picture text its path
  times_s[] number moments drawn
  changed text? what has changed since the scenario was written
  svg text? the picture, if its path is `-`
road
  file text
  name text of the map
  pose_fields[] text what stands where in a pose
  lanes[] object `key`, length, limit, links, neighbours, a pose each metre
  junctions[] object `id`, `name`, `groups`, `connections`
  signals[] object `id`, place, `junction`, `group`, the lanes that it stops
  crosswalks[] object `id` and `outline_m`
  route object? lanes, lane changes, stop lines and conflicts along the way
  warnings[] text what was wrong with the map
  svg text? the picture, with `--svg -`";

/// The field that a line is about.
fn field(line: &'static str) -> Field {
    let line = SHARED.iter().find(|(word, _)| *word == line).map_or(line, |(_, shared)| *shared);
    let mut parts = line.splitn(3, ' ');
    let mut part = || parts.next().unwrap_or_default();
    Field { path: part(), kind: part(), meaning: part() }
}

/// The fields of every command's result.
pub fn always() -> Vec<Field> {
    ALWAYS.lines().map(field).collect()
}

/// Every command with a result.
pub fn shapes() -> Vec<Shape> {
    let mut shapes: Vec<Shape> = Vec::new();
    for line in SHAPES.lines() {
        match line.strip_prefix("  ") {
            None => shapes.push(Shape { command: line, fields: Vec::new() }),
            Some(line) => {
                shapes.last_mut().expect("a command stands above its fields").fields.push(field(line))
            }
        }
    }
    shapes
}

/// All of it, for people.
pub fn in_words() -> String {
    let mut text = INTRODUCTION.to_owned();
    add(&mut text, &always());
    text.push_str(&format!("\n\n{AFTER}"));
    for Shape { command, fields } in shapes() {
        text.push_str(&format!("\n\n{command}"));
        add(&mut text, &fields);
    }
    text
}

fn add(text: &mut String, fields: &[Field]) {
    for Field { path, kind, meaning } in fields {
        let meaning = folded(meaning, 80 - 36);
        text.push_str(format!("\n  {path:<24} {kind:<8} {}", meaning[0]).trim_end());
        meaning[1..].iter().for_each(|line| text.push_str(&format!("\n{:36}{line}", "")));
    }
}
