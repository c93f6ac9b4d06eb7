// A scenario to watch: view, clock, plots, film strip, verdict, actions and source.
import { Clock } from "./clock.js";
import { Controls } from "./controls.js";
import { announce, el, refill } from "./dom.js";
import { origin, refutedClaims, showMoment, showSteps, showUsers, showVerdict, twins } from "./facts.js";
import { ground } from "./ground.js";
import { COMPARED, byName, copyLink, linkToList, linked, nameOf, relink } from "./link.js";
import { recording } from "./moment.js";
import { Plots } from "./plots.js";
import { showSource } from "./source.js";
import { drawStrip } from "./strip.js";
import { LAYERS_AT_FIRST, View } from "./view.js";
import {
  atTime,
  breachInWords,
  changeInWords,
  collisionInWords,
  driverInWords,
  figure,
  mainCollision,
} from "./words.js";

/** @import { Entry, Index } from "./data" */
/** @import { Recording } from "./moment.js" */

/** @type {Watch | null} */
let open = null;
/** How often something was asked for: of two quick clicks the later one counts. */
let asked = 0;

/** The replay that is open, if one is. */
export const opened = () => open;

/** Ends the replay that is open, and the loading of another. */
export function closeWatch() {
  asked += 1;
  open?.end();
  open = null;
}

/** Opens a scenario in an element; gives whether it is shown, and nothing else was asked for meanwhile. */
export async function showWatch(place, data, entry) {
  closeWatch();
  const turn = asked;
  const parts = linked();
  const [first, road, second] = await Promise.all([
    recording(`s${entry.n}`),
    ground(entry.ground),
    other(data, entry, parts.with),
  ]);
  if (turn !== asked) return false;
  open = new Watch(place, data, entry, { first, road, second });
  open.begin(parts);
  return true;
}

/**
 * What is shown beside: the other driving system's drive, which is there at first, or another scenario.
 * @param {Index} data
 * @param {Entry} entry
 * @param {string | undefined} wanted
 * @returns {Promise<{ recording: Recording, road: any, name: string } | null>}
 */
async function other(data, entry, wanted) {
  if ((wanted ?? COMPARED) === COMPARED && entry.compared) {
    const [recorded, road] = await Promise.all([recording(`c${entry.n}`), ground(entry.ground)]);
    return { recording: recorded, road, name: `the same scenario with ${driverInWords(data.compared_with)}` };
  }
  const found = byName(data.scenarios, wanted);
  if (!found) return null;
  const [recorded, road] = await Promise.all([recording(`s${found.n}`), ground(found.ground)]);
  return { recording: recorded, road, name: nameOf(found) };
}

export class Watch {
  // What it is made of, once it is built.
  /** @type {Controls} */
  controls;
  /** @type {Plots} */
  plots;
  /** @type {View[]} */
  views;
  /** @type {HTMLElement} */
  users;
  /** @type {ResizeObserver} */
  resize;
  /** @type {(recording: Recording, timeS: number) => void} */
  showMoment;
  /** @type {(step: number) => void} */
  markStep;
  /** @type {(step: number) => void} */
  markSource;
  /** @type {() => void} */
  drawStills;

