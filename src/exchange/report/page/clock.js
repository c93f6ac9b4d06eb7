// The clock of a replay: one time for all views and plots.

export const RATES = [0.1, 0.25, 0.5, 1, 2, 4, 8];

export class Clock {
  /**
   * The frame that is due while it plays, and `null` while it does not.
   * @type {number | null}
   */
  #frame = null;

  /**
   * @param {number} endS
   * @param {number} tickS
   * @param {(timeS: number) => void} changed is called with each new time.
   */
  constructor(endS, tickS, changed) {
    this.endS = endS;
    this.tickS = tickS;
    this.changed = changed;
    this.timeS = 0;
    this.rate = 1;
  }

  get playing() {
    return this.#frame !== null;
  }

  /** @param {number} timeS */
  seek(timeS) {
    this.timeS = Math.min(Math.max(timeS, 0), this.endS);
    this.changed(this.timeS);
  }

  /**
   * Goes some ticks on or back, onto a tick.
   * @param {number} count
   */
  ticks(count) {
    this.pause();
    const at = this.timeS / this.tickS;
    const now = count > 0 ? Math.floor(at + 1e-6) : Math.ceil(at - 1e-6);
    this.seek((now + count) * this.tickS);
  }

  play() {
    if (this.playing) return;
    if (this.timeS >= this.endS - 1e-6) this.timeS = 0;
    let before = performance.now();
    const frame = (/** @type {number} */ now) => {
      const next = this.timeS + ((now - before) / 1000) * this.rate;
      before = now;
      if (next >= this.endS) this.stop();
      else this.#frame = requestAnimationFrame(frame);
      this.seek(next);
    };
    this.#frame = requestAnimationFrame(frame);
    this.changed(this.timeS);
  }

  /** Stops without calling `changed`. The due frame is cancelled, or a new `play` would run beside it. */
  stop() {
    if (this.#frame !== null) cancelAnimationFrame(this.#frame);
    this.#frame = null;
  }

  pause() {
    this.stop();
    this.changed(this.timeS);
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  /**
   * The next slower or faster rate.
   * @param {number} by
   */
  faster(by) {
    const at = RATES.indexOf(this.rate) + by;
    this.rate = RATES[Math.min(Math.max(at, 0), RATES.length - 1)];
    this.changed(this.timeS);
  }
}
