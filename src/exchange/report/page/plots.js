// What happened over time: speed, acceleration, ProC, margins, the reason lane and the actions, under one cursor.
import { TimeAxis } from "./axis.js";
import { Canvas, contextOf, palette, restraintColour } from "./paint.js";
import { figure } from "./words.js";

/** @import { Branched, Breach, Margin } from "./data" */
/** @import { Recording } from "./moment.js" */

/**
 * Where a row is drawn, and of which drives.
 * @typedef {{ canvas: any, axis: TimeAxis, recording: Recording, other: Recording | null, top: number,
 *   height: number }} Box
 * @typedef {{ label: string, height: number, draw: (box: Box) => void }} PlotRow
 */

const LEFT = 74;
const RIGHT = 10;

/** Between rows, and above the first, px. */
const SPACE = 8;
const TOP = 4;

/** For the labels of the time, px. */
const BOTTOM = 18;

/**
 * All rows, from top to bottom. Another one is an object more.
 * @param {Recording} recording
 * @returns {PlotRow[]}
 */
function plotRows(recording) {
  const chances = recording.chances();
  return [
    curveRow("Speed", 62, "speed_mps", "km/h", 3.6),
    curveRow("Accel.", 52, "acceleration_mps2", "m/s²", 1),
    curveRow("ProC", 44, "proc", "", 1, [0, 1]),
    ...recording.header.margins.map((margin) => ({
      label: margin.requirement,
      height: 44,
      draw: (/** @type {Box} */ box) => drawMargin(box, margin),
    })),
    ...(chances ? [{ label: "Chance", height: 44, draw: (/** @type {Box} */ box) => drawChance(box, chances) }] : []),
    { label: "Held by", height: 30, draw: drawReasons },
    { label: "Actions", height: 34, draw: drawActions },
  ];
}

export class Plots {
  /**
   * @param {HTMLCanvasElement} element
   * @param {Recording} recording
   * @param {(timeS: number) => void} seek is called with the time under a pressed pointer.
   * @param {Recording | null} other another drive to draw beside
   */
  constructor(element, recording, seek, other = null) {
    this.canvas = new Canvas(element);
    this.recording = recording;
    this.other = other;
    this.still = document.createElement("canvas");
    /** The size that the still was drawn for. */
    this.drawn = "";
    this.rows = plotRows(recording);
    element.style.height = `${this.rows.reduce((sum, { height }) => sum + height + SPACE, TOP + BOTTOM)}px`;
    const to = (/** @type {PointerEvent} */ event) => {
      const box = element.getBoundingClientRect();
      seek(this.#axis(box.width).timeAt(event.clientX - box.left));
    };
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      to(event);
    });
    element.addEventListener("pointermove", (event) => event.buttons > 0 && to(event));
  }

  #axis(width = this.canvas.width) {
    return new TimeAxis(Math.max(this.recording.endS, this.other?.endS ?? 0), width, LEFT, RIGHT);
  }

  repaint() {
    this.canvas.colours = palette();
    this.drawn = "";
  }

  /** @param {number} timeS */
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
    context.lineWidth = 2;
    context.strokeStyle = canvas.colours.accent;
    upright(context, this.#axis().xOf(timeS), canvas.height - BOTTOM);
  }

  /** All but the cursor, drawn once for a size. */
  #drawStill() {
    const { canvas, recording, other } = this;
    const axis = this.#axis();
    const onPage = canvas.context;
    this.still.width = canvas.element.width;
    this.still.height = canvas.element.height;
    canvas.context = contextOf(this.still);
    canvas.enterScreen();
    let top = TOP;
    for (const { label, height, draw } of this.rows) {
      const { context, colours } = canvas;
      context.font = "600 12px system-ui, sans-serif";
      context.fillStyle = colours.ink;
      context.textAlign = "left";
      context.textBaseline = "top";
      context.fillText(label, 2, top, LEFT - 6);
      draw({ canvas, axis, recording, other, top, height });
      top += height + SPACE;
    }
    drawCollisions(canvas, axis, recording, top - SPACE);
    drawTimes(canvas, axis, top);
    canvas.context = onPage;
  }
}

function upright(context, x, height) {
  context.beginPath();
  context.moveTo(x, 0);
  context.lineTo(x, height);
  context.stroke();
}