  /**
   * @param {HTMLElement} place
   * @param {Index} data
   * @param {Entry} entry
   * @param {{ first: Recording, road: any, second: { recording: Recording, road: any, name: string } | null }} shown
   */
  constructor(place, data, entry, { first, road, second }) {
    this.data = data;
    this.entry = entry;
    this.recording = first;
    this.road = road;
    this.second = second;
    this.layers = new Set((linked().layers ?? LAYERS_AT_FIRST).split(",").filter(Boolean));
    const endS = Math.max(first.endS, second?.recording.endS ?? 0);
    this.clock = new Clock(endS, first.tickS, () => this.#show());
    this.#build(place);
  }

  begin(parts) {
    this.resize = new ResizeObserver(() => this.#draw());
    this.views.forEach((view) => this.resize.observe(view.canvas.element));
    this.resize.observe(this.plots.canvas.element);
    const event = this.recording.event();
    const start = Number.parseFloat(parts.t);
    this.clock.seek(Number.isFinite(start) ? start : Math.max(0, (event?.at_s ?? 4) - 4));
    requestAnimationFrame(() => this.drawStills());
  }

  end() {
    this.clock.stop();
    this.resize?.disconnect();
  }

  repaint() {
    this.views.forEach((view) => view.repaint());
    this.plots.repaint();
    this.drawStills();
    this.#draw();
  }

  #build(place) {
    const { clock, data, entry } = this;
    const { header } = this.recording;
    const collision = mainCollision(entry.summary);
    const id = (name) => el("div", { id: name });
    const [users, verdict, steps, source] = ["users", "verdict", "steps", "source"].map(id);
    const figures = el("dl", { class: "moment", id: "moment" });
    const strip = el("div", { class: "strip", id: "strip", role: "group", "aria-label": "Five stills" });
    const plots = el("canvas", {
      class: "plots",
      id: "plots",
      role: "img",
      "aria-label": "Speed, acceleration, ProC, what held the speed, and actions over time",
    });
    this.controls = new Controls(this);
    const section = (name, title, ...inside) =>
      el("section", { "aria-labelledby": `h-${name}` }, el("h2", { id: `h-${name}` }, title), ...inside);
    refill(
      place,
      el("p", { class: "crumbs" }, el("a", { href: linkToList() }, "← All scenarios")),
      el("h1", {}, nameOf(entry).replace(/^.*\//, ""), entry.shrunk_from ? " (shrunk)" : ""),
      el("p", { class: "lead" }, foundInWords(collision, header.summary)),
      entry.changed && el("p", { class: "warning", id: "changed" }, entry.changed),
      refutedClaims(entry.summary),
      origin(header),
      this.#change(),
      twins(entry, data.scenarios),
      el("div", { class: this.second ? "stages two" : "stages" }, this.#stages()),
      this.controls.element,
      el("p", { id: "said", class: "said", role: "status", "aria-live": "polite" }),
      figures,
      section("strip", "The story in five stills", strip),
      section("time", "Over time", plots),
      el(
        "div",
        { class: "columns" },
        section("verdict", "What happened", verdict, el("h2", {}, "Who is there"), users),
        section("source", "The scenario", source),
      ),
      section("steps", "Actions", steps),
      precision(data.quantisation),
    );
    const seek = (timeS) => {
      clock.pause();
      clock.seek(timeS);
    };
    this.users = users;
    this.plots = new Plots(plots, this.recording, seek, this.second?.recording ?? null);
    this.showMoment = showMoment(figures);
    showVerdict(verdict, this.recording, seek, (timeS) => this.#watchDrivers(timeS));
    this.markStep = showSteps(steps, this.recording, seek);
    this.markSource = showSource(source, header.source, (step) => seek(header.steps[step]?.at_s ?? 0));
    this.drawStills = drawStrip(strip, this.recording, this.road, seek, (timeS) => this.#peek(timeS));
  }

  /** The views from above, one beside the other if two are compared. */
  #stages() {
    const { entry, road, second } = this;
    const stages = [[this.recording, road, nameOf(entry)]];
    if (second) stages.push([second.recording, second.road, second.name]);
    const elements = stages.map(([, , name]) =>
      el("canvas", { class: "stage", role: "img", "aria-label": `View from above: ${name}` }),
    );
    this.views = stages.map(([recorded, shape], i) => new View(elements[i], recorded, shape, this.layers));
    const captions = stages.map(([recorded, , name], i) => {
      const driven = i === 0 ? `${name} with ${recorded.header.summary.ads}` : name;
      return second && el("figcaption", {}, el("strong", {}, i === 0 ? "A · " : "B · "), driven);
    });
    return elements.map((element, i) => el("figure", { class: "staged" }, captions[i], element));
  }

  /** What the other driving system makes of this scenario. */
  #change() {
    const { change } = this.entry;
    if (!change) return null;
    return el(
      "p",
      { id: "change" },
      el("strong", {}, `With ${driverInWords(this.data.compared_with)}: `),
      `${changeInWords(change)}${change.why ? `: ${change.why}` : ""}.`,
    );
  }

  #watchDrivers(timeS) {
    this.controls.setLayer("drivers", true);
    this.clock.seek(timeS);
    this.clock.play();
    this.views[0].canvas.element.scrollIntoView({ block: "nearest" });
  }

  toggleLayer(name, on) {
    if (on) this.layers.add(name);
    else this.layers.delete(name);
    relink({ layers: this.#layersInLink() });
    this.#draw();
  }

  zoom(factor) {
    this.views.forEach((view) => view.zoom(factor));
  }

  follow(on) {
    this.views.forEach((view) => view.follow(on));
  }

  toCollision() {
    const collision = this.recording.collision();
    if (!collision) return this.#toBreach();
    this.clock.pause();
    this.clock.seek(collision.at_s);
    return announce(`Collision at ${atTime(collision.at_s)}`);
  }

  #toBreach() {
    const [breach] = this.recording.header.summary.breaches;
    if (!breach) return announce("There is no collision");
    this.clock.pause();
    this.clock.seek(breach.at_s);
    return announce(`${breachInWords(breach)}`);
  }

  /** Opens another drive beside this one, at the same moment. */
  compareWith(name) {
    relink({ with: name, t: this.clock.timeS.toFixed(2) }, true);
  }

  copy(button) {
    relink({ t: this.clock.timeS.toFixed(2), layers: this.#layersInLink() });
    copyLink(button);
  }

  #layersInLink() {
    return [...this.layers].join(",") || "none";
  }

  /** Shows a moment while the pointer is on its still; `null` goes back. */
  #peek(timeS) {
    if (this.clock.playing) return;
    this.views.forEach((view) => view.draw(timeS ?? this.clock.timeS));
  }

  #show() {
    const { timeS, playing } = this.clock;
    this.#draw();
    this.controls.show(this.clock);
    this.showMoment(this.recording, timeS);
    const step = this.recording.step(timeS);
    this.markStep(step);
    this.markSource(step);
    if (playing) return;
    showUsers(this.users, this.recording, timeS);
    relink({ t: timeS.toFixed(2) });
  }

  #draw() {
    this.views.forEach((view) => view.draw(Math.min(this.clock.timeS, view.recording.endS)));
    this.plots.draw(this.clock.timeS);
  }
}

/** What was found, in a sentence: the collision, else the first breach, else why the driving system failed. */
function foundInWords(collision, { road, breaches, failure, duration_s: endS }) {
  if (collision) return `${collisionInWords(collision, road)}.`;
  if (failure && breaches.length === 0) return `The driving system failed after ${figure(endS, "s", 2)}: ${failure}.`;
  return breaches.length > 0 ? `${breachInWords(breaches[0])} on ${road}.` : "No collision.";
}

function precision(steps) {
  return el(
    "p",
    { class: "muted fine" },
    `Drawn from numbers that are exact to ±${steps.place_m * 1000} mm, ±${steps.heading_rad * 1000} mrad, ` +
      `±${steps.speed_mps} m/s and ±${steps.probability} (ProC, every 0.1 s) at every tick of ` +
      `${steps.tick_s} s; plans and predictions to ±${steps.sketch_m * 100} cm every ${steps.thought_s} s, what is ` +
      `perceived every ${steps.perceived_s} s. Between ticks places are interpolated.`,
  );
}
