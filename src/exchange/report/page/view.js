// The view from above: a recording on its road, at a time, with layers and a camera.
import { drawGround } from "./ground.js";
import { Labels, drawBody, drawImpact, drawPlan, drawPrediction, drawSpeed, drawTrack, isOnFoot } from "./bodies.js";
import { Canvas, palette } from "./paint.js";
import { kmh } from "./words.js";

/** @import { Recording } from "./moment.js" */
/** How much nearer one step of the zoom comes. */
export const ZOOM = 1.3;

/** Layers that can be switched: name, what it is called, and a sign of its look. */
export const LAYERS = [
  ["truth", "What is there", "■"],
  ["perceived", "What it perceives", "┅"],
  ["predicted", "What it predicts", "⋯"],
  ["planned", "What it plans", "━"],
  ["ghosts", "1, 2, 3 s ahead", "▫"],
  ["trails", "Ways so far", "┈"],
  ["drivers", "Reference drivers", "◇"],
  ["signals", "Signals", "●"],
  ["route", "Route", "╌"],
  ["names", "Names and speeds", "a"],
];

export const LAYERS_AT_FIRST = "truth,perceived,predicted,planned,signals,route,names,trails";

const AHEAD_S = [1, 2, 3];
const IMPACT_SHOWN_S = 1.5;

export class View {
  /**
   * @param {HTMLCanvasElement} element
   * @param {Recording} recording
   * @param {any} road as `ground` gives it
   * @param {Set<string>} layers those that are shown
   */
  constructor(element, recording, road, layers) {
    this.canvas = new Canvas(element);
    this.recording = recording;
    this.road = road;
    this.layers = layers;
    this.follows = true;
    /** The moment that is drawn, s. */
    this.timeS = 0;
    /** @type {number | null} */
    this.zoomed = null;
    this.shift = { x: 0, y: 0 };
    this.#handle(element);
  }

  repaint() {
    this.canvas.colours = palette();
  }

  /**
   * Draws the moment.
   * @param {number} timeS
   */
  draw(timeS) {
    this.timeS = timeS;
    const { canvas, recording, layers } = this;
    if (!canvas.fit()) return;
    const ego = recording.ego(timeS);
    this.#place(ego);
    drawGround(canvas, this.road, recording, timeS, layers);
    const others = recording.obstacles(timeS);
    if (layers.has("trails")) this.#trails(timeS, others);
    if (layers.has("planned")) drawPlan(canvas, recording.plan(timeS));
    if (layers.has("ghosts")) this.#ghosts(timeS, others);
    if (layers.has("drivers")) this.#drivers(timeS);
    if (layers.has("truth")) this.#truth(ego, others);
    const tracks = layers.has("perceived") || layers.has("predicted") ? recording.tracks(timeS) : [];
    if (layers.has("predicted")) tracks.forEach((track) => drawPrediction(canvas, track));
    if (layers.has("perceived")) tracks.forEach((track) => drawTrack(canvas, track));
    this.#impacts(timeS);
    if (layers.has("names")) this.#names(ego, others);
    this.#scale();
  }

