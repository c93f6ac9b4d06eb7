// The first thing that one sees: what was found, the worst scenario, the list, the rows, the curves.
import { el, refill, table } from "./dom.js";
import { curve } from "./charts.js";
import { coverage } from "./coverage.js";
import { estimate } from "./estimate.js";
import { heat, protocolTiles } from "./heat.js";
import { showList } from "./list.js";
import { linkOf, nameOf } from "./link.js";
import { study } from "./study.js";
import { CHANGES, driverInWords, figure, mainCollision, plural, simulated } from "./words.js";

/** @import { Index } from "./data" */

/**
 * Fills an element with the overview.
 * @param {HTMLElement} place
 * @param {Index} data
 * @param {string | null} missing what the link names and the page has not
 */
export function showOverview(place, data, missing = null) {
  const { overview, scenarios } = data;
  const list = el("div", { id: "scenarios" });
  refill(
    place,
    el("h1", {}, heading(data)),
    overview && conditions(overview.conditions),
    missing && el("p", { class: "warning" }, `The link names a scenario that is not on this page: ${missing}.`),
    refuted(scenarios),
    overview && overview.totals && totals(overview),
    compared(data),
    data.remarks.map((remark) => el("p", { class: "warning" }, remark)),
    overview?.protocol && protocolTiles(overview.protocol),
    overview && required(overview, scenarios),
    overview && results(overview, scenarios),
    overview && heat(overview, scenarios),
    scenarios.length > 0 &&
      el("section", { "aria-labelledby": "h-list" }, el("h2", { id: "h-list" }, "Scenarios"), list),
    scenarios.length === 0 && ["run", "training"].includes(overview?.kind) && el("p", {}, nothingShown(overview)),
    overview && coverage(overview),
    overview && refusals(overview),
    overview &&
      el(
        "details",
        { class: "settings" },
        el("summary", {}, "Settings, to do it again"),
        el("pre", { tabindex: "0" }, overview.settings),
      ),
  );
  if (scenarios.length > 0) showList(list, data);
}

/** What was measured, by what the directory holds. */
function results(overview, scenarios) {
  const of = {
    run: () => kinds(overview.left, scenarios),
    training: () => [
      kinds(overview.left, scenarios),
      overview.evaluation && evaluation(overview.evaluation),
      learning(overview.learning),
    ],
    study: () => study(overview.study),
    estimate: () => estimate(overview.estimate, overview.frame),
  };
  return of[overview.kind]();
}

/** Why there is no scenario. */
function nothingShown(overview) {
  const sums = overview?.totals;
  const isCalm = sums?.counted === 0 && sums.failed === 0 && sums.episodes_with_breach === 0;
  return isCalm
    ? "No scenario was written: nothing that counts happened. More episodes or other roads may find more."
    : "None of the scenarios can be shown here.";
}

