// The keys of a replay, and the list of them.
import { el } from "./dom.js";
import { linkToList } from "./link.js";
import { LAYERS, ZOOM } from "./view.js";

const KEYS = [
  ["space", "play, pause"],
  ["← →", "a tick back, on"],
  ["shift ← →", "a step of the agent back, on"],
  ["c", "to the collision"],
  ["home, end", "to the beginning, the end"],
  ["- +", "zoom"],
  ["f", "follow the ego vehicle"],
  ["[ ]", "slower, faster"],
  ["1 … 9, 0", "layers"],
  ["esc", "all scenarios"],
  ["?", "this list"],
];

/** The keys, in a dialogue. */
export function showKeys() {
  let dialog = /** @type {HTMLDialogElement} */ (document.getElementById("help"));
  if (!dialog) {
    dialog = el(
      "dialog",
      { id: "help", "aria-labelledby": "h-help" },
      el("h2", { id: "h-help" }, "Keys"),
      el(
        "dl",
        { class: "keys" },
        KEYS.map(([name, text]) => [el("dt", {}, el("kbd", {}, name)), el("dd", {}, text)]),
      ),
      el("p", {}, "Drag moves the view; ctrl with the wheel, or two fingers, zoom."),
      el("button", { type: "button", onclick: () => dialog.close() }, "Close"),
    );
    document.body.append(dialog);
  }
  dialog.showModal();
}

/** What a key does in an open replay; gives whether it did something. */
export function key(event, watch) {
  const { clock } = watch;
  const act = {
    " ": () => clock.toggle(),
    ArrowLeft: () => (event.shiftKey ? toStep(watch, -1) : clock.ticks(-1)),
    ArrowRight: () => (event.shiftKey ? toStep(watch, 1) : clock.ticks(1)),
    Home: () => clock.seek(0),
    End: () => clock.seek(clock.endS),
    c: () => watch.toCollision(),
    f: () => watch.controls.flipFollow(),
    "-": () => watch.zoom(1 / ZOOM),
    "+": () => watch.zoom(ZOOM),
    "[": () => clock.faster(-1),
    "]": () => clock.faster(1),
    Escape: () => (location.hash = linkToList()),
  }[event.key];
  if (act) {
    act();
    return true;
  }
  const layer = /^\d$/.test(event.key) ? LAYERS[(Number(event.key) + 9) % 10] : null;
  if (!layer) return false;
  watch.controls.setLayer(layer[0]);
  return true;
}

/** To the beginning of the next step, or of this one; from there, of the one before. */
function toStep({ clock, recording: recorded }, by) {
  // A moment earlier, so that at the beginning of a step the one before is meant.
  const now = recorded.step(clock.timeS - (by < 0 ? recorded.tickS : 0));
  const next = recorded.header.steps[now + (by > 0 ? 1 : 0)];
  clock.pause();
  clock.seek(next ? next.at_s : by > 0 ? clock.endS : 0);
}
