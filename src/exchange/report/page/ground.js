// The road under everything: lanes, lines, crosswalks, signals, the route.
import { unpacked } from "./decode.js";

const grounds = new Map();

/** The shape of a road, read once. */
export function ground(id) {
  if (!grounds.has(id)) grounds.set(id, unpacked(id).then(shaped));
  return grounds.get(id);
}

function shaped({ header, columns }) {
  const line = ([x, y]) => Array.from(columns[x], (value, i) => ({ x: value, y: columns[y][i] }));
  const lanes = header.lanes.map((lane) => ({ ...lane, left: line(lane.left), right: line(lane.right) }));
  return {
    ...header,
    lanes,
    strips: header.strips.map((strip) => ({ ...strip, outline: line(strip.outline) })),
    solids: header.solids.map(line),
    crosswalks: header.crosswalks.map(line),
    route: line(header.route),
    stop_lines: header.stop_lines.map((stop) => ({ ...stop, at: stop.at.map(([x, y]) => ({ x, y })) })),
    signals: header.signals.map((signal) => ({ ...signal, at: { x: signal.at[0], y: signal.at[1] } })),
  };
}

/** Draws the road as it is at a time. */
export function drawGround(canvas, road, recording, timeS, layers) {
  const { colours } = canvas;
  canvas.enterScreen();
  canvas.context.fillStyle = colours.ground;
  canvas.context.fillRect(0, 0, canvas.width, canvas.height);
  canvas.enterWorld();
  for (const solid of road.solids) canvas.area(solid, colours.solid);
  for (const strip of road.strips) canvas.area(strip.outline, strip.is_walkway ? colours.walkway : colours.junction);
  const sorted = [...road.lanes].sort((a, b) => Number(b.in_junction) - Number(a.in_junction));
  for (const lane of sorted) {
    canvas.area([...lane.left, ...[...lane.right].reverse()], lane.in_junction ? colours.junction : colours.road);
  }
  for (const lane of road.lanes) if (!lane.in_junction) drawLines(canvas, lane);
  for (const crosswalk of road.crosswalks) drawZebra(canvas, crosswalk);
  if (layers.has("route")) canvas.line(road.route, colours.route, Math.max(0.25, canvas.px(1.5)), [1.6, 1.4]);
  if (layers.has("signals")) drawSignals(canvas, road, recording, timeS);
}

function drawLines(canvas, lane) {
  const { colours } = canvas;
  const thin = Math.max(0.12, canvas.px(1));
  for (const [edge, beyond] of [
    [lane.left, lane.beyond_left],
    [lane.right, lane.beyond_right],
  ]) {
    if (beyond === "same") canvas.line(edge, colours.laneLine, thin, [3, 4]);
    else canvas.line(edge, beyond === "oncoming" ? colours.oncoming : colours.edge, thin);
  }
  if (canvas.camera.pxPerM < 2.5) return;
  // An arrow every 25 m says which way the lane goes.
  const middle = lane.left.map((point, i) => {
    const other = lane.right[Math.min(i, lane.right.length - 1)];
    return { x: (point.x + other.x) / 2, y: (point.y + other.y) / 2 };
  });
  let since = 12;
  for (let i = 1; i < middle.length; i += 1) {
    const [a, b] = [middle[i - 1], middle[i]];
    const length = Math.hypot(b.x - a.x, b.y - a.y);
    since += length;
    if (since < 25 || length === 0) continue;
    since = 0;
    const [fx, fy] = [(b.x - a.x) / length, (b.y - a.y) / length];
    const wing = (side) => ({ x: b.x - fx * 0.8 - fy * 0.55 * side, y: b.y - fy * 0.8 + fx * 0.55 * side });
    canvas.line([wing(1), b, wing(-1)], colours.laneLine, thin);
  }
}

function drawZebra(canvas, outline) {
  if (outline.length < 4) return canvas.area(outline, canvas.colours.crosswalk);
  // Stripes lie along the shorter side of the outline, side by side along the longer one.
  const [a, b, c, d] = outline;
  const isLong = Math.hypot(b.x - a.x, b.y - a.y) >= Math.hypot(c.x - b.x, c.y - b.y);
  const [from, to] = isLong
    ? [
        [a, b],
        [d, c],
      ]
    : [
        [b, c],
        [a, d],
      ];
  const length = Math.hypot(from[1].x - from[0].x, from[1].y - from[0].y);
  const stripes = Math.max(1, Math.round(length / 1.1));
  const mix = (/** @type {any[]} */ [p, q], /** @type {number} */ share) => ({
    x: p.x + (q.x - p.x) * share,
    y: p.y + (q.y - p.y) * share,
  });
  for (let i = 0; i < stripes; i += 1) {
    const [low, high] = [i / stripes, (i + 0.5) / stripes];
    canvas.area([mix(from, low), mix(from, high), mix(to, high), mix(to, low)], canvas.colours.crosswalk);
  }
  return undefined;
}

function drawSignals(canvas, road, recording, timeS) {
  const { colours } = canvas;
  const paints = { red: colours.danger, yellow: colours.warn, green: colours.good };
  for (const stop of road.stop_lines) {
    const colour = stop.signal === null ? null : recording.signal(stop.signal, timeS);
    canvas.line(stop.at, colour ? paints[colour] : colours.laneLine, Math.max(0.45, canvas.px(3)));
    if (!colour || canvas.camera.pxPerM < 1.5) continue;
    // Beside the colour the letter: red and green are one to some.
    const middle = canvas.at({ x: (stop.at[0].x + stop.at[1].x) / 2, y: (stop.at[0].y + stop.at[1].y) / 2 });
    canvas.enterScreen();
    const { context } = canvas;
    context.beginPath();
    context.arc(middle.x, middle.y, 7, 0, 2 * Math.PI);
    context.fillStyle = paints[colour];
    context.fill();
    context.fillStyle = colour === "red" ? "#fff" : "#111";
    context.font = "bold 9px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText({ red: "R", yellow: "Y", green: "G" }[colour], middle.x, middle.y + 0.5);
    canvas.enterWorld();
  }
}
