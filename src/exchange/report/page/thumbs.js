// Small pictures of scenarios at their events, drawn once they come into sight.
import { ground } from "./ground.js";
import { recording } from "./moment.js";
import { STILL_LAYERS, frame } from "./strip.js";
import { View } from "./view.js";

/** @import { Entry } from "./data" */

/**
 * Draws the canvas of each entry when it can be seen.
 * @param {HTMLCanvasElement[]} canvases
 * @param {Entry[]} entries in the same order
 */
export function drawWhenSeen(canvases, entries) {
  const entryOf = new Map(canvases.map((canvas, nth) => [canvas, entries[nth]]));
  const observer = new IntersectionObserver((seen) => {
    for (const { target, isIntersecting } of seen) {
      if (!isIntersecting) continue;
      observer.unobserve(target);
      const canvas = /** @type {HTMLCanvasElement} */ (target);
      const entry = entryOf.get(canvas);
      if (entry) draw(canvas, entry);
    }
  });
  canvases.forEach((canvas) => observer.observe(canvas));
}

/**
 * @param {HTMLCanvasElement} canvas
 * @param {Entry} entry
 */
async function draw(canvas, entry) {
  const [recorded, road] = await Promise.all([recording(`s${entry.n}`), ground(entry.ground)]);
  const event = recorded.event();
  const timeS = event?.at_s ?? recorded.endS / 2;
  const view = new View(canvas, recorded, road, STILL_LAYERS);
  frame(view, recorded, timeS, event);
  view.draw(timeS);
}
