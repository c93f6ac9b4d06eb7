// The list of scenarios, worst first, with filters that live in the link.
import { el, refill } from "./dom.js";
import { linkOf, linked, nameOf, relink } from "./link.js";
import { bars } from "./charts.js";
import { drawWhenSeen } from "./thumbs.js";
import {
  CHANGES,
  HARMS,
  VERDICTS,
  atTime,
  causeInWords,
  changeInWords,
  kmh,
  mainCollision,
  mainFinding,
  plural,
  recursInWords,
} from "./words.js";

/** @import { Entry, Finding, Index } from "./data" */

/**
 * What one can filter by: name in the link, heading, and the value of a scenario.
 * @type {[string, string, (entry: Entry) => string][]}
 */
export const FILTERS = [
  ["road", "Road", (entry) => entry.summary.road],
  ["verdict", "Verdict", (entry) => mainCollision(entry.summary)?.class ?? "no collision"],
  ["recurs", "Under other noise", (entry) => recursInWords(mainFinding(entry.summary))],
  ["harm", "Harm", (entry) => mainCollision(entry.summary)?.harm ?? "–"],
  ["breach", "Breach", (entry) => entry.summary.breaches[0]?.requirement ?? "none"],
  ["priority", "Priority", (entry) => mainCollision(entry.summary)?.priority ?? "–"],
  ["hit", "Obstacle", (entry) => mainCollision(entry.summary)?.body ?? "–"],
  ["manoeuvre", "Manoeuvre", (entry) => mainCollision(entry.summary)?.verb ?? "–"],
  ["side", "Side", (entry) => mainCollision(entry.summary)?.side ?? "–"],
  ["cause", "Cause", (entry) => causeInWords(mainCollision(entry.summary)?.cause)],
  ["change", "Compared", (entry) => CHANGES[entry.change?.kind] ?? "–"],
];

/**
 * Tells shrunk scenarios that the list leaves out until asked: those whose original is on the page.
 * @param {Entry[]} scenarios
 */
function hiddenTwins(scenarios) {
  const found = new Set(scenarios.filter((entry) => !entry.shrunk_from).map((entry) => entry.summary.name));
  return (entry) => entry.shrunk_from && found.has(entry.shrunk_from);
}

/**
 * The scenarios that the link asks for.
 * @param {Entry[]} scenarios
 */
export function filtered(scenarios) {
  const parts = linked();
  const isHidden = hiddenTwins(scenarios);
  const group = parts.group;
  return scenarios.filter((entry) => {
    if (parts.shrunk !== "1" && isHidden(entry)) return false;
    if (group && kindOf(entry) !== group) return false;
    if (parts.q && !`${entry.file} ${JSON.stringify(entry.summary)}`.toLowerCase().includes(parts.q.toLowerCase()))
      return false;
    return FILTERS.every(([name, , value]) => !parts[name] || value(entry) === parts[name]);
  });
}

/**
 * What makes two failures alike, as `avastra run` groups them.
 * @param {Entry} entry
 */
export function kindOf(entry) {
  const collision = mainCollision(entry.summary);
  const [breach] = entry.summary.breaches;
  if (!collision && breach) return `breach of ${breach.requirement}`;
  if (!collision) return entry.summary.failure ? "driving system failed" : "nothing found, kept to look at";
  const { precrash, precrash_number, cause } = collision;
  const because = cause ? `, ${causeInWords(cause)}` : "";
  return `${precrash_number ? `${precrash_number} ` : ""}${precrash}${because}`;
}

/**
 * The filters, the list and its charts; they stay in step with the link.
 * @param {HTMLElement} place
 * @param {Index} data
 */
export function showList(place, data) {
  const { scenarios } = data;
  const found = el("div", { id: "found" });
  const charts = el("div", { class: "grid", id: "charts" });
  const update = () => {
    const list = filtered(scenarios);
    refill(
      found,
      el(
        "p",
        { role: "status", id: "number" },
        `${plural(list.length, "scenario")}${list.length < scenarios.length ? ` of ${scenarios.length}` : ""}`,
      ),
      list.length > 0 && listing(list),
    );
    refill(charts, ...barCharts(list));
  };
  const change = (name, value) => {
    relink({ [name]: value || null });
    update();
  };
  const selects = FILTERS.map(([name, title, value]) => {
    const values = [...new Set(scenarios.map(value))].sort();
    if (values.length < 2) return null;
    const select = el(
      "select",
      { id: `filter-${name}`, onchange: (event) => change(name, event.target.value) },
      el("option", { value: "" }, "all"),
      values.map((one) => el("option", { value: one }, one)),
    );
    select.value = linked()[name] ?? "";
    return el("label", {}, `${title} `, select);
  });
  const search = el("input", {
    type: "search",
    id: "search",
    value: linked().q ?? "",
    oninput: (event) => change("q", event.target.value),
  });
  const hasShrunk = scenarios.some(hiddenTwins(scenarios));
  const shrunk =
    hasShrunk &&
    el(
      "label",
      {},
      el("input", {
        type: "checkbox",
        id: "shrunk",
        checked: linked().shrunk === "1",
        onchange: (event) => change("shrunk", event.target.checked ? "1" : null),
      }),
      " with shrunk ones",
    );
  const clear = el("button", { type: "button", id: "clear", onclick: () => (location.hash = "#") }, "Clear");
  refill(
    place,
    el("div", { class: "filters" }, selects, el("label", {}, "Search ", search), shrunk, clear),
    found,
    charts,
  );
  update();
}

