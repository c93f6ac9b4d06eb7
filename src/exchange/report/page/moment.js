// A scenario as it was at any time: places between ticks, road users, what was believed and planned.
import { index, unpacked } from "./decode.js";

/** @import { Branched, Changes, Column, Ego, Header, Obstacle, Places, Quantisation, Way } from "./data" */

/** @type {Map<string, Promise<Recording>>} */
const recordings = new Map();

/**
 * The recording of an element, read once.
 * @param {string} id
 */
export function recording(id) {
  const known = recordings.get(id) ?? unpacked(id).then((data) => new Recording(data, index().quantisation));
  recordings.set(id, known);
  return known;
}

/** @typedef {{ at_s: number, what: string, obstacle: number | null }} Event */
/** A road user that comes so near is an event, m. */
const NEAR_M = 10;
/** Ticks from one look for the nearest approach to the next. */
const NEAR_TICKS = 5;

export class Recording {
  /**
   * @param {{ header: Header, columns: Float64Array[] }} data
   * @param {Quantisation} quantisation
   */
  constructor({ header, columns }, { tick_s: tickS, perceived_s: lookS, thought_s: thoughtS }) {
    this.header = header;
    this.columns = columns;
    this.tickS = tickS;
    this.lookS = lookS;
    this.thoughtS = thoughtS;
    this.looksPerThought = Math.round(thoughtS / lookS);
    this.ticks = columns[header.ego.speed_mps].length - 1;
    this.endS = this.ticks * this.tickS;
    /** Where the points of each thought begin, of each track. */
    this.trackOffsets = header.tracks.map((track) => this.#offsets(columns[track.counts]));
    this.planOffsets = this.#offsets(columns[header.plans.counts]);
  }

  /** @param {Float64Array} counts */
  #offsets(counts) {
    const offsets = [0];
    for (const count of counts) offsets.push(offsets[offsets.length - 1] + count);
    return offsets;
  }

  /**
   * A column's value at a place between two of its values.
   * @param {Column} column
   * @param {number} at
   */
  between(column, at) {
    const values = this.columns[column];
    const low = Math.min(Math.max(Math.floor(at), 0), values.length - 1);
    const high = Math.min(low + 1, values.length - 1);
    return values[low] + (values[high] - values[low]) * Math.min(Math.max(at - low, 0), 1);
  }

  /**
   * A pose from its three columns.
   * @param {Places} places
   * @param {number} at
   */
  pose([x, y, heading], at) {
    return { x: this.between(x, at), y: this.between(y, at), heading: this.between(heading, at) };
  }

  /** @param {number} timeS */
  tickAt(timeS) {
    return Math.min(Math.max(timeS / this.tickS, 0), this.ticks);
  }

  /** @param {number} timeS */
  ego(timeS) {
    const { ego } = this.header;
    const at = this.tickAt(timeS);
    return {
      ...this.pose(ego.places, at),
      length: ego.length_m,
      width: ego.width_m,
      speed: this.between(ego.speed_mps, at),
      acceleration: this.between(ego.acceleration_mps2, at),
      steer: this.between(ego.steer_rad, at),
      throttle: this.between(ego.throttle_pct, at),
      brake: this.between(ego.brake_pct, at),
      braking: this.#brakes(ego, timeS),
      proc: this.between(ego.proc, at),
    };
  }

  /**
   * The road users that are there, without the ego vehicle.
   * @param {number} timeS
   */
  obstacles(timeS) {
    const found = [];
    for (const one of this.header.obstacles) {
      const at = this.tickAt(timeS) - one.from_tick;
      const last = this.columns[one.speed_mps].length - 1;
      // Between the last tick of one and the end of the episode it has left.
      if (at < 0 || at > last) continue;
      const { id, body, like, verb, ambient, length_m: length, width_m: width } = one;
      const speed = this.between(one.speed_mps, at);
      const braking = this.#brakes(one, timeS);
      const lights = this.latest(one.lights ?? [], this.tickAt(timeS))?.[1];
      found.push({
        id,
        body,
        like,
        verb,
        ambient,
        length,
        width,
        ...this.pose(one.places, at),
        speed,
        braking,
        lights,
      });
    }
    return found;
  }

