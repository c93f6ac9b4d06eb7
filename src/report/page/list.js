// The list of scenarios, worst first, with filters that live in the link.
import { el, refill } from "./dom.js";
import { linkOf, linked, relink } from "./link.js";
import { bars } from "./charts.js";
import { VERDICTS, causeInWords, figure, kmh, mainCollision, plural } from "./words.js";

/** What one can filter by: name in the link, heading, and the value of a scenario. */
export const FILTERS = [
  ["road", "Road", (entry) => entry.summary.road],
  ["verdict", "Verdict", (entry) => mainCollision(entry.summary)?.class ?? "no collision"],
  ["priority", "Priority", (entry) => mainCollision(entry.summary)?.priority ?? "–"],
  ["hit", "Obstacle", (entry) => mainCollision(entry.summary)?.body ?? "–"],
  ["manoeuvre", "Manoeuvre", (entry) => mainCollision(entry.summary)?.verb ?? "–"],
  ["side", "Side", (entry) => mainCollision(entry.summary)?.side ?? "–"],
  ["cause", "Cause", (entry) => causeInWords(mainCollision(entry.summary)?.cause)],
];

/** Whether a shrunk scenario stays out of the list until it is asked for: where the one that it was made from is there. */
function hiddenTwins(scenarios) {
  const found = new Set(scenarios.filter((entry) => !entry.shrunk_from).map((entry) => entry.summary.name));
  return (entry) => entry.shrunk_from && found.has(entry.shrunk_from);
}

/** The scenarios that the link asks for. */
export function filtered(scenarios) {
  const parts = linked();
  const isHidden = hiddenTwins(scenarios);
  const group = parts.group;
  return scenarios.filter((entry) => {
    if (parts.shrunk !== "1" && isHidden(entry)) return false;
    if (group && kindOf(entry) !== group) return false;
    if (parts.q && !`${entry.file} ${JSON.stringify(entry.summary)}`.toLowerCase().includes(parts.q.toLowerCase())) return false;
    return FILTERS.every(([name, , value]) => !parts[name] || value(entry) === parts[name]);
  });
}

/** What makes two failures alike, as `avastra run` groups them. */
export function kindOf(entry) {
  const collision = mainCollision(entry.summary);
  if (!collision) return `ended: ${entry.summary.end}`;
  const { kind, verb, approach, side, shape, priority, cause } = collision;
  const first = { ego: ", ego first", other: ", the other first" }[priority] ?? "";
  return `${kind} (${verb}, ${approach}${first}), hit by the ${side}${shape ? ` (${shape})` : ""}${cause ? `, ${causeInWords(cause)}` : ""}`;
}

/** The filters, the list and its charts; they stay in step with the link. */
export function showList(place, data) {
  const { scenarios } = data;
  const found = el("div", { id: "found" });
  const charts = el("div", { class: "grid", id: "charts" });
  const update = () => {
    const list = filtered(scenarios);
    refill(found, el("p", { role: "status", id: "number" }, `${plural(list.length, "scenario")}${list.length < scenarios.length ? ` of ${scenarios.length}` : ""}`), list.length > 0 && listing(list));
    refill(charts, ...counts(list));
  };
  const change = (name, value) => {
    relink({ [name]: value || null });
    update();
  };
  const selects = FILTERS.map(([name, title, value]) => {
    const values = [...new Set(scenarios.map(value))].sort();
    if (values.length < 2) return null;
    const select = el("select", { id: `filter-${name}`, onchange: (event) => change(name, event.target.value) }, el("option", { value: "" }, "all"), values.map((one) => el("option", { value: one }, one)));
    select.value = linked()[name] ?? "";
    return el("label", {}, `${title} `, select);
  });
  const search = el("input", { type: "search", id: "search", value: linked().q ?? "", oninput: (event) => change("q", event.target.value) });
  const hasShrunk = scenarios.some(hiddenTwins(scenarios));
  const shrunk = hasShrunk && el("label", {}, el("input", { type: "checkbox", id: "shrunk", checked: linked().shrunk === "1", onchange: (event) => change("shrunk", event.target.checked ? "1" : null) }), " with shrunk ones");
  const clear = el("button", { type: "button", id: "clear", onclick: () => (location.hash = "#") }, "Clear");
  refill(place, el("div", { class: "filters" }, selects, el("label", {}, "Search ", search), shrunk, clear), found, charts);
  update();
}

function listing(list) {
  const rows = list.map((entry) => {
    const { summary } = entry;
    const collision = mainCollision(summary);
    const href = linkOf({ ...linked(), s: entry.n });
    const mark = collision ? (collision.counted ? "●" : "○") : "–";
    const cells = collision
      ? [
          `${mark} ${collision.counted ? "counts" : "does not count"}`, summary.road, `${collision.body}, ${collision.approach}`, collision.side, kmh(collision.closing_mps),
          kmh(Math.max(collision.delta_v_mps, collision.other_delta_v_mps)), { avoidable: "avoidable", beyond_reference: "beyond reference", unavoidable: "unavoidable" }[collision.class], collision.priority, causeInWords(collision.cause), figure(collision.at_s, "s", 1),
        ]
      : [`– ${summary.end}`, summary.road, "–", "–", "–", "–", "–", "–", "–", figure(summary.duration_s, "s", 1)];
    const name = el("a", { href }, entry.file.replace(/\.ava$/, "").replace(/^critical\//, ""));
    return el("tr", { class: collision?.counted ? "counted" : null }, el("th", { scope: "row" }, name), cells.map((text, i) => el("td", { class: [4, 5, 9].includes(i) ? "number" : null, title: i === 6 && collision ? VERDICTS[collision.class] : null }, text)));
  });
  const heads = ["Scenario", "Counts", "Road", "Obstacle", "Side", "Closing", "Worst Δv", "Verdict", "Priority", "Cause", "At"];
  return el(
    "div",
    { class: "scroll", tabindex: "0", role: "region", "aria-label": "Scenarios, worst first" },
    el(
      "table",
      { id: "list" },
      el("caption", {}, "Scenarios, worst first: those that count, then by the larger change of velocity of the two."),
      el("thead", {}, el("tr", {}, heads.map((head, i) => el("th", { scope: "col", class: [5, 6, 10].includes(i) ? "number" : null }, head)))),
      el("tbody", {}, rows),
    ),
  );
}

function counts(list) {
  const charts = [
    ["Kinds of failure", "group", kindOf],
    ...FILTERS.filter(([name]) => ["verdict", "priority", "manoeuvre", "side", "cause"].includes(name)).map(([name, title, value]) => [title, name, value]),
  ];
  // Where no cause was looked for there is nothing to count.
  const isTold = ([, name, value]) => name !== "cause" || list.some((entry) => value(entry) !== causeInWords(null));
  return charts.filter(isTold).map(([title, name, value]) => {
    const sums = new Map();
    for (const entry of list) sums.set(value(entry), (sums.get(value(entry)) ?? 0) + 1);
    const sorted = [...sums].sort((a, b) => b[1] - a[1] || a[0].localeCompare(b[0]));
    const chart = bars(title, sorted, (one) => linkOf({ ...linked(), [name]: one }));
    if (name === "group") chart.classList.add("wide");
    return chart;
  });
}
