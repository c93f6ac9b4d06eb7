// A scenario to watch: view, clock, plots, film strip, verdict, actions and source.
import { Clock, RATES } from "./clock.js";
import { announce, el, refill } from "./dom.js";
import { showMoment, showSteps, showUsers, showVerdict, twins } from "./facts.js";
import { ground } from "./ground.js";
import { copyLink, linkOf, linked, relink } from "./link.js";
import { recording } from "./moment.js";
import { Plots } from "./plots.js";
import { showSource } from "./source.js";
import { drawStrip } from "./strip.js";
import { LAYERS, LAYERS_AT_FIRST, View } from "./view.js";
import { DRIVERS, figure, mainCollision } from "./words.js";

let open = null;

/** The replay that is open, if one is. */
export const opened = () => open;

/** Ends the replay that is open. */
export function closeWatch() {
  open?.end();
  open = null;
}

/** Opens a scenario in an element. */
export async function showWatch(place, data, entry) {
  closeWatch();
  const parts = linked();
  const first = await recording(`s${entry.n}`);
  const road = await ground(entry.ground);
  const second = await other(data, entry, parts.with);
  open = new Watch(place, data, entry, { first, road, second });
  open.begin(parts);
}

/** What is shown beside: the other driving system's drive (`c`), or another scenario. */
async function other(data, entry, wanted) {
  if (wanted === "c" && entry.compared) {
    return { recording: await recording(`c${entry.n}`), road: await ground(entry.ground), name: `the same scenario with ${driverName(data)}` };
  }
  const found = /^\d+$/.test(wanted ?? "") ? data.scenarios[Number(wanted)] : null;
  if (!found) return null;
  return { recording: await recording(`s${found.n}`), road: await ground(found.ground), name: found.file };
}

/** The driving system that all scenarios are compared with, in words. */
const driverName = (data) => DRIVERS[data.compared_with] ?? data.compared_with;