/** `Run 0001`, or what there is without one. */
function heading({ title, overview }) {
  const name = title.replace(/\/$/, "").replace(/^.*\//, "");
  return overview?.kind ? `${overview.kind[0].toUpperCase()}${overview.kind.slice(1)} ${name}` : name;
}

/** What was played against what: name and text of each. */
function conditions(known) {
  if (!known) return null;
  return el(
    "dl",
    { class: "conditions", "aria-label": "Conditions" },
    known.map(([name, text]) => el("div", {}, el("dt", {}, name), el("dd", {}, text))),
  );
}

/** Scenarios that do not play as their files say, before anything that is told of them. */
function refuted(scenarios) {
  const wrong = scenarios.filter((entry) => entry.summary.refuted.length > 0);
  if (wrong.length === 0) return null;
  const links = wrong.flatMap((entry, i) => [
    i > 0 ? ", " : "",
    el("a", { href: linkOf({ s: nameOf(entry) }) }, nameOf(entry)),
  ]);
  const verb = wrong.length === 1 ? "does not play as its file claims" : "do not play as their files claim";
  return el(
    "p",
    { class: "warning", id: "refuted" },
    el("strong", {}, `${wrong.length} of ${plural(scenarios.length, "scenario")} ${verb}: `),
    ...links,
    ". The page shows what the replay did.",
  );
}

/** What the other driving system makes of the scenarios, in a sentence. */
function compared({ scenarios, compared_with: other }) {
  if (!other) return null;
  const sums = new Map();
  for (const { change } of scenarios) if (change) sums.set(change.kind, (sums.get(change.kind) ?? 0) + 1);
  const told = [...sums].map(([kind, count]) => `${count} × ${CHANGES[kind] ?? kind}`);
  return el("p", { class: "lead", id: "compared" }, `With ${driverInWords(other)}: ${told.join(", ")}.`);
}

/** What a finished training can do, on episodes that it did not learn from. */
function evaluation(found) {
  const sentence =
    `On ${plural(found.episodes, "episode")} of its own: ${plural(found.counted, "collision")} that count in ` +
    `${plural(found.colliding, "episode")}, ${found.collisions} in all, return ${figure(found.return, "", 3)}, in ` +
    `${simulated(found.simulated_h)} of simulated time.`;
  return el(
    "section",
    { "aria-labelledby": "h-evaluation" },
    el("h2", { id: "h-evaluation" }, "What it learned"),
    el("p", {}, sentence),
  );
}

function totals({ totals: sums, simulated_h: simulatedH, requirements, mixed }) {
  const broken = requirements.filter((of) => of.breaches > 0);
  const breaches = broken.reduce((sum, of) => sum + of.breaches, 0);
  // A red light is no counted collision and, without a requirement that says so, no breach.
  const isGood = sums.counted === 0 && breaches === 0 && sums.red_runs === 0 && sums.failed === 0;
  const tile = (value, name, kind) =>
    el("div", { class: `tile ${kind ?? ""}` }, el("dd", {}, value), el("dt", {}, name));
  const ends = [
    ["arrived", "at the goal"],
    ["stalled", "stalled"],
    ["blocked", "blocked"],
    ["astray", "out of its lane"],
    ["left_map", "off the map"],
    ["step_limit", "at the step limit"],
    ["failed", "driving system failed"],
  ];
  const said = ends
    .filter(([name]) => sums[name] > 0)
    .map(([name, words]) => `${sums[name]} ${words}`)
    .join(", ");
  return el(
    "section",
    { "aria-label": "Totals" },
    el(
      "dl",
      { class: "tiles" },
      tile(sums.counted, "collisions that count", sums.counted > 0 ? "bad" : isGood ? "good" : ""),
      requirements.length > 0 &&
        tile(
          breaches,
          `breaches, of ${broken.length} of ${plural(requirements.length, "requirement")}`,
          breaches > 0 ? "bad" : isGood ? "good" : "",
        ),
      tile(sums.collisions, "collisions in all"),
      tile(sums.episodes, "episodes"),
      tile(figure(sums.driven_m / 1000, "km", 1), "driven"),
      tile(simulated(simulatedH), "of simulated time"),
      tile(sums.red_runs, "red lights passed", sums.red_runs > 0 ? "bad" : ""),
      sums.stuck > 0 && tile(sums.stuck, "episodes in which it got stuck", 2 * sums.stuck > sums.episodes ? "bad" : ""),
    ),
    el(
      "p",
      { class: "muted" },
      `Episodes ended: ${said}. Of all collisions, a careful driver would have avoided ${sums.avoidable}, ` +
        `only a quicker one or an evasive manoeuvre ${sums.beyond_reference}, none ${sums.unavoidable}; ` +
        `the ego vehicle had priority in ` +
        `${sums.wronged}, the other in ${sums.wrong}.` +
        (sums.replayed > 0
          ? ` Of ${plural(sums.replayed, "finding")} played again under other noise, ${sums.recurring} recur, which ` +
            `means that the 95 % interval of the share of replays lies above one half${mixed ? `; ${mixed}` : ""}.`
          : "") +
        (sums.red_unkept > 0
          ? ` ${plural(sums.red_unkept, "episode")} with a red light passed kept as no scenario: ` +
            `nothing of the space asks about it.`
          : ""),
    ),
  );
}

/** Every requirement in force: what it asks, whether it was kept and by how much, and for how long it was asked. */
function required({ requirements }, scenarios) {
  if (!requirements || requirements.length === 0) return null;
  const rows = requirements.map((of) => [
    el(
      "details",
      {},
      el("summary", {}, of.requirement),
      of.formula && el("code", {}, of.formula),
      of.docs && el("p", {}, of.docs),
    ),
    verdictOf(of),
    of.breaches > 0 ? `${of.breaches} in ${plural(of.breached_in, "episode")}` : "0",
    of.tried_in > 0 ? `${of.kept_in} of ${of.tried_in}` : "–",
    marginOf(of),
    of.asked_in > 0 ? `${figure(of.asked_s, "s", 1)} in ${plural(of.asked_in, "episode")}` : "never asked",
    exampleOf(of, scenarios),
  ]);
  const heads = [
    "Requirement",
    "Result",
    "Breaches",
    "Episodes kept by a careful driver",
    "Margin",
    "Asked",
    "Example",
  ];
  return el(
    "section",
    { "aria-labelledby": "h-required", id: "required" },
    el("h2", { id: "h-required" }, "Requirements"),
    table("What the ego vehicle must keep; a click on a name shows the formula", heads, rows),
  );
}

/** The kinds of failures that recur, since when each is known, and the chance of another. */
function kinds({ simulated_h: hours, kinds: found, next_hour: next }, scenarios) {
  if (found.length === 0 && !next) return null;
  const rows = found.map((of) => [
    of.kind,
    figure(of.first_h, "h", 1),
    String(of.episodes),
    exampleOf({ scenario: of.worst }, scenarios),
  ]);
  const points = [
    [0, 0],
    ...found.flatMap((of, i) => [
      [of.first_h, i],
      [of.first_h, i + 1],
    ]),
    [hours, found.length],
  ];
  return el(
    "section",
    { "aria-labelledby": "h-kinds", id: "kinds" },
    el("h2", { id: "h-kinds" }, "Kinds of failures that recur"),
    next &&
      el(
        "p",
        { class: "lead" },
        `The chance that an hour more shows a new kind is at most ${(Math.ceil(100 * next.high) / 100).toFixed(2)} ` +
          `(best guess ${next.chance.toFixed(2)}).`,
      ),
    found.length > 0 &&
      table("In the order in which they were seen first", ["Kind", "First after", "Episodes", "Worst"], rows),
    found.length > 1 && next && curve("Kinds seen so far", points, "simulated hours", 1),
  );
}

/** In a word. What was never asked is not kept. */
function verdictOf({ breaches, asked_in: askedIn, smallest, unit }) {
  if (breaches > 0) return el("strong", { class: "bad" }, "breached");
  if (askedIn === 0) return "never asked";
  return unit !== null && smallest === null ? "not breached" : "kept";
}

/** How far it was broken, or how near it came to that. */
function marginOf({ breaches, smallest, unit }) {
  if (smallest === null || unit === null) return "–";
  const text = figure(Math.abs(smallest), unit, 2).trim();
  return breaches > 0 ? `broken by up to ${text}` : `kept by at least ${text}`;
}

/** The scenario of the worst breach, if it is on the page. */
function exampleOf({ scenario }, scenarios) {
  if (!scenario) return "–";
  const entry = scenarios.find((one) => one.summary.name === scenario);
  return entry ? el("a", { href: linkOf({ s: nameOf(entry) }) }, scenario) : scenario;
}

function learning(points) {
  if (points.length === 0) return null;
  // Before the first update there is no loss.
  const of = (name) => points.filter((point) => point[name] !== null).map((point) => [point.episode, point[name]]);
  const window = Math.max(5, Math.round(points.length / 20));
  return el(
    "section",
    { "aria-labelledby": "h-learning" },
    el("h2", { id: "h-learning" }, "Learning"),
    el(
      "div",
      { class: "grid" },
      curve("Return of an episode", of("reward"), "episode", window),
      curve("Counted collisions of an episode", of("counted"), "episode", window),
      curve("Loss", of("loss"), "episode", window),
      points.some((point) => point.exploration > 0) && curve("Exploration", of("exploration"), "episode", 1),
    ),
  );
}

function refusals(overview) {
  const rows = (overview.refusals ?? []).map(({ reason, times }) => [reason, times]);
  if (rows.length === 0) return null;
  return el(
    "section",
    {},
    el("h2", {}, "Refused actions"),
    table("Chosen actions that could not be carried out", ["Reason", "Times"], rows.slice(0, 30)),
  );
}

/** The line at the top of every page. */
export function showTop(place, data) {
  // A shrunk twin may hit harder; the worst is one that was found.
  const worst = data.scenarios.find((entry) => !entry.shrunk_from) ?? data.scenarios[0];
  const collision = worst && mainCollision(worst.summary);
  refill(
    place,
    el("a", { class: "brand", href: "#" }, "avastra"),
    el("span", { class: "muted" }, data.overview?.kind ?? plural(data.scenarios.length, "scenario")),
    collision && el("a", { href: linkOf({ s: nameOf(worst) }), class: "worst" }, "Watch the worst"),
  );
}