/**
 * A curve of one of the ego vehicle's columns, of both drives if there are two. `range` without values is as theirs.
 * @param {string} label
 * @param {number} height
 * @param {"speed_mps" | "acceleration_mps2" | "proc"} column
 * @param {string} unit
 * @param {number} factor from the column's unit
 * @param {number[]} [range]
 * @returns {PlotRow}
 */
function curveRow(label, height, column, unit, factor, range) {
  const draw = (/** @type {Box} */ box) => {
    const { colours } = box.canvas;
    const series = ({ columns, header }) => columns[header.ego[column]];
    const values = series(box.recording);
    const second = box.other && series(box.other);
    const bounds = range ?? extent(second ? [values, second] : [values], factor);
    drawCurve(box, values, factor, bounds, colours.accent, []);
    if (second) drawCurve(box, second, factor, bounds, colours.warn, [5, 3]);
    drawScale(box, bounds, unit, 0);
  };
  return { label, height, draw };
}

/**
 * From the least, at most 0, to the greatest, at least 1.
 * @param {Float64Array[]} lists
 * @param {number} factor
 */
function extent(lists, factor) {
  const all = (fold, start) => lists.reduce((found, list) => list.reduce((a, b) => fold(a, b), found), start) * factor;
  return [all(Math.min, 0), Math.max(1, all(Math.max, 0))];
}

/**
 * The ends of a row's range, beside it.
 * @param {Box} box
 * @param {number[]} range
 * @param {string} unit
 * @param {number} digits
 */
function drawScale({ canvas, top, height }, [low, high], unit, digits) {
  const { context, colours } = canvas;
  context.font = "11px system-ui, sans-serif";
  context.fillStyle = colours.muted;
  context.fillText(`${figure(high, "", digits)} ${unit}`, 2, top + 15);
  if (Number(low.toFixed(digits)) < 0) context.fillText(figure(low, "", digits), 2, top + height - 12);
}

/**
 * @param {Box} box
 * @param {Float64Array} values
 * @param {number} factor
 * @param {number[]} range
 * @param {string} colour
 * @param {number[]} dash
 */
function drawCurve({ canvas, axis, recording, top, height }, values, factor, [low, high], colour, dash) {
  const { context, colours } = canvas;
  const y = (value) => top + height - ((value - low) / (high - low || 1)) * height;
  context.strokeStyle = colours.grid;
  context.lineWidth = 1;
  context.beginPath();
  for (const at of [0, high]) {
    context.moveTo(axis.left, y(at));
    context.lineTo(axis.right, y(at));
  }
  context.stroke();
  context.strokeStyle = colour;
  context.lineWidth = 1.6;
  context.setLineDash(dash);
  context.beginPath();
  values.forEach((value, tick) => context.lineTo(axis.xOf(tick * recording.tickS), y(value * factor)));
  context.stroke();
  context.setLineDash([]);
}

/**
 * By how much a requirement was kept, where it was asked; below 0 it was not. Its breaches are shaded.
 * @param {Box} box
 * @param {Margin} margin
 */
function drawMargin(box, { requirement, unit, parts }) {
  const { canvas, axis, top, height } = box;
  const { context, colours } = canvas;
  const { header, columns, tickS } = box.recording;
  const all = parts.flatMap(([, column]) => Array.from(columns[column]));
  const low = all.reduce((least, margin) => Math.min(least, Math.max(margin, -100)), 0);
  const high = Math.max(0.1, median(all) * 2);
  const y = (margin) => top + height - ((Math.min(Math.max(margin, low), high) - low) / (high - low)) * height;
  context.fillStyle = `color-mix(in srgb, ${colours.danger} 25%, ${colours.paper})`;
  for (const breach of header.summary.breaches.filter((one) => one.requirement === requirement)) {
    const [left, right] = [axis.xOf(breach.at_s), axis.xOf(breach.until_s)];
    context.fillRect(left - 1, top, Math.max(right - left, 2), height);
  }
  context.strokeStyle = colours.danger;
  context.lineWidth = 1;
  context.beginPath();
  context.moveTo(axis.left, y(0));
  context.lineTo(axis.right, y(0));
  context.stroke();
  context.strokeStyle = colours.accent;
  context.lineWidth = 1.6;
  for (const [from, column] of parts) {
    context.beginPath();
    columns[column].forEach((margin, i) => context.lineTo(axis.xOf((from + i) * tickS), y(margin)));
    context.stroke();
  }
  drawScale(box, [low, high], unit ?? "", 1);
}

