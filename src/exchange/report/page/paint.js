// A canvas in world coordinates: metres, y north. Sharp on every screen.
import { styled } from "./dom.js";

/** Colours of the style sheet, read anew when the scheme changes. */
export function palette() {
  const names = [
    "ground",
    "road",
    "junction",
    "lane-line",
    "edge",
    "oncoming",
    "walkway",
    "solid",
    "crosswalk",
    "ego",
    "ego-line",
    "ink",
    "paper",
    "truth",
    "truth-line",
    "pedestrian",
    "perceived",
    "planned",
    "ghost",
    "route",
    "danger",
    "warn",
    "good",
    "brake",
    "muted",
    "driver",
    "grid",
    "accent",
  ];
  return Object.fromEntries(
    names.map((name) => [name.replace(/-(\w)/g, (_, letter) => letter.toUpperCase()), styled(`--${name}`)]),
  );
}

/**
 * The ground of the reason lane.
 * @param {import("./data").Restraint} restraint
 * @param {Record<string, string>} colours
 */
export function restraintColour(restraint, colours) {
  const [colour, share] = {
    hard: [colours.danger, 45],
    stops: [colours.warn, 40],
    follows: [colours.accent, 28],
    free: [colours.muted, 18],
  }[restraint];
  return `color-mix(in srgb, ${colour} ${share}%, ${colours.paper})`;
}

/**
 * What draws on an element.
 * @param {HTMLCanvasElement} element
 */
export function contextOf(element) {
  const context = element.getContext("2d");
  if (!context) throw new Error("this browser does not draw");
  return context;
}

export class Canvas {
  /** @param {HTMLCanvasElement} element */
  constructor(element) {
    this.element = element;
    this.context = contextOf(element);
    this.width = 0;
    this.height = 0;
    this.ratio = 1;
    this.camera = { x: 0, y: 0, pxPerM: 6, turn: 0 };
    this.colours = palette();
  }

  /** Fits the pixels to the element's size; gives whether there is anything to draw on. */
  fit() {
    const { clientWidth: width, clientHeight: height } = this.element;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (this.element.width !== wide || this.element.height !== high) {
      this.element.width = wide;
      this.element.height = high;
    }
    this.width = width;
    this.height = height;
    this.ratio = ratio;
    return width > 0 && height > 0;
  }

  /** From here on, coordinates are metres. */
  enterWorld() {
    const { context, camera, ratio } = this;
    const scale = camera.pxPerM * ratio;
    context.setTransform(1, 0, 0, 1, (this.width / 2) * ratio, (this.height / 2) * ratio);
    context.scale(scale, -scale);
    context.rotate(camera.turn);
    context.translate(-camera.x, -camera.y);
  }

  /** From here on, coordinates are pixels of the page. */
  enterScreen() {
    this.context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
  }

  /** Pixel of a point. */
  at({ x, y }) {
    const { camera } = this;
    const [dx, dy] = [x - camera.x, y - camera.y];
    const [cos, sin] = [Math.cos(camera.turn), Math.sin(camera.turn)];
    return {
      x: this.width / 2 + (dx * cos - dy * sin) * camera.pxPerM,
      y: this.height / 2 - (dx * sin + dy * cos) * camera.pxPerM,
    };
  }

  px(pixels) {
    return pixels / this.camera.pxPerM;
  }

  line(points, colour, width, dash = []) {
    if (points.length < 2) return;
    const { context } = this;
    context.beginPath();
    points.forEach((point, i) => (i === 0 ? context.moveTo(point.x, point.y) : context.lineTo(point.x, point.y)));
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.setLineDash(dash);
    context.stroke();
    context.setLineDash([]);
  }

  area(points, fill, stroke = null, width = 0) {
    const { context } = this;
    context.beginPath();
    points.forEach((point, i) => (i === 0 ? context.moveTo(point.x, point.y) : context.lineTo(point.x, point.y)));
    context.closePath();
    if (fill) {
      context.fillStyle = fill;
      context.fill();
    }
    if (stroke) {
      context.strokeStyle = stroke;
      context.lineWidth = width;
      context.stroke();
    }
  }

  dot({ x, y }, radius, fill) {
    const { context } = this;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fillStyle = fill;
    context.fill();
  }
}

/** Corners of a box, front left first. */
export function corners({ x, y, heading, length, width }) {
  const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
  const at = (ahead, left) => ({ x: x + ahead * cos - left * sin, y: y + ahead * sin + left * cos });
  const [l, w] = [length / 2, width / 2];
  return [at(l, w), at(l, -w), at(-l, -w), at(-l, w)];
}

/** A point ahead and to the left of a pose. */
export function beside({ x, y, heading }, ahead, left) {
  const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
  return { x: x + ahead * cos - left * sin, y: y + ahead * sin + left * cos };
}
