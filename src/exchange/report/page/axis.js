// Where times stand beside each other: one axis for all rows of a plot.

/** Seconds between labels, of which the least is taken that leaves them room. */
const STRIDES_S = [1, 2, 5, 10, 20, 50, 100, 200];

/** Room that a label needs, px. */
const LABEL_PX = 46;

export class TimeAxis {
  /**
   * @param {number} endS
   * @param {number} width px
   * @param {number} left px that are kept free at the left, and at the `right`
   * @param {number} right
   */
  constructor(endS, width, left, right) {
    this.endS = endS;
    this.left = left;
    this.right = width - right;
  }

  /** @param {number} timeS */
  xOf(timeS) {
    return this.left + (timeS / this.endS) * (this.right - this.left);
  }

  /**
   * The time under a place, which may be beside the axis.
   * @param {number} x
   */
  timeAt(x) {
    const share = (x - this.left) / (this.right - this.left);
    return Math.min(Math.max(share, 0), 1) * this.endS;
  }

  /** Times with labels, s. */
  labels() {
    const pxPerS = (this.right - this.left) / this.endS;
    const stride = STRIDES_S.find((strideS) => strideS * pxPerS > LABEL_PX) ?? STRIDES_S[STRIDES_S.length - 1];
    return Array.from({ length: Math.floor(this.endS / stride) + 1 }, (_, i) => i * stride);
  }
}
