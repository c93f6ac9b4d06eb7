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
  if (!("IntersectionObserver" in globalThis)) return;
  const observer = new IntersectionObserver((seen) => {
    for (const { target, isIntersecting } of seen) {
      if (!isIntersecting) continue;
      observer.unobserve(target);
      const canvas = /** @type {HTMLCanvasElement} */ (target);
      draw(canvas, entries[canvases.indexOf(canvas)]);
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
  const timeS = recorded.event()?.at_s ?? recorded.endS / 2;
  const view = new View(canvas, recorded, road, STILL_LAYERS);
  frame(view, recorded, timeS);
  view.draw(timeS);
}
