// The first thing that one sees: what was found, the worst scenario, the list, the rows, the curves.
import { el, refill, table } from "./dom.js";
import { curve } from "./charts.js";
import { coverage } from "./coverage.js";
import { showList } from "./list.js";
import { linkOf } from "./link.js";
import { study } from "./study.js";
import { figure, mainCollision, plural } from "./words.js";

/** Fills an element with the overview. */
export function showOverview(place, data) {
  const { overview, scenarios } = data;
  const list = el("div", { id: "scenarios" });
  refill(
    place,
    el("h1", {}, heading(data)),
    overview && overview.totals && totals(overview.totals),
    data.remarks.map((remark) => el("p", { class: "warning" }, remark)),
    overview?.kind === "training" && learning(overview.learning),
    overview?.kind === "study" && study(overview.study),
    scenarios.length > 0 && el("section", { "aria-labelledby": "h-list" }, el("h2", { id: "h-list" }, "Scenarios"), list),
    scenarios.length === 0 && overview?.kind !== "study" && el("p", {}, nothingShown(overview)),
    overview && coverage(overview),
    overview && refusals(overview),
    overview && el("details", { class: "settings" }, el("summary", {}, "Settings, to do it again"), el("pre", { tabindex: "0" }, overview.settings)),
  );
  if (scenarios.length > 0) showList(list, data);
}

/** Why there is no scenario. */
function nothingShown(overview) {
  const isCalm = overview?.totals?.counted === 0 && overview.totals.failed === 0;
  return isCalm ? "No scenario was written: nothing that counts happened." : "None of the scenarios can be shown here.";
}

/** `Run 0001`, or what there is without one. */
function heading({ title, overview }) {
  const name = title.replace(/\/$/, "").replace(/^.*\//, "");
  return overview?.kind ? `${overview.kind[0].toUpperCase()}${overview.kind.slice(1)} ${name}` : name;
}

function totals(sums) {
  const tile = (value, name, kind) => el("div", { class: `tile ${kind ?? ""}` }, el("dd", {}, value), el("dt", {}, name));
  const ends = [["arrived", "at the goal"], ["stalled", "stalled"], ["blocked", "blocked"], ["astray", "out of its lane"], ["step_limit", "at the step limit"], ["failed", "driving system failed"]];
  const said = ends.filter(([name]) => sums[name] > 0).map(([name, words]) => `${sums[name]} ${words}`).join(", ");
  return el(
    "section",
    { "aria-label": "Totals" },
    el(
      "dl",
      { class: "tiles" },
      tile(sums.counted, "collisions that count", sums.counted > 0 ? "bad" : "good"),
      tile(sums.collisions, "collisions in all"),
      tile(sums.episodes, "episodes"),
      tile(figure(sums.driven_m / 1000, "km", 1), "driven"),
      tile(figure(sums.simulated_s / 3600, "h", 1), "of simulated time"),
      tile(sums.red_runs, "red lights passed", sums.red_runs > 0 ? "bad" : ""),
    ),
    el("p", { class: "muted" }, `Episodes ended: ${said}. Of all collisions, a careful driver would have avoided ${sums.avoidable}, only one without delay ${sums.beyond_reference}, none ${sums.unavoidable}; the ego vehicle had priority in ${sums.wronged}, the other in ${sums.wrong}.`),
  );
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
  return el("section", {}, el("h2", {}, "Refused actions"), table("Chosen actions that could not be carried out", ["Reason", "Times"], rows.slice(0, 30)));
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
    collision && el("a", { href: linkOf({ s: worst.n }), class: "worst" }, "Watch the worst"),
  );
}
