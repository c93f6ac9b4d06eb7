// The film strip: five stills up to the event, to see at a glance and to point at.
import { el, refill } from "./dom.js";
import { View } from "./view.js";
import { atTime, inHundred } from "./words.js";

/** @import { Event, Recording } from "./moment.js" */
export const STILL_LAYERS = new Set(["truth", "signals"]);

/**
 * The five moments of a scenario: four seconds up to its event, or evenly through it. The moment from which on it was
 * likely takes the place of the nearest.
 * @param {Recording} recording
 * @param {Event | null} event
 */
function stillTimes(recording, event) {
  if (!event) return [0, 0.25, 0.5, 0.75, 1].map((share) => share * recording.endS);
  const times = [-4, -2.5, -1.5, -0.5, 0].map((before) => Math.max(0, event.at_s + before));
  const rise = recording.rise();
  if (!rise) return times;
  const apart = times.slice(0, -1).map((timeS) => Math.abs(timeS - rise.at_s));
  times[apart.indexOf(Math.min(...apart))] = rise.at_s;
  return times.sort((one, other) => one - other);
}

/**
 * Brings the ego vehicle and the road user of the event into a view.
 * @param {View} view
 * @param {Recording} recording
 * @param {number} timeS
 * @param {Event | null} event
 */
export function frame(view, recording, timeS, event) {
  const ego = recording.ego(timeS);
  const partner = event && recording.obstacles(timeS).find((body) => body.id === event.obstacle);
  const reach = partner ? Math.hypot(partner.x - ego.x, partner.y - ego.y) : 20;
  const half = Math.min(Math.max(reach * 0.75, 11), 40);
  view.zoomed = (view.canvas.element.clientWidth || 200) / (2 * half);
  view.shift = partner && reach < 55 ? { x: (partner.x - ego.x) / 2, y: (partner.y - ego.y) / 2 } : { x: 0, y: 0 };
}

/**
 * Fills an element with the stills; `seek` opens a moment, `peek` shows one while the pointer is on its still.
 * @param {HTMLElement} place
 * @param {Recording} recording
 * @param {any} road
 * @param {(timeS: number) => void} seek
 * @param {(timeS: number | null) => void} peek
 */
export function drawStrip(place, recording, road, seek, peek) {
  const event = recording.event();
  const [times, rise] = [stillTimes(recording, event), recording.rise()];
  const views = [];
  const stills = times.map((timeS, i) => {
    const canvas = el("canvas", { "aria-hidden": "true" });
    const isLast = i === times.length - 1 && event;
    const share = timeS === rise?.at_s ? ` · from here in ${inHundred(rise)}` : "";
    const caption = `${atTime(timeS)}${isLast ? ` · ${event.what}` : share}`;
    const view = new View(canvas, recording, road, STILL_LAYERS);
    views.push([view, timeS]);
    return el(
      "button",
      {
        type: "button",
        class: "still",
        onclick: () => seek(timeS),
        onpointerenter: (pointer) => pointer.pointerType === "mouse" && peek(timeS),
        onpointerleave: (pointer) => pointer.pointerType === "mouse" && peek(null),
        "aria-label": `Go to ${caption}`,
      },
      canvas,
      el("span", {}, caption),
    );
  });
  refill(place, stills);
  return () => {
    for (const [view, timeS] of views) {
      frame(view, recording, timeS, event);
      view.repaint();
      view.draw(timeS);
    }
  };
}