  #place(ego) {
    const { canvas } = this;
    canvas.camera.pxPerM = this.zoomed ?? Math.min(Math.max(canvas.width / 85, 5), 12);
    // Once the camera is let go it stands where it was.
    if (this.follows || !this.home) this.home = { x: ego.x, y: ego.y };
    canvas.camera.x = this.home.x + this.shift.x;
    canvas.camera.y = this.home.y + this.shift.y;
  }

  #truth(ego, others) {
    const { canvas } = this;
    const { colours } = canvas;
    for (const body of others) {
      const fill = isOnFoot(body) ? colours.pedestrian : colours.truth;
      drawSpeed(canvas, body, colours.truthLine);
      drawBody(canvas, body, { fill, line: colours.truthLine, alpha: body.ambient ? 0.75 : 1 });
    }
    drawSpeed(canvas, ego, colours.egoLine);
    drawBody(canvas, ego, { fill: colours.ego, line: colours.egoLine });
  }

  #trails(timeS, others) {
    const { canvas, recording } = this;
    const since = Math.max(0, timeS - 6);
    const times = [];
    for (let t = since; t < timeS; t += 0.2) times.push(t);
    const thin = Math.max(0.1, canvas.px(1.2));
    canvas.line(
      [...times, timeS].map((t) => recording.ego(t)),
      canvas.colours.ego,
      thin,
      [0.3, 0.7],
    );
    const ways = new Map(others.map((body) => [body.id, []]));
    for (const t of [...times, timeS]) {
      for (const body of recording.obstacles(t)) ways.get(body.id)?.push(body);
    }
    for (const way of ways.values()) canvas.line(way, canvas.colours.truthLine, thin, [0.3, 0.7]);
  }

  /** Road users where the recording has them some seconds later. */
  #ghosts(timeS, others) {
    const { canvas, recording } = this;
    for (const ahead of AHEAD_S) {
      const then = timeS + ahead;
      if (then > recording.endS) break;
      const alpha = 0.5 - 0.12 * ahead;
      const style = { fill: canvas.colours.ghost, line: canvas.colours.ink, alpha, dashed: true };
      const known = new Set(others.map((body) => body.id));
      for (const body of recording.obstacles(then)) {
        if (known.has(body.id)) drawBody(canvas, { ...body, braking: false }, style);
      }
      drawBody(canvas, recording.ego(then), { ...style, fill: canvas.colours.ego });
    }
  }

  #drivers(timeS) {
    const { canvas, recording } = this;
    const { colours } = canvas;
    const collision = recording.collision();
    for (const way of collision?.ways ?? []) {
      if (way.from_s === null || timeS < way.from_s - way.every_s) continue;
      const dash = way.avoids ? [] : [0.6, 0.6];
      canvas.line(recording.wayOf(way), colours.driver, Math.max(0.15, canvas.px(1.6)), dash);
      const place = recording.driver(way, timeS);
      if (place) drawBody(canvas, place, { fill: null, line: colours.driver, dashed: !way.avoids });
    }
  }

  #impacts(timeS) {
    const { collisions, summary } = this.recording.header;
    for (const collision of [...collisions, ...summary.crashes]) {
      const since = timeS - collision.at_s;
      if (since >= -1e-6 && since <= IMPACT_SHOWN_S) drawImpact(this.canvas, this.recording.impact(collision));
    }
  }

  #names(ego, others) {
    const { canvas } = this;
    const labels = new Labels(canvas);
    const size = (body) => (isOnFoot(body) ? 6 : Math.max(8, (body.width / 2) * canvas.camera.pxPerM));
    for (const body of [ego, ...others]) labels.keep(body, size(body));
    for (const collision of this.recording.header.collisions) {
      if (Math.abs(this.timeS - collision.at_s) <= IMPACT_SHOWN_S) labels.keep(this.recording.impact(collision), 12);
    }
    labels.write(ego, `ego ${kmh(ego.speed)}`, size(ego), canvas.colours.ego);
    const hit = new Set(this.recording.header.collisions.map((collision) => collision.obstacle));
    if (this.layers.has("drivers")) {
      for (const way of this.recording.collision()?.ways ?? []) {
        const place = this.recording.driver(way, this.timeS);
        if (place) labels.write(place, `${way.name} ${kmh(place.speed)}`, size(place), canvas.colours.driver);
      }
    }
    const sorted = [...others].sort((a, b) => Number(hit.has(b.id)) - Number(hit.has(a.id)));
    for (const body of sorted) {
      const at = canvas.at(body);
      if (at.x < 0 || at.y < 0 || at.x > canvas.width || at.y > canvas.height) continue;
      if (body.ambient && !hit.has(body.id)) continue;
      labels.write(body, `${body.body} #${body.id} ${kmh(Math.abs(body.speed))}`, size(body), canvas.colours.truthLine);
    }
  }

  /** A scale and an arrow to the north. */
  #scale() {
    const { canvas } = this;
    const { context, colours } = canvas;
    canvas.enterScreen();
    const widest = canvas.width / 5;
    const length = [200, 100, 50, 20, 10, 5, 2, 1].find((m) => m * canvas.camera.pxPerM <= widest) ?? 1;
    const px = length * canvas.camera.pxPerM;
    const [left, low] = [14, canvas.height - 16];
    context.fillStyle = colours.paper;
    context.globalAlpha = 0.85;
    context.fillRect(left - 6, low - 20, px + 12, 28);
    context.fillRect(canvas.width - 34, canvas.height - 52, 26, 44);
    context.globalAlpha = 1;
    context.strokeStyle = colours.ink;
    context.fillStyle = colours.ink;
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(left, low - 4);
    context.lineTo(left, low);
    context.lineTo(left + px, low);
    context.lineTo(left + px, low - 4);
    context.stroke();
    context.font = "600 11px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "alphabetic";
    context.fillText(`${length} m`, left + px / 2, low - 6);
    const [x, y] = [canvas.width - 21, canvas.height - 14];
    context.fillText("N", x, y - 24);
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(x, y - 20);
    context.moveTo(x - 4, y - 13);
    context.lineTo(x, y - 20);
    context.lineTo(x + 4, y - 13);
    context.stroke();
  }

  /**
   * @param {number} factor
   */
  zoom(factor) {
    this.zoomed = Math.min(Math.max(this.canvas.camera.pxPerM * factor, 0.8), 60);
    this.draw(this.timeS);
  }

  /**
   * @param {boolean} on
   */
  follow(on) {
    this.follows = on;
    if (on) this.shift = { x: 0, y: 0 };
    this.draw(this.timeS);
  }

  #handle(element) {
    element.addEventListener(
      "wheel",
      (event) => {
        // Without a key the page scrolls past the view, as everywhere.
        if (!event.ctrlKey && !event.metaKey) return;
        event.preventDefault();
        this.zoom(event.deltaY < 0 ? 1.15 : 1 / 1.15);
      },
      { passive: false },
    );
    const fingers = new Map();
    element.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, event);
      element.setPointerCapture(event.pointerId);
    });
    element.addEventListener("pointermove", (event) => {
      const before = fingers.get(event.pointerId);
      if (!before) return;
      const other = [...fingers.values()].find((finger) => finger.pointerId !== event.pointerId);
      fingers.set(event.pointerId, event);
      if (other) {
        const apart = (a, b) => Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
        this.zoom(apart(event, other) / Math.max(1, apart(before, other)));
        return;
      }
      const { pxPerM } = this.canvas.camera;
      this.shift.x -= (event.clientX - before.clientX) / pxPerM;
      this.shift.y += (event.clientY - before.clientY) / pxPerM;
      this.draw(this.timeS);
    });
    for (const name of ["pointerup", "pointercancel"])
      element.addEventListener(name, (event) => fingers.delete(event.pointerId));
  }
}
