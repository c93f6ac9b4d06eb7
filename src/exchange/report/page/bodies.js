// Vehicles and people, what is believed of them, and the names beside them.
import { beside, corners } from "./paint.js";

/** Whether it walks: people and animals. */
export const isOnFoot = (body) => body.like === "Pedestrian" || body.like === "Animal";

/** A vehicle or person as it is: filled, with its heading, its speed and its brake lights. */
export function drawBody(canvas, body, { fill, line, dashed = false, alpha = 1 }) {
  const { context, colours } = canvas;
  context.globalAlpha = alpha;
  const thin = Math.max(0.07, canvas.px(1.2));
  if (isOnFoot(body)) {
    const radius = Math.max(0.35, canvas.px(4));
    canvas.dot(body, radius, fill);
    canvas.line([body, beside(body, radius * 2, 0)], line, thin);
    context.globalAlpha = 1;
    return;
  }
  const box = corners(body);
  canvas.area(box, fill);
  canvas.line([...box, box[0]], line, thin, dashed ? [0.5, 0.35] : []);
  // The windscreen shows which end is the front; a thing has none.
  const { length, width } = body;
  const screen = [
    beside(body, length * 0.18, width * 0.42),
    beside(body, length * 0.28, 0),
    beside(body, length * 0.18, -width * 0.42),
  ];
  if (body.like !== "Object") canvas.line(screen, line, thin);
  if (body.braking) {
    const size = Math.max(0.28, canvas.px(2.5));
    for (const side of [0.38, -0.38]) canvas.dot(beside(body, -length / 2, width * side), size, colours.brake);
  }
  const lamps = { Hazard: [1, -1], Left: [1], Right: [-1], Flash: [] }[body.lights] ?? [];
  const size = Math.max(0.22, canvas.px(2));
  for (const side of lamps) {
    for (const end of [0.46, -0.46]) canvas.dot(beside(body, length * end, width * side * 0.46), size, colours.warn);
  }
  if (body.lights === "Flash") {
    for (const side of [0.34, -0.34]) canvas.dot(beside(body, length / 2, width * side), size, colours.paper);
  }
  context.globalAlpha = 1;
}

/** An arrow for the way of the next second. */
export function drawSpeed(canvas, body, colour) {
  const way = body.speed;
  if (Math.abs(way) < 0.3) return;
  const front = (isOnFoot(body) ? 0.4 : body.length / 2) * Math.sign(way);
  const from = beside(body, front, 0);
  const tip = beside(body, front + way, 0);
  const thin = Math.max(0.1, canvas.px(1.5));
  canvas.line([from, tip], colour, thin);
  const size = Math.max(0.5, canvas.px(5)) * Math.sign(way);
  const pose = { ...tip, heading: body.heading };
  canvas.line([beside(pose, -size, size * 0.6), tip, beside(pose, -size, -size * 0.6)], colour, thin);
}

/** What the driving system believes: dashed, never filled, so that a missed or misplaced one is seen at a glance. */
export function drawTrack(canvas, track) {
  const { colours } = canvas;
  const line = Math.max(0.12, canvas.px(1.8));
  const box = corners(track);
  canvas.line([...box, box[0]], colours.perceived, line, [0.9, 0.6]);
  if (track.of === null) {
    // A ghost is crossed out: there is nothing.
    canvas.line([box[0], box[2]], colours.perceived, line);
    canvas.line([box[1], box[3]], colours.perceived, line);
  }
}

export function drawPrediction(canvas, track) {
  if (track.way.length === 0) return;
  canvas.line([track, ...track.way], canvas.colours.perceived, Math.max(0.1, canvas.px(1.2)), [0.4, 0.6]);
  for (const point of track.way) canvas.dot(point, Math.max(0.16, canvas.px(2)), canvas.colours.perceived);
}

export function drawPlan(canvas, plan) {
  canvas.line(plan, canvas.colours.planned, Math.max(0.3, canvas.px(3)));
  for (const point of plan.slice(1)) canvas.dot(point, Math.max(0.22, canvas.px(2.6)), canvas.colours.planned);
}

/** A cross where two met. */
export function drawImpact(canvas, { x, y }) {
  const arm = Math.max(0.9, canvas.px(9));
  for (const [colour, width] of [
    [canvas.colours.paper, 5],
    [canvas.colours.danger, 2.6],
  ]) {
    for (const side of [1, -1]) {
      canvas.line(
        [
          { x: x - arm, y: y - arm * side },
          { x: x + arm, y: y + arm * side },
        ],
        colour,
        canvas.px(width),
      );
    }
  }
}

/** Writes names beside their points: the first that comes has the choice, none lies on another. */
export class Labels {
  constructor(canvas) {
    this.canvas = canvas;
    this.taken = [];
    // The scale and the arrow to the north have their corners.
    this.taken.push({ left: 0, right: canvas.width / 5 + 26, top: canvas.height - 38, bottom: canvas.height });
    this.taken.push({ left: canvas.width - 38, right: canvas.width, top: canvas.height - 56, bottom: canvas.height });
    canvas.enterScreen();
    canvas.context.font = "600 12px system-ui, sans-serif";
    canvas.context.textAlign = "left";
    canvas.context.textBaseline = "middle";
  }

  /** Keeps a body free of names. */
  keep(body, radius) {
    // A long body is three boxes: at its ends and in its middle.
    const half = body.length && !isOnFoot(body) ? body.length / 2 : 0;
    for (const ahead of half > 0 ? [-half, 0, half] : [0]) {
      const { x, y } = this.canvas.at(half > 0 ? beside(body, ahead, 0) : body);
      this.taken.push({ left: x - radius, right: x + radius, top: y - radius, bottom: y + radius });
    }
  }

  write(point, text, away, colour) {
    const { context, colours } = this.canvas;
    const { x, y } = this.canvas.at(point);
    const width = context.measureText(text).width + 8;
    const around = (room) => [
      [room, -room],
      [room, room],
      [-room - width, -room],
      [-room - width, room],
      [-width / 2, -room - 12],
      [-width / 2, room + 12],
    ];
    const places = [1, 1.8, 2.8, 4].flatMap((far) => around((away + 6) * far));
    const boxes = places.map(([dx, dy]) => ({
      left: x + dx,
      right: x + dx + width,
      top: y + dy - 9,
      bottom: y + dy + 9,
    }));
    const isFree = (box) =>
      box.left >= 0 &&
      box.top >= 0 &&
      box.right <= this.canvas.width &&
      box.bottom <= this.canvas.height &&
      this.taken.every(
        (other) => box.right < other.left || box.left > other.right || box.bottom < other.top || box.top > other.bottom,
      );
    const box = boxes.find(isFree);
    // A name that fits nowhere is left out; the table below the view has all of them.
    if (!box) return;
    this.taken.push(box);
    context.strokeStyle = colour;
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(Math.min(Math.max(x, box.left), box.right), Math.min(Math.max(y, box.top), box.bottom));
    context.stroke();
    context.fillStyle = colours.paper;
    context.globalAlpha = 0.88;
    context.fillRect(box.left, box.top, width, 18);
    context.globalAlpha = 1;
    context.fillStyle = colours.ink;
    context.fillText(text, box.left + 4, box.top + 9.5);
  }
}
