// The controls of a replay: play, scrub, rate, zoom, layers, and what is shown beside.
import { RATES } from "./clock.js";
import { el } from "./dom.js";
import { showKeys } from "./keys.js";
import { COMPARED, COPY_LINK, NOTHING, linked, nameOf } from "./link.js";
import { LAYERS, ZOOM } from "./view.js";
import { driverInWords, figure } from "./words.js";

/** @import { Watch } from "./watch.js" */
/** @import { Clock } from "./clock.js" */
export class Controls {
  /**
   * Makes the controls that move the clock and the views of an open replay.
   * @param {Watch} watch
   */
  constructor(watch) {
    const { clock } = watch;
    this.watch = watch;
    this.follow = checkbox({ id: "follow", checked: true }, (on) => watch.follow(on));
    /** The box of each layer. */
    this.boxes = new Map(
      LAYERS.map(([name]) => {
        const box = checkbox({ name, checked: watch.layers.has(name) }, (on) => watch.toggleLayer(name, on));
        return [name, box];
      }),
    );
    this.play = button("▶", "Play (space)", () => clock.toggle(), { id: "play", class: "primary" });
    this.scrubber = el("input", {
      type: "range",
      id: "scrub",
      min: 0,
      max: clock.endS,
      step: clock.tickS,
      value: 0,
      "aria-label": "Time in s",
      oninput: (event) => {
        clock.stop();
        clock.seek(Number(event.target.value));
      },
    });
    this.rate = el(
      "select",
      { id: "rate", "aria-label": "Playing rate", onchange: (event) => (clock.rate = Number(event.target.value)) },
      RATES.map((rate) => el("option", { value: rate, selected: rate === 1 }, `${rate} ×`)),
    );
    this.element = el(
      "div",
      { class: "controls" },
      el(
        "div",
        { class: "row" },
        this.play,
        button("‹", "A tick back (←)", () => clock.ticks(-1), { id: "back" }),
        button("›", "A tick on (→)", () => clock.ticks(1), { id: "on" }),
        button("✕", "To the collision (c)", () => watch.toCollision(), { id: "hit" }),
        this.scrubber,
        this.rate,
        button("−", "Zoom out (-)", () => watch.zoom(1 / ZOOM)),
        button("+", "Zoom in (+)", () => watch.zoom(ZOOM), { id: "zoom" }),
        el("label", { class: "layer" }, this.follow, " Follow"),
        el("button", { type: "button", id: "copy", onclick: (event) => watch.copy(event.target) }, COPY_LINK),
        button("?", "Keys (?)", showKeys, { id: "keys" }),
      ),
      el("fieldset", { class: "row layers" }, el("legend", {}, "Layers"), layers(this.boxes)),
      comparison(watch),
    );
  }

  /**
   * Shows or hides a layer, as its box does; without `on` the other way round.
   * @param {string} name
   * @param {boolean} [on]
   */
  setLayer(name, on = !this.boxes.get(name).checked) {
    this.boxes.get(name).checked = on;
    this.watch.toggleLayer(name, on);
  }

  /** Follows the ego vehicle or not, the other way round. */
  flipFollow() {
    this.follow.checked = !this.follow.checked;
    this.watch.follow(this.follow.checked);
  }

  /**
   * Follows the clock.
   * @param {Clock} clock
   */
  show({ timeS, playing, rate }) {
    this.scrubber.value = timeS;
    this.scrubber.setAttribute("aria-valuetext", figure(timeS, "s", 2));
    this.play.textContent = playing ? "❚❚" : "▶";
    this.play.setAttribute("aria-label", playing ? "Pause (space)" : "Play (space)");
    this.rate.value = String(rate);
  }
}

function button(label, title, onclick, attributes = {}) {
  return el("button", { type: "button", title, "aria-label": title, onclick, ...attributes }, label);
}

function checkbox(attributes, changed) {
  return el("input", { type: "checkbox", ...attributes, onchange: (event) => changed(event.target.checked) });
}

function layers(boxes) {
  return LAYERS.map(([name, label, sign]) =>
    el("label", { class: `layer ${name}` }, boxes.get(name), el("span", { "aria-hidden": "true" }, sign), ` ${label}`),
  );
}

/** What is shown on the same clock; nothing to choose where there is nothing else. */
function comparison(watch) {
  const { data, entry } = watch;
  const option = (value, text) => el("option", { value }, text);
  const others = data.scenarios.filter((one) => one.n !== entry.n).map((one) => option(nameOf(one), nameOf(one)));
  const compared = entry.compared ? [option(COMPARED, `the drive of ${driverInWords(data.compared_with)}`)] : [];
  if (others.length + compared.length === 0) return null;
  const select = el(
    "select",
    { id: "with", onchange: (event) => watch.compareWith(event.target.value) },
    option(NOTHING, "nothing"),
    compared,
    others,
  );
  select.value = linked().with ?? (entry.compared ? COMPARED : NOTHING);
  return el("div", { class: "row" }, el("label", {}, "On the same clock: ", select));
}
