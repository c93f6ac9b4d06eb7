// Rows of the action table on the roads: what was legal, chosen and carried out, and why a row never was.
import { el } from "./dom.js";

/** The table, and what its signs mean. */
export function coverage(overview) {
  const cells = overview.coverage ?? [];
  if (cells.length === 0) return null;
  const roads = [...new Set(cells.map((cell) => cell.road))];
  const known = new Map(cells.map((cell) => [`${cell.row} ${cell.road}`, cell]));
  // A training does not keep what it could have chosen.
  const isOffered = cells.some((cell) => cell.legal + cell.refused > 0);
  const count = Math.max(overview.rows?.length ?? 0, ...cells.map((cell) => cell.row + 1));
  const rows = Array.from({ length: count }, (_, row) =>
    el(
      "tr",
      {},
      el("th", { scope: "row" }, `${row} · ${overview.rows?.[row] ?? ""}`),
      roads.map((road) => (isOffered ? box : onlyCounts)(known.get(`${row} ${road}`))),
    ),
  );
  return el(
    "section",
    { "aria-labelledby": "h-coverage" },
    el("h2", { id: "h-coverage" }, "Rows on roads"),
    el(
      "p",
      { class: "legend" },
      isOffered
        ? "● steps in which it was carried out, of those in which the agent looked at it and it was legal · " +
            "◐ legal, and never chosen · " +
            "○ never legal, with what refused it most often · – not offered"
        : "● steps in which it was carried out · – never chosen",
    ),
    el(
      "div",
      { class: "scroll", tabindex: "0", role: "region", "aria-label": "Table of rows on roads" },
      el(
        "table",
        { class: "coverage" },
        el(
          "caption",
          {},
          "Steps in which each row of the action table was carried out" +
            (isOffered ? ", of those in which the agent looked at it and it was legal." : "."),
        ),
        el(
          "thead",
          {},
          el(
            "tr",
            {},
            el("th", { scope: "col" }, "Row"),
            roads.map((road) => el("th", { scope: "col" }, road)),
          ),
        ),
        el("tbody", {}, rows),
      ),
    ),
  );
}

/** A cell of a training. */
function onlyCounts(cell) {
  if (!cell) return el("td", {}, "–");
  return el(
    "td",
    { class: "some" },
    cell.realised > 0 ? `● ${cell.realised}` : `chosen ${cell.chosen}, never carried out`,
  );
}

function box(cell) {
  if (!cell) return el("td", {}, "–");
  const { legal, refused, chosen, realised, why } = cell;
  const steps = legal + refused;
  if (realised > 0)
    return el(
      "td",
      { class: "done", style: `--share:${Math.round((100 * realised) / Math.max(1, legal))}%` },
      `● ${realised} of ${legal}`,
    );
  if (chosen > 0) return el("td", { class: "some" }, `◐ chosen ${chosen}, never carried out`);
  if (legal > 0) return el("td", { class: "some" }, `◐ ${legal} of ${steps}`);
  return el("td", { class: "never" }, "○ never", el("span", { class: "why" }, why ?? ""));
}