  /**
   * @param {Ego | Obstacle} one
   * @param {number} timeS
   */
  #brakes({ brake_lights: lights }, timeS) {
    return this.latest(lights, this.tickAt(timeS))?.[1] ?? false;
  }

  /**
   * What the driving system believes to be there, as of its last look.
   * @param {number} timeS
   */
  tracks(timeS) {
    const look = Math.floor(timeS / this.lookS + 1e-6);
    const found = [];
    for (const [number, track] of this.header.tracks.entries()) {
      const at = look - track.from_look;
      if (at < 0 || at >= this.columns[track.speed_mps].length) continue;
      const [x, y] = track.places.map((column) => this.columns[column][at]);
      const thought = Math.floor(look / this.looksPerThought) - Math.ceil(track.from_look / this.looksPerThought);
      found.push({
        of: track.of,
        length: track.length_m,
        width: track.width_m,
        x,
        y,
        heading: this.columns[track.places[2]][at],
        speed: this.columns[track.speed_mps][at],
        way: this.#points(track.predicted_m, this.trackOffsets[number], thought).map((point) => ({
          x: x + point.x,
          y: y + point.y,
        })),
      });
    }
    return found;
  }

  /** @param {number} timeS */
  plan(timeS) {
    const { x_m: x, y_m: y } = this.header.plans;
    return this.#points([x, y], this.planOffsets, Math.floor(timeS / this.thoughtS + 1e-6));
  }

  /**
   * @param {[Column, Column]} columns
   * @param {number[]} offsets
   * @param {number} number
   */
  #points([x, y], offsets, number) {
    if (number < 0 || number + 1 >= offsets.length) return [];
    const points = [];
    for (let i = offsets[number]; i < offsets[number + 1]; i += 1) {
      points.push({ x: this.columns[x][i], y: this.columns[y][i] });
    }
    return points;
  }

  /**
   * Where a reference driver is; `null` before it takes over and after its end.
   * @param {Way} way
   * @param {number} timeS
   */
  driver(way, timeS) {
    if (way.from_s === null || way.from_s === undefined) return null;
    const at = (timeS - way.from_s) / way.every_s;
    const last = this.columns[way.speed_mps].length - 1;
    if (at < 0 || at > last) return null;
    const { length_m: length, width_m: width } = this.header.ego;
    return { ...this.pose(way.places, at), speed: this.between(way.speed_mps, at), length, width };
  }

  /**
   * All places of a reference driver.
   * @param {Way} way
   */
  wayOf(way) {
    const [x, y] = way.places.map((column) => this.columns[column]);
    return Array.from(x, (value, i) => ({ x: value, y: y[i] }));
  }

  /**
   * The latest entry of a list of `[from, …]` at a time or tick.
   * @template {[number, ...unknown[]]} Entry
   * @param {Entry[]} list
   * @param {number} at
   */
  latest(list, at) {
    /** @type {Entry | null} */
    let found = null;
    for (const entry of list) {
      if (entry[0] > at + 1e-6) break;
      found = entry;
    }
    return found;
  }

  /** @param {number} timeS */
  held(timeS) {
    // At a tick, what is said at its beginning drives to the next one.
    return this.latest(this.header.held, timeS)?.[1] ?? "";
  }

  /** @param {number} timeS */
  sky(timeS) {
    return this.latest(this.header.skies, timeS)?.[1] ?? "";
  }

  /**
   * @param {number} number
   * @param {number} timeS
   */
  signal(number, timeS) {
    return this.latest(this.header.signals[number] ?? [], this.tickAt(timeS))?.[1] ?? null;
  }

  /**
   * Number of the step at a time.
   * @param {number} timeS
   */
  step(timeS) {
    const { steps } = this.header;
    let found = 0;
    for (let i = 0; i < steps.length; i += 1) if (steps[i].at_s <= timeS + 1e-6) found = i;
    return found;
  }

  /**
   * Where the ego vehicle and another met.
   * @param {{ x_m: number, y_m: number }} collision
   */
  impact({ x_m: x, y_m: y }) {
    return { x, y };
  }

  collision() {
    const { collisions } = this.header;
    return collisions.find((one) => one.counted) ?? collisions[0] ?? null;
  }

  /**
   * The event that a replay is opened for: the collision; else a breach; else the nearest approach; else the beginning
   * of a manoeuvre; else the first action.
   * @returns {Event | null}
   */
  event() {
    const collision = this.collision();
    if (collision) return { at_s: collision.at_s, what: "contact", obstacle: collision.obstacle };
    const [breach] = this.header.summary.breaches;
    if (breach) return { at_s: breach.at_s, what: `breach of ${breach.requirement}`, obstacle: breach.obstacle };
    const { failure, duration_s: endS } = this.header.summary;
    if (failure) return { at_s: endS, what: "the driving system fails", obstacle: null };
    const nearest = this.nearest();
    if (nearest && nearest.distance_m <= NEAR_M) {
      return { at_s: nearest.at_s, what: "nearest approach", obstacle: nearest.obstacle };
    }
    const begins = this.header.obstacles.flatMap(({ id, phases }) => (phases ?? []).map(([atS]) => ({ atS, id })));
    const [first] = begins.sort((a, b) => a.atS - b.atS);
    if (first) return { at_s: first.atS, what: "a manoeuvre begins", obstacle: first.id };
    const done = this.header.steps.find(({ outcome }) => outcome.kind === "done");
    return done ? { at_s: done.at_s, what: "first action", obstacle: null } : null;
  }

  /**
   * The finding of its event, if the file claims how the chance of it rose.
   * @returns {{ at_s: number, moments: Branched[] } | null}
   */
  chances() {
    const found = this.collision() ?? this.header.summary.breaches[0];
    return found && found.moments.length > 0 ? found : null;
  }

  /**
   * The first moment from which on its finding was likely, and before which it was not.
   * @returns {Branched | null}
   */
  rise() {
    const moments = this.chances()?.moments ?? [];
    const rise = moments.findIndex((moment) => moment.is_likely);
    return rise > 0 ? moments[rise] : null;
  }

  /**
   * Where another road user comes nearest, by the distance of the middles less half of both lengths; those that actions
   * spawned go before ordinary traffic.
   * @returns {{ at_s: number, distance_m: number, obstacle: number } | null}
   */
  nearest() {
    const { ego, obstacles } = this.header;
    const spawned = obstacles.filter((one) => !one.ambient);
    const [egoX, egoY] = ego.places.map((column) => this.columns[column]);
    /** @type {{ at_s: number, distance_m: number, obstacle: number } | null} */
    let found = null;
    for (const one of spawned.length > 0 ? spawned : obstacles) {
      const [x, y] = one.places.map((column) => this.columns[column]);
      const halves = (ego.length_m + one.length_m) / 2;
      for (let at = 0; at < x.length && one.from_tick + at < egoX.length; at += NEAR_TICKS) {
        const tick = one.from_tick + at;
        const distance_m = Math.hypot(x[at] - egoX[tick], y[at] - egoY[tick]) - halves;
        if (!found || distance_m < found.distance_m) {
          found = { at_s: tick * this.tickS, distance_m, obstacle: one.id };
        }
      }
    }
    return found;
  }
}