/**
 * The share of branches from a moment on in which a finding happened again, up to the finding itself.
 * @param {Box} box
 * @param {{ at_s: number, moments: Branched[] }} chances
 */
function drawChance(box, { at_s: foundS, moments }) {
  const { canvas, axis, top, height } = box;
  const { context, colours } = canvas;
  const shares = moments.map(({ at_s: atS, recurred, replays }) => [atS, recurred / replays]);
  const y = (share) => top + height - share * height;
  context.strokeStyle = colours.grid;
  context.lineWidth = 1;
  context.strokeRect(axis.left, top, axis.right - axis.left, height);
  context.strokeStyle = colours.danger;
  context.fillStyle = colours.danger;
  context.lineWidth = 1.6;
  context.beginPath();
  for (const [atS, share] of [...shares, [foundS, 1]]) context.lineTo(axis.xOf(atS), y(share));
  context.stroke();
  for (const [atS, share] of shares) {
    context.beginPath();
    context.arc(axis.xOf(atS), y(share), 2.5, 0, 2 * Math.PI);
    context.fill();
  }
  drawScale(box, [0, 1], "", 0);
}

/** @param {Box} box */
function drawReasons({ canvas, axis, recording, top, height }) {
  const { context, colours } = canvas;
  const { held } = recording.header;
  context.font = "11px system-ui, sans-serif";
  context.textBaseline = "middle";
  held.forEach(([from, text, restraint], i) => {
    const [left, right] = [axis.xOf(from), axis.xOf(held[i + 1]?.[0] ?? recording.endS)];
    context.fillStyle = restraintColour(restraint, colours);
    context.fillRect(left, top, Math.max(right - left - 0.5, 0.5), height);
    if (right - left > context.measureText(text).width + 6) {
      context.fillStyle = colours.ink;
      context.fillText(text, left + 3, top + height / 2);
    }
  });
}

/** @param {Box} box */
function drawActions({ canvas, axis, recording, top, height }) {
  const { context, colours } = canvas;
  const { steps, rows } = recording.header;
  context.font = "11px system-ui, sans-serif";
  context.textBaseline = "middle";
  steps.forEach(({ at_s: fromS, outcome }, i) => {
    const [left, right] = [axis.xOf(fromS), axis.xOf(steps[i + 1]?.at_s ?? recording.endS)];
    context.strokeStyle = outcome.kind === "refused" ? colours.danger : colours.muted;
    context.setLineDash(outcome.kind === "done" ? [] : [3, 3]);
    context.strokeRect(left + 0.5, top + 0.5, Math.max(right - left - 2, 1), height - 1);
    context.setLineDash([]);
    context.save();
    context.beginPath();
    context.rect(left, top, right - left - 3, height);
    context.clip();
    context.fillStyle = colours.ink;
    context.fillText(outcomeInShort(outcome, rows), left + 4, top + height / 2);
    context.restore();
  });
}

/**
 * @param {import("./data").Outcome} outcome
 * @param {string[]} rows
 */
function outcomeInShort(outcome, rows) {
  if (outcome.kind === "done") return outcome.text.split("(")[0];
  return outcome.kind === "refused" ? `refused ${rows[outcome.row] ?? ""}` : "–";
}

/** Each collision, through all rows. */
function drawCollisions(canvas, axis, recording, bottom) {
  const { context, colours } = canvas;
  context.fillStyle = colours.danger;
  context.font = "bold 13px system-ui, sans-serif";
  context.textAlign = "left";
  context.textBaseline = "middle";
  for (const collision of recording.header.collisions) {
    const x = axis.xOf(collision.at_s);
    context.fillRect(x - 1, 2, 2, bottom - 2);
    context.fillText("✕", x - 12, 10);
  }
}

function drawTimes(canvas, axis, top) {
  const { context, colours } = canvas;
  context.font = "11px system-ui, sans-serif";
  context.fillStyle = colours.muted;
  context.textAlign = "center";
  context.textBaseline = "top";
  for (const timeS of axis.labels()) context.fillText(`${timeS} s`, axis.xOf(timeS), top + 2);
}

function median(numbers) {
  const sorted = [...numbers].sort((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)] ?? 0;
}
