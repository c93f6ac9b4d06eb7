// A study's results: for each road what every agent found, with intervals as plots, and the comparisons.
import { el, table } from "./dom.js";
import { curve, intervals } from "./charts.js";
import { figure } from "./words.js";

const MEASURES = [
  ["counted", "Counted collisions"],
  ["collisions", "All collisions"],
  ["distinct", "Distinct failures"],
  ["colliding", "Colliding episodes"],
  ["ttfc_s", "Time to first counted collision, s"],
];

/** An interval in brackets; none where there are too few values, ∞ without a bound. */
const span = (found) =>
  found?.low === undefined || found.low === null
    ? ""
    : `[${figure(found.low, "", 2)}, ${found.high === null ? "∞" : figure(found.high, "", 2)}]`;

/** The whole study. */
export function study(results) {
  const plan = results.evaluation;
  return [
    results.question && el("p", { class: "lead" }, results.question),
    results.quick && el("p", { class: "warning" }, "Cut down by --quick: no result, but a sign that it works."),
    results.cells < results.cells_wanted &&
      el("p", { class: "warning" }, `Unfinished: ${results.cells} of ${results.cells_wanted} cells.`),
    el(
      "p",
      { class: "muted" },
      `Numbers are of ${plan.episodes} episodes, averaged over ${plan.seeds} seeds; ` +
        "lines and brackets are 95 % intervals.",
    ),
    results.roads.filter((road) => road.agents.length > 0).map(onRoad),
    together(results),
  ];
}

function onRoad(road) {
  const plots = MEASURES.map(([name, title]) =>
    intervals(
      `${title} on ${road.road}`,
      road.agents.map(({ agent, measures }) => [
        agent,
        measures[name]?.mean,
        measures[name]?.low,
        measures[name]?.high,
      ]),
    ),
  );
  const rows = road.agents.map(({ agent, cells, measures }) => [
    agent,
    cells,
    ...MEASURES.map(([name]) =>
      measures[name] ? `${figure(measures[name].mean, "", 2)} ${span(measures[name])}` : "–",
    ),
  ]);
  const compared = road.comparisons.map((one) => [
    `${one.agent} / ${one.baseline}`,
    one.measure,
    one.ratio === null ? "–" : `${figure(one.ratio, "", 2)} ${span(one.ratio_interval)}`,
    `${figure(one.superiority, "", 2)} ${span(one.superiority_interval)}`,
    figure(one.p, "", 4),
    figure(one.p_holm, "", 4),
  ]);
  return el(
    "section",
    { class: "study" },
    el("h2", {}, road.road),
    el("div", { class: "grid" }, plots),
    table(`Found on ${road.road}`, ["Agent", "Cells", ...MEASURES.map(([, title]) => title)], rows),
    compared.length > 0 &&
      table(`Comparisons on ${road.road}`, ["Agents", "By", "Ratio", "Â12", "p", "p (Holm)"], compared),
    el(
      "div",
      { class: "grid" },
      road.agents.filter((one) => one.curve?.length > 1).map((one) => learned(one, road.road)),
    ),
  );
}

/** The curve of an agent's trainings, averaged over them. */
function learned({ agent, curve: points }, road) {
  const window = Math.max(5, Math.round(points.length / 20));
  return curve(
    `Counted collisions of an episode of training: ${agent} on ${road}`,
    points.map((point) => [point.episode, point.counted]),
    "episode",
    window,
  );
}

function together(results) {
  const rate = (found) => (found.rate === null ? "–" : `${figure(found.rate, "", 2)} ${span(found)}`);
  const rows = results.together
    .filter((one) => one.episodes.episodes > 0)
    .map(({ agent, episodes }) => [
      agent,
      episodes.episodes,
      figure(episodes.driven_km, "", 1),
      rate(episodes.colliding),
      rate(episodes.collisions_per_1000_km),
      rate(episodes.counted_per_1000_km),
      rate(episodes.red_runs_per_1000_km),
    ]);
  if (rows.length === 0) return null;
  return el(
    "section",
    {},
    el("h2", {}, "All roads together"),
    table(
      "All roads together",
      [
        "Agent",
        "Episodes",
        "km",
        "With a counted one",
        "Collisions / 1000 km",
        "Counted / 1000 km",
        "Red runs / 1000 km",
      ],
      rows,
    ),
  );
}