const REACHES = { avoidable: "avoidable", beyond_reference: "only if quicker", unavoidable: "unavoidable" };

/**
 * Columns of the list: heading, what a scenario has there, and whether it is a number.
 * @type {[string, (entry: Entry, hit: Finding | null) => any, string?][]}
 */
const COLUMNS = [
  ["Counts", counts],
  ["Road", ({ summary }) => summary.road],
  // Early, so that a narrow window cuts off other columns.
  ["Compared", ({ change }) => change && el("span", { title: change.why }, changeInWords(change))],
  ["Obstacle", (entry, hit) => hit && `${hit.body}, ${hit.approach}`],
  ["Side", (entry, hit) => hit?.side],
  ["Closing", (entry, hit) => hit && kmh(hit.closing_mps), "number"],
  ["Worst Δv", (entry, hit) => hit && kmh(Math.max(hit.delta_v_mps, hit.other_delta_v_mps)), "number"],
  ["Harm", (entry, hit) => hit && el("span", { title: HARMS[hit.harm] }, hit.harm)],
  ["Recurs in", ({ summary }) => mainFinding(summary)?.recurrence?.text],
  ["Verdict", (entry, hit) => hit && el("span", { title: VERDICTS[hit.class] }, REACHES[hit.class])],
  ["Priority", (entry, hit) => hit?.priority],
  ["Cause", (entry, hit) => hit && causeInWords(hit.cause)],
  ["At", ({ summary }, hit) => atTime((hit ?? summary.breaches[0])?.at_s ?? summary.duration_s), "number"],
];

/** Whether it counts, by a sign and in words; how it ended, if nothing was hit; and whether the replay is another. */
function counts({ summary }, hit) {
  const [breach] = summary.breaches;
  const without = breach ? `● ${breach.requirement}` : `– ${summary.end}`;
  const end = hit ? (hit.counted ? "● counts" : "○ does not count") : without;
  return summary.refuted.length > 0 ? `${end}, replays otherwise` : end;
}

/** Whether it counts, and whether it rarely recurs. */
function rowClass(summary, hit) {
  const isRare = recursInWords(mainFinding(summary)) === "rarely recurs";
  return [hit?.counted && "counted", isRare && "rare"].filter(Boolean).join(" ") || null;
}

/**
 * @param {Entry[]} list
 */
function listing(list) {
  const shown = COLUMNS.filter(([name]) => name !== "Compared" || list.some((entry) => entry.change));
  const thumbs = list.map(() => el("canvas", { class: "thumb", "aria-hidden": "true" }));
  const rows = list.map((entry, nth) => {
    const hit = mainCollision(entry.summary);
    const name = el("a", { href: linkOf({ ...linked(), s: nameOf(entry) }) }, nameOf(entry).replace(/^critical\//, ""));
    return el(
      "tr",
      { class: rowClass(entry.summary, hit) },
      el("th", { scope: "row" }, thumbs[nth], name),
      shown.map(([label, of, kind]) => el("td", { class: kind, "data-label": label }, of(entry, hit) ?? "–")),
    );
  });
  const heads = [["Scenario"], ...shown].map(([name, , kind]) => el("th", { scope: "col", class: kind }, name));
  const caption =
    "Scenarios, worst first: those that count, of these first those that recur under other noise (the 95 % interval " +
    "of the share of replays lies above one half), then by the speed of the impact beside what people bear.";
  drawWhenSeen(thumbs, list);
  return el(
    "div",
    { class: "scroll", tabindex: "0", role: "region", "aria-label": "Scenarios, worst first" },
    el(
      "table",
      { id: "list" },
      el("caption", {}, caption),
      el("thead", {}, el("tr", {}, heads)),
      el("tbody", {}, rows),
    ),
  );
}

/**
 * How many there are of each kind, as bars that filter.
 * @param {Entry[]} list
 */
function barCharts(list) {
  /** @type {[string, string, (entry: Entry) => string][]} */
  const charts = [
    ["Scenarios by kind of failure", "group", kindOf],
    ...FILTERS.filter(([name]) =>
      ["verdict", "recurs", "harm", "priority", "manoeuvre", "side", "cause", "change"].includes(name),
    ).map(([name, title, value]) => /** @type {[string, string, (entry: Entry) => string]} */ ([title, name, value])),
  ];
  // Where no cause was looked for, or nothing compared, there is nothing to count.
  const nothing = { cause: causeInWords(null), change: "–" };
  const isTold = ([, name, value]) => !(name in nothing) || list.some((entry) => value(entry) !== nothing[name]);
  return charts.filter(isTold).map(([title, name, value]) => {
    const sums = new Map();
    for (const entry of list) sums.set(value(entry), (sums.get(value(entry)) ?? 0) + 1);
    const sorted = [...sums].sort((a, b) => b[1] - a[1] || a[0].localeCompare(b[0]));
    const chart = bars(title, sorted, (one) => linkOf({ ...linked(), [name]: one }));
    if (name === "group") chart.classList.add("wide");
    return chart;
  });
}
