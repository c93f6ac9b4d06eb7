// What happened over time: speed, acceleration, ProC, margins, the reason lane and the actions, under one cursor.
import { palette, Canvas } from "./paint.js";
import { figure } from "./words.js";

const LEFT = 74;
const RIGHT = 10;

/** The rows of the plot: what they show, and their height in px. */
const ROWS = [
  { name: "speed", height: 62 },
  { name: "acceleration", height: 52 },
  { name: "ProC", height: 44 },
  { name: "reason", height: 30 },
  { name: "steps", height: 34 },
];

export class Plots {
  /** `seek` is called with the time under a pressed pointer. */
  constructor(element, recording, seek, other = null) {
    this.canvas = new Canvas(element);
    this.recording = recording;
    this.other = other;
    this.still = document.createElement("canvas");
    const margins = recording.header.margins.map((margin) => ({ margin, height: 44 }));
    this.rows = [...ROWS.slice(0, 3), ...margins, ...ROWS.slice(3)];
    element.style.height = `${this.rows.reduce((sum, { height }) => sum + height + 8, 22)}px`;
    const to = (event) => {
      const box = element.getBoundingClientRect();
      const share = (event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT);
      seek(Math.min(Math.max(share, 0), 1) * this.endS());
    };
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      to(event);
    });
    element.addEventListener("pointermove", (event) => event.buttons > 0 && to(event));
  }

  endS() {
    return Math.max(this.recording.endS, this.other?.endS ?? 0);
  }

  repaint() {
    this.canvas.colours = palette();
    this.drawn = null;
  }

  draw(timeS) {
    const { canvas } = this;
    if (!canvas.fit()) return;
    const wanted = `${canvas.width}×${canvas.height}`;
    if (this.drawn !== wanted) {
      this.#drawStill();
      this.drawn = wanted;
    }
    const { context } = canvas;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.element.width, canvas.element.height);
    context.drawImage(this.still, 0, 0);
    canvas.enterScreen();
    const x = this.#x(timeS);
    context.strokeStyle = canvas.colours.accent;
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(x, 0);
    context.lineTo(x, canvas.height - 18);
    context.stroke();
  }

  #x(timeS) {
    return LEFT + (timeS / this.endS()) * (this.canvas.width - LEFT - RIGHT);
  }

  /** All but the cursor, drawn once for a size. */
  #drawStill() {
    const { canvas } = this;
    const onPage = canvas.context;
    this.still.width = canvas.element.width;
    this.still.height = canvas.element.height;
    canvas.context = this.still.getContext("2d");
    canvas.enterScreen();
    let top = 4;
    for (const row of this.rows) {
      this.#row(row, top);
      top += row.height + 8;
    }
    this.#axis(top);
    canvas.context = onPage;
  }

  #row({ name, margin, height }, top) {
    const { context, colours } = this.canvas;
    context.font = "600 12px system-ui, sans-serif";
    context.fillStyle = colours.ink;
    context.textAlign = "left";
    context.textBaseline = "top";
    const labels = { speed: "Speed", acceleration: "Accel.", ProC: "ProC", reason: "Held by", steps: "Actions" };
    context.fillText(margin ? margin.requirement : labels[name], 2, top, LEFT - 6);
    if (name === "reason") return this.#reasons(top, height);
    if (name === "steps") return this.#steps(top, height);
    if (margin) return this.#margin(margin, top, height);
    const [column, unit, factor] = {
      speed: ["speed_mps", "km/h", 3.6],
      acceleration: ["acceleration_mps2", "m/s²", 1],
      ProC: ["proc", "", 1],
    }[name];
    const series = ({ columns, header }) => columns[header.ego[column]];
    const values = series(this.recording);
    const second = this.other && series(this.other);
    const all = second ? [values, second] : [values];
    const extent = (fold, start) =>
      all.reduce((found, list) => list.reduce((a, b) => fold(a, b), found), start) * factor;
    const range = name === "ProC" ? [0, 1] : [Math.min(0, extent(Math.min, 0)), Math.max(1, extent(Math.max, 0))];
    this.#curve(values, factor, range, top, height, colours.accent, []);
    if (second) this.#curve(second, factor, range, top, height, colours.warn, [5, 3]);
    context.font = "11px system-ui, sans-serif";
    context.fillStyle = colours.muted;
    context.fillText(`${figure(range[1], "", 0)} ${unit}`, 2, top + 15);
    if (range[0] < -0.5) context.fillText(figure(range[0], "", 0), 2, top + height - 12);
    return undefined;
  }

  #curve(values, factor, /** @type {number[]} */ [low, high], top, height, colour, dash) {
    const { context, colours } = this.canvas;
    const y = (value) => top + height - ((value - low) / (high - low || 1)) * height;
    context.strokeStyle = colours.grid;
    context.lineWidth = 1;
    context.beginPath();
    for (const at of [0, high]) {
      context.moveTo(LEFT, y(at));
      context.lineTo(this.canvas.width - RIGHT, y(at));
    }
    context.stroke();
    context.strokeStyle = colour;
    context.lineWidth = 1.6;
    context.setLineDash(dash);
    context.beginPath();
    for (let i = 0; i < values.length; i += 2) {
      const x = this.#x(i * this.recording.tickS);
      if (i === 0) context.moveTo(x, y(values[i] * factor));
      else context.lineTo(x, y(values[i] * factor));
    }
    context.stroke();
    context.setLineDash([]);
  }

  /** By how much a requirement was kept, where it was asked; below 0 it was not. Its breaches are shaded. */
  #margin({ requirement, unit, parts }, top, height) {
    const { context, colours } = this.canvas;
    const { header, columns, tickS } = this.recording;
    const all = parts.flatMap(([, column]) => Array.from(columns[column]));
    const [low, high] = [
      all.reduce((least, m) => Math.min(least, Math.max(m, -100)), 0),
      Math.max(0.1, median(all) * 2),
    ];
    const y = (margin) => top + height - ((Math.min(Math.max(margin, low), high) - low) / (high - low)) * height;
    context.fillStyle = `color-mix(in srgb, ${colours.danger} 25%, ${colours.paper})`;
    for (const breach of header.summary.breaches.filter((one) => one.requirement === requirement)) {
      const [left, right] = [this.#x(breach.at_s), this.#x(breach.until_s)];
      context.fillRect(left - 1, top, Math.max(right - left, 2), height);
    }
    context.strokeStyle = colours.danger;
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(LEFT, y(0));
    context.lineTo(this.canvas.width - RIGHT, y(0));
    context.stroke();
    context.strokeStyle = colours.accent;
    context.lineWidth = 1.6;
    for (const [from, column] of parts) {
      context.beginPath();
      columns[column].forEach((margin, i) => context.lineTo(this.#x((from + i) * tickS), y(margin)));
      context.stroke();
    }
    context.font = "11px system-ui, sans-serif";
    context.fillStyle = colours.muted;
    context.fillText(`${figure(high, "", 1)} ${unit}`, 2, top + 15);
    if (low < 0) context.fillText(figure(low, "", 1), 2, top + height - 12);
  }

  #reasons(top, height) {
    const { context, colours } = this.canvas;
    const { held } = this.recording.header;
    context.font = "11px system-ui, sans-serif";
    context.textBaseline = "middle";
    held.forEach(([from, text], i) => {
      const to = held[i + 1]?.[0] ?? this.recording.endS;
      const [left, right] = [this.#x(from), this.#x(to)];
      context.fillStyle = reasonColour(text, colours);
      context.fillRect(left, top, Math.max(right - left - 0.5, 0.5), height);
      if (right - left > context.measureText(text).width + 6) {
        context.fillStyle = colours.ink;
        context.fillText(text, left + 3, top + height / 2);
      }
    });
  }

  #steps(top, height) {
    const { context, colours } = this.canvas;
    const { steps, collisions } = this.recording.header;
    context.font = "11px system-ui, sans-serif";
    context.textBaseline = "middle";
    steps.forEach((step, i) => {
      const to = steps[i + 1]?.at_s ?? this.recording.endS;
      const [left, right] = [this.#x(step.at_s), this.#x(to)];
      const { kind, text, row } = step.outcome;
      context.strokeStyle = kind === "refused" ? colours.danger : colours.muted;
      context.setLineDash(kind === "done" ? [] : [3, 3]);
      context.strokeRect(left + 0.5, top + 0.5, Math.max(right - left - 2, 1), height - 1);
      context.setLineDash([]);
      const label =
        kind === "done"
          ? text.split("(")[0]
          : { passed: "–", refused: `refused ${this.recording.header.rows[row] ?? ""}` }[kind];
      context.save();
      context.beginPath();
      context.rect(left, top, right - left - 3, height);
      context.clip();
      context.fillStyle = colours.ink;
      context.fillText(label, left + 4, top + height / 2);
      context.restore();
    });
    for (const collision of collisions) {
      const x = this.#x(collision.at_s);
      context.fillStyle = colours.danger;
      context.beginPath();
      context.moveTo(x, 0);
      context.lineTo(x - 5, -0.1);
      context.stroke();
      context.fillRect(x - 1, 2, 2, top + height - 2);
      context.font = "bold 13px system-ui, sans-serif";
      context.fillText("✕", x - 12, 10);
    }
  }

  #axis(top) {
    const { context, colours } = this.canvas;
    context.font = "11px system-ui, sans-serif";
    context.fillStyle = colours.muted;
    context.textAlign = "center";
    context.textBaseline = "top";
    const endS = this.endS();
    const stride = [1, 2, 5, 10, 20, 50, 100].find((s) => (s / endS) * (this.canvas.width - LEFT) > 46) ?? 200;
    for (let t = 0; t <= endS; t += stride) context.fillText(`${t} s`, this.#x(t), top + 2);
  }
}

function median(numbers) {
  const sorted = [...numbers].sort((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)] ?? 0;
}

/** A reason has one colour everywhere; what makes it brake hard is red. */
export function reasonColour(text, colours) {
  if (/^(emergency|stop after|fallback|degraded)/.test(text))
    return `color-mix(in srgb, ${colours.danger} 45%, ${colours.paper})`;
  if (/^(stop|red light|crosswalk|yield|creep|approach|keep clear)/.test(text))
    return `color-mix(in srgb, ${colours.warn} 40%, ${colours.paper})`;
  if (/^(follow|nudge|lane change|sight)/.test(text))
    return `color-mix(in srgb, ${colours.accent} 28%, ${colours.paper})`;
  return `color-mix(in srgb, ${colours.muted} 18%, ${colours.paper})`;
}