class Watch {
  constructor(place, data, entry, { first, road, second }) {
    Object.assign(this, { data, entry, recording: first, road, second });
    this.layers = new Set((linked().layers ?? LAYERS_AT_FIRST).split(",").filter(Boolean));
    const endS = Math.max(first.endS, second?.recording.endS ?? 0);
    this.clock = new Clock(endS, first.tickS, () => this.#show());
    this.#build(place);
  }

  begin(parts) {
    this.resize = new ResizeObserver(() => this.#draw());
    this.views.forEach((view) => this.resize.observe(view.canvas.element));
    const collision = this.recording.collision();
    const start = Number.parseFloat(parts.t);
    this.clock.seek(Number.isFinite(start) ? start : Math.max(0, (collision?.at_s ?? 4) - 4));
    requestAnimationFrame(() => this.drawStills());
  }

  end() {
    this.clock.playing = false;
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
    const collision = mainCollision(entry.summary);
    const canvas = (name) => el("canvas", { class: "stage", role: "img", "aria-label": `View from above: ${name}` });
    const stages = [[this.recording, this.road, entry.file], ...(this.second ? [[this.second.recording, this.second.road, this.second.name]] : [])];
    this.views = [];
    const figures = stages.map(([recorded, road, name], i) => {
      const element = canvas(name);
      this.views.push(new View(element, recorded, road, this.layers));
      const caption = this.second ? el("figcaption", {}, el("strong", {}, i === 0 ? "A · " : "B · "), i === 0 ? `${name} with ${recorded.header.summary.ads}` : name) : null;
      return el("figure", { class: "staged" }, element, caption);
    });
    const moment = el("dl", { class: "moment", id: "moment" });
    const users = el("div", { id: "users" });
    const verdict = el("div", { id: "verdict" });
    const steps = el("div", { id: "steps" });
    const source = el("div", { id: "source" });
    const strip = el("div", { class: "strip", id: "strip", role: "group", "aria-label": "Five stills" });
    const plots = el("canvas", { class: "plots", id: "plots", role: "img", "aria-label": "Speed, acceleration, ProC, what held the speed, and actions over time" });
    refill(
      place,
      el("p", { class: "crumbs" }, el("a", { href: linkOf(withoutWatch()) }, "← All scenarios")),
      el("h1", {}, entry.file.replace(/^.*\//, "").replace(/\.ava$/, ""), entry.shrunk_from ? " (shrunk)" : ""),
      el("p", { class: "lead" }, collision ? sentence(this.recording) : "No collision."),
      twins(entry, data.scenarios),
      el("div", { class: this.second ? "stages two" : "stages" }, figures),
      this.#controls(),
      el("p", { id: "said", class: "said", role: "status", "aria-live": "polite" }),
      moment,
      el("section", { "aria-labelledby": "h-strip" }, el("h2", { id: "h-strip" }, "The story in five stills"), strip),
      el("section", { "aria-labelledby": "h-time" }, el("h2", { id: "h-time" }, "Over time"), plots),
      el(
        "div",
        { class: "columns" },
        el("section", { "aria-labelledby": "h-verdict" }, el("h2", { id: "h-verdict" }, "What happened"), verdict, el("h2", {}, "Who is there"), users),
        el("section", { "aria-labelledby": "h-source" }, el("h2", { id: "h-source" }, "The scenario"), source),
      ),
      el("section", { "aria-labelledby": "h-steps" }, el("h2", { id: "h-steps" }, "Actions"), steps),
      precision(data.quantisation),
    );
    const seek = (timeS) => {
      this.clock.pause();
      this.clock.seek(timeS);
    };
    this.places = { users };
    this.plots = new Plots(plots, this.recording, seek, this.second?.recording ?? null);
    this.showMoment = showMoment(moment);
    showVerdict(verdict, this.recording, seek, (timeS) => {
      const box = document.querySelector('input[name="drivers"]');
      if (!box.checked) box.click();
      clock.seek(timeS);
      clock.play();
      this.views[0].canvas.element.scrollIntoView({ block: "nearest" });
    });
    this.markStep = showSteps(steps, this.recording, seek);
    this.markSource = showSource(source, this.recording.header.source, (step) => seek(this.recording.header.steps[step]?.at_s ?? 0));
    this.drawStills = drawStrip(strip, this.recording, this.road, seek, (timeS) => this.#peek(timeS));
    this.resize = null;
    new ResizeObserver(() => this.plots.draw(this.clock.timeS)).observe(plots);
  }

  #controls() {
    const { clock } = this;
    const button = (label, title, onclick, attributes = {}) => el("button", { type: "button", title, "aria-label": title, onclick, ...attributes }, label);
    this.playButton = button("▶", "Play (space)", () => clock.toggle(), { id: "play", class: "primary" });
    this.scrubber = el("input", {
      type: "range", id: "scrub", min: 0, max: clock.endS, step: clock.tickS, value: 0, "aria-label": "Time in s",
      oninput: (event) => {
        clock.playing = false;
        clock.seek(Number(event.target.value));
      },
    });
    this.rate = el("select", { id: "rate", "aria-label": "Playing rate", onchange: (event) => this.#setRate(Number(event.target.value)) }, RATES.map((rate) => el("option", { value: rate, selected: rate === 1 }, `${rate} ×`)));
    const layers = LAYERS.map(([name, label, sign]) =>
      el("label", { class: `layer ${name}` }, el("input", { type: "checkbox", name, checked: this.layers.has(name), onchange: (event) => this.toggleLayer(name, event.target.checked) }), el("span", { "aria-hidden": "true" }, sign), ` ${label}`),
    );
    const follow = el("label", { class: "layer" }, el("input", { type: "checkbox", id: "follow", checked: true, onchange: (event) => this.views.forEach((view) => view.follow(event.target.checked)) }), " Follow");
    return el(
      "div",
      { class: "controls" },
      el(
        "div",
        { class: "row" },
        this.playButton,
        button("‹", "A tick back (←)", () => clock.ticks(-1), { id: "back" }),
        button("›", "A tick on (→)", () => clock.ticks(1), { id: "on" }),
        button("✕", "To the collision (c)", () => this.toCollision(), { id: "hit" }),
        this.scrubber,
        this.rate,
        button("−", "Zoom out (-)", () => this.zoom(1 / 1.3)),
        button("+", "Zoom in (+)", () => this.zoom(1.3), { id: "zoom" }),
        follow,
        el("button", { type: "button", id: "copy", onclick: (event) => this.#copy(event.target) }, "Copy link"),
        button("?", "Keys (?)", showKeys, { id: "keys" }),
      ),
      el("fieldset", { class: "row layers" }, el("legend", {}, "Layers"), layers),
      this.#comparison(),
    );
  }

  #comparison() {
    const { data, entry } = this;
    const options = [el("option", { value: "" }, "nothing")];
    if (entry.compared) options.push(el("option", { value: "c" }, `the drive of ${driverName(data)}`));
    for (const one of data.scenarios) if (one.n !== entry.n) options.push(el("option", { value: one.n }, one.file));
    if (options.length === 1) return null;
    const select = el("select", { id: "with", onchange: (event) => relink({ with: event.target.value, t: this.clock.timeS.toFixed(2) }, true) }, options);
    select.value = linked().with ?? "";
    return el("div", { class: "row" }, el("label", {}, "On the same clock: ", select));
  }

  toggleLayer(name, on) {
    if (on) this.layers.add(name);
    else this.layers.delete(name);
    relink({ layers: [...this.layers].join(",") || "none" });
    this.#draw();
  }

  zoom(factor) {
    this.views.forEach((view) => view.zoom(factor));
  }

  toCollision() {
    const collision = this.recording.collision();
    if (!collision) return announce("There is no collision");
    this.clock.pause();
    this.clock.seek(collision.at_s);
    return announce(`Collision at ${figure(collision.at_s, "s", 2)}`);
  }

  #setRate(rate) {
    this.clock.rate = rate;
  }

  #copy(button) {
    relink({ t: this.clock.timeS.toFixed(2), layers: [...this.layers].join(",") || "none" });
    copyLink(button);
  }

  /** Shows a moment while somebody points at its still. */
  #peek(timeS) {
    if (this.clock.playing) return;
    this.views.forEach((view) => view.draw(timeS ?? this.clock.timeS));
  }

  #show() {
    const { clock } = this;
    if (!this.views) return;
    const { timeS, playing } = clock;
    this.#draw();
    this.scrubber.value = timeS;
    this.scrubber.setAttribute("aria-valuetext", figure(timeS, "s", 2));
    this.playButton.textContent = playing ? "❚❚" : "▶";
    this.playButton.setAttribute("aria-label", playing ? "Pause (space)" : "Play (space)");
    this.rate.value = String(clock.rate);
    this.showMoment(this.recording, timeS);
    const step = this.recording.step(timeS);
    this.markStep(step);
    this.markSource(step);
    if (playing) return;
    showUsers(this.places.users, this.recording, timeS);
    relink({ t: timeS.toFixed(2) });
  }

  #draw() {
    this.views.forEach((view) => view.draw(Math.min(this.clock.timeS, view.recording.endS)));
    this.plots.draw(this.clock.timeS);
  }
}

function sentence(recorded) {
  const [text] = recorded.header.docs;
  return text ?? "";
}

function withoutWatch() {
  const parts = linked();
  for (const part of ["s", "t", "layers", "with"]) delete parts[part];
  return parts;
}

function precision(steps) {
  return el(
    "p",
    { class: "muted fine" },
    `Drawn from numbers that are exact to ±${steps.place_m * 1000} mm, ±${steps.heading_rad * 1000} mrad, ±${steps.speed_mps} m/s and ±${steps.probability} (ProC) ` +
      `at every tick of ${steps.tick_s} s; plans and predictions to ±${steps.sketch_m * 100} cm every ${steps.thought_s} s, what is perceived every ${steps.perceived_s} s. Between ticks places are interpolated.`,
  );
}

/** The keys, in a dialogue. */
export function showKeys() {
  const keys = [
    ["space", "play, pause"], ["← →", "a tick back, on"], ["shift ← →", "a step of the agent back, on"], ["c", "to the collision"],
    ["home, end", "to the beginning, the end"], ["- +", "zoom"], ["f", "follow the ego vehicle"], ["[ ]", "slower, faster"], ["1 … 9, 0", "layers"], ["esc", "all scenarios"], ["?", "this list"],
  ];
  let dialog = document.getElementById("help");
  if (!dialog) {
    const close = el("button", { type: "button", onclick: () => dialog.close() }, "Close");
    const list = el("dl", { class: "keys" }, keys.map(([name, text]) => [el("dt", {}, el("kbd", {}, name)), el("dd", {}, text)]));
    dialog = el("dialog", { id: "help", "aria-labelledby": "h-help" }, el("h2", { id: "h-help" }, "Keys"), list, el("p", {}, "Drag moves the view; ctrl with the wheel, or two fingers, zoom."), close);
    document.body.append(dialog);
  }
  dialog.showModal();
}

/** What a key does in an open replay; gives whether it did something. */
export function key(event) {
  const { clock, recording: recorded } = open;
  const step = (by) => {
    const next = recorded.header.steps[recorded.step(clock.timeS - (by < 0 ? 0.02 : 0)) + (by > 0 ? 1 : 0)];
    clock.pause();
    clock.seek(next ? next.at_s : by > 0 ? clock.endS : 0);
  };
  const act = {
    " ": () => clock.toggle(),
    ArrowLeft: () => (event.shiftKey ? step(-1) : clock.ticks(-1)),
    ArrowRight: () => (event.shiftKey ? step(1) : clock.ticks(1)),
    Home: () => clock.seek(0),
    End: () => clock.seek(clock.endS),
    c: () => open.toCollision(),
    f: () => document.getElementById("follow").click(),
    "-": () => open.zoom(1 / 1.3),
    "+": () => open.zoom(1.3),
    "[": () => clock.faster(-1),
    "]": () => clock.faster(1),
    Escape: () => (location.hash = linkOf(withoutWatch())),
  }[event.key];
  if (act) {
    act();
    return true;
  }
  const layer = /^\d$/.test(event.key) ? LAYERS[(Number(event.key) + 9) % 10] : null;
  if (!layer) return false;
  document.querySelector(`input[name="${layer[0]}"]`).click();
  return true;
}
