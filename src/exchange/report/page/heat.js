// What came of actions by the values of their parameters, as the maps of a protocol: green where the ego vehicle kept
// clear, red where it hit at nearly the speed before.
import { el } from "./dom.js";
import { linkOf, nameOf } from "./link.js";
import { figure, plural } from "./words.js";

/** How an action ends, in the order in which the counts come. */
const HEAT_ENDINGS = ["avoided", "near miss", "mitigated", "hit", "others crashed", "driving system failed"];
const HEAT_KINDS = ["good", "", "", "bad", "", "bad"];
const HEAT_SIGNS = ["●", "◔", "◑", "○", "⊘", "✖"];
/** A test whose road users crashed into each other shows nothing of the ego vehicle. */
const HEAT_OTHERS = 4;
/** No test at all: the driving system failed. */
const HEAT_FAILED = 5;

/** How the tests of a protocol ended, each ending with its share. */
export function protocolTiles({ text, tally }) {
  const all = tally.endings.reduce((sum, count) => sum + count, 0);
  const tile = (count, name, kind) =>
    el(
      "div",
      { class: `tile ${kind}` },
      el("dd", {}, count, el("small", {}, ` ${Math.round((100 * count) / all)} %`)),
      el("dt", {}, name),
    );
  const tiles = HEAT_ENDINGS.map(
    (ending, at) => tally.endings[at] > 0 && tile(tally.endings[at], ending, HEAT_KINDS[at]),
  );
  return el(
    "section",
    { id: "protocol", "aria-label": "Protocol" },
    el("p", { class: "lead" }, `Protocol: ${text}.`),
    all > 0 && el("dl", { class: "tiles" }, tiles, tally.breached > 0 && tile(tally.breached, "with a breach", "bad")),
  );
}

/** A section with a map for each pair of parameters; nothing without one. */
export function heat(overview, scenarios) {
  const maps = overview.heat ?? [];
  if (maps.length === 0) return null;
  return el(
    "section",
    { "aria-labelledby": "h-heat" },
    el("h2", { id: "h-heat" }, "By parameters"),
    el(
      "p",
      { class: "legend" },
      HEAT_ENDINGS.map((ending, at) => [el("span", { class: `heat-${at}` }, `${HEAT_SIGNS[at]} ${ending}`), " "]),
      "· ⚑ a requirement was breached · a near miss had a time to collision or a post-encroachment time below 1.5 s; " +
        "a mitigated contact was at least 5 km/h slower than the speed before · with the mean speed at contacts of " +
        "the two against each other, in brackets that of the ego vehicle and what it lost",
    ),
    maps.map((map) => heatMap(map, scenarios)),
  );
}

function heatMap({ action, about, down, across, rows, columns, cells }, scenarios) {
  const head = el(
    "tr",
    {},
    el("th", { scope: "col" }, across ? `${down} ↓ ${across} →` : down),
    columns.map((column) => el("th", { scope: "col" }, column || "all")),
  );
  const line = (label, at) =>
    el(
      "tr",
      {},
      el("th", { scope: "row" }, label),
      cells[at].map((cell) => heatCell(cell, scenarios)),
    );
  const what = `${action}, by ${across ? `${down} and ${across}` : down}`;
  return el(
    "div",
    { class: "scroll", tabindex: "0", role: "region", "aria-label": what },
    el(
      "table",
      { class: "heat" },
      el("caption", {}, el("strong", {}, about || action), ` (${what})`),
      el("thead", {}, head),
      el("tbody", {}, rows.map(line)),
    ),
  );
}

/** A cell has the colour of its worst ending, and says all of them. */
function heatCell(tally, scenarios) {
  if (!tally) return el("td", {}, "–");
  const { endings, relative_mps: relative, impact_mps: impact, reduction_mps: reduction, breached } = tally;
  const all = endings.reduce((sum, count) => sum + count, 0);
  const judged = endings.slice(0, HEAT_OTHERS).findLastIndex((count) => count > 0);
  // A breach without a contact is no clean drive.
  const failed = endings[HEAT_FAILED] > 0;
  const worst = failed ? HEAT_FAILED : breached > 0 ? Math.max(judged, 2) : judged >= 0 ? judged : HEAT_OTHERS;
  const told = HEAT_ENDINGS.map((ending, at) => endings[at] > 0 && `${endings[at]} ${ending}`).filter(Boolean);
  // An ego vehicle that stands is still hit at the speed of the other.
  const [both, ego, lost] = [relative, impact, reduction].map((mps) => figure(mps === null ? null : mps * 3.6, "", 0));
  const speeds = impact === null ? null : `${both} km/h (ego ${ego}, −${lost})`;
  const title = [`${plural(all, "test")}: ${told.join(", ")}`, breached > 0 && `${breached} with a breach`];
  const text =
    all === 1
      ? HEAT_SIGNS[endings.findLastIndex((count) => count > 0)]
      : endings
          .map((count, at) => count > 0 && `${HEAT_SIGNS[at]} ${count}`)
          .filter(Boolean)
          .join(" ");
  const shown = breached > 0 ? `${text} ⚑` : text;
  // The first of its tests that is on the page.
  const entry = tally.scenarios.map((name) => scenarios.find((one) => one.summary.name === name)).find(Boolean);
  return el(
    "td",
    { class: `heat-${worst}`, title: title.filter(Boolean).join("; ") },
    entry ? el("a", { href: linkOf({ s: nameOf(entry) }) }, shown) : shown,
    speeds && el("span", { class: "why" }, speeds),
  );
}
