// Charts as SVG: bars of counts, curves of a training, intervals of a study.
import { el, svg } from "./dom.js";
import { short } from "./words.js";

/** Bars of counts, each a link; the longest fills the width. */
export function bars(title, counts, linkFor) {
  const most = Math.max(1, ...counts.map(([, count]) => count));
  const rows = counts.map(([name, count, label]) => {
    const width = `${(100 * count) / most}%`;
    const inside = [
      el("span", { class: "name" }, label ?? name),
      el("span", { class: "bar", "aria-hidden": "true" }, el("span", { style: `width:${width}` })),
      el("span", { class: "count" }, String(count)),
    ];
    return el("li", {}, linkFor ? el("a", { href: linkFor(name) }, inside) : el("span", {}, inside));
  });
  return el(
    "section",
    { class: "bars" },
    el("h3", {}, title),
    rows.length === 0 ? el("p", { class: "muted" }, "None.") : el("ul", {}, rows),
  );
}

const WIDE = 460;
const HIGH = 180;
const PAD = { left: 48, right: 12, top: 12, bottom: 26 };

/** A figure with axes; `inside` draws with the two scales. */
function framed(title, [x0, x1], [y0, y1], axis, inside) {
  const x = (value) => PAD.left + ((value - x0) / (x1 - x0 || 1)) * (WIDE - PAD.left - PAD.right);
  const y = (value) => HIGH - PAD.bottom - ((value - y0) / (y1 - y0 || 1)) * (HIGH - PAD.top - PAD.bottom);
  const marks = [y0, (y0 + y1) / 2, y1].map((value) => [
    svg("line", { x1: PAD.left, x2: WIDE - PAD.right, y1: y(value), y2: y(value), class: "grid" }),
    svg("text", { x: PAD.left - 6, y: y(value) + 4, "text-anchor": "end" }, short(value)),
  ]);
  const feet = [x0, x1].map((value, i) =>
    svg("text", { x: x(value), y: HIGH - 6, "text-anchor": i === 0 ? "start" : "end" }, short(value)),
  );
  const foot = svg("text", { x: (WIDE + PAD.left) / 2, y: HIGH - 6, "text-anchor": "middle" }, axis);
  return figureOf(title, title, HIGH, [marks, feet, foot, inside(x, y)]);
}

/** A drawing under its title; `label` is what a screen reader says of it. */
function figureOf(title, label, highPx, drawn) {
  const drawing = svg("svg", { viewBox: `0 0 ${WIDE} ${highPx}`, role: "img", "aria-label": label }, ...drawn);
  return el("figure", { class: "chart" }, el("figcaption", {}, title), drawing);
}

/** Points that a curve draws at most: more cannot be told apart. */
const POINTS_MAX = 1000;

/** A curve through points `[x, y]`: dots, and a line for their mean over a window. */
export function curve(title, points, axis, window) {
  if (points.length === 0) return null;
  let [low, high, sum] = [0, 0, 0];
  const means = points.map(([at, value], i) => {
    low = Math.min(low, value);
    high = Math.max(high, value);
    sum += value - (i >= window ? points[i - window][1] : 0);
    return [at, sum / Math.min(i + 1, window)];
  });
  const every = Math.ceil(points.length / POINTS_MAX);
  const thinned = (all) => all.filter((_, i) => i % every === 0 || i === all.length - 1);
  const line = window > 1 ? `; line: mean of the last ${window}` : "";
  const heading = `${title}${line}${every > 1 ? `; one of ${every} is drawn` : ""}`;
  const [first, last] = [points[0][0], points[points.length - 1][0]];
  return framed(heading, [first, Math.max(first + 1, last)], [low, high], axis, (x, y) => [
    thinned(points).map(([at, value]) =>
      svg("circle", { cx: x(at).toFixed(1), cy: y(value).toFixed(1), r: 1.8, class: "dot" }),
    ),
    svg("polyline", {
      points: thinned(means)
        .map(([at, value]) => `${x(at).toFixed(1)},${y(value).toFixed(1)}`)
        .join(" "),
      class: "curve",
    }),
  ]);
}

/** Estimates with their intervals, side by side: `[name, value, low, high]`; an open end goes to the edge. */
export function intervals(title, estimates) {
  const known = estimates.filter(([, value]) => value !== null && value !== undefined);
  if (known.length === 0) return null;
  const most = Math.max(...known.map(([, value, , high]) => (high ?? value) || 0), 1e-9) * 1.05;
  const rowPx = 24;
  const high = known.length * rowPx + 30;
  const left = 112;
  const x = (value) => left + (Math.min(value, most) / most) * (WIDE - left - 70);
  const rows = known.map(([name, value, low, top], i) => {
    const y = 14 + i * rowPx;
    const end = top ?? most;
    return [
      svg("text", { x: left - 8, y: y + 4, "text-anchor": "end" }, name),
      svg("line", { x1: left, x2: WIDE - 70, y1: y, y2: y, class: "grid" }),
      low === null || low === undefined ? null : svg("line", { x1: x(low), x2: x(end), y1: y, y2: y, class: "span" }),
      low === null || low === undefined
        ? null
        : [low, end].map((edge) => svg("line", { x1: x(edge), x2: x(edge), y1: y - 5, y2: y + 5, class: "span" })),
      svg("circle", { cx: x(value), cy: y, r: 4.5, class: "point" }),
      svg("text", { x: WIDE - 64, y: y + 4 }, short(value)),
    ].flat();
  });
  const label = `${title}: ${known.map(([name, value]) => `${name} ${short(value)}`).join(", ")}`;
  const feet = [
    svg("text", { x: left, y: high - 4 }, "0"),
    svg("text", { x: WIDE - 70, y: high - 4, "text-anchor": "end" }, short(most)),
  ];
  return figureOf(title, label, high, [rows, feet]);
}
