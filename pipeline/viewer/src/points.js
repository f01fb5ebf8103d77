// Bodies, points and curves of one trajectory at any time between its frames.
import { Matrix4, Quaternion, Vector3 } from "three";

export class Pose {
  constructor(told, store) {
    this.time = Float64Array.from(told.time);
    this.position = store.values(told.bodies.position);
    this.quaternion = store.values(told.bodies.quaternion);
    this.nBodies = told.bodies.position.shape[1];
    this.matrices = Array.from({ length: this.nBodies }, () => new Matrix4());
    const { body, local, free } = told.points;
    this.body = store.whole(body);
    this.local = store.values(local);
    this.mean = store.values(free.mean);
    this.nModes = free.scale.length;
    this.weights = store.values(free.weights);
    const shapes = store.whole(free.shapes), row = this.mean.length;
    this.shapes = new Float32Array(shapes.length);
    for (let i = 0; i < shapes.length; i++) this.shapes[i] = free.scale[Math.floor(i / row)] * shapes[i];
    this.points = new Float32Array(this.local.length + this.mean.length);
    this.a = new Quaternion();
    this.b = new Quaternion();
    this.at = new Vector3();
    this.one = new Vector3(1, 1, 1);
    this.frame = 0;
    this.share = 0;
  }

  get duration() {
    return this.time[this.time.length - 1];
  }

  // Frame before a time, and how far the time is on the way to the next.
  locate(time) {
    const n = this.time.length;
    let low = 0, high = n - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.time[middle] <= time) low = middle; else high = middle;
    }
    const gap = n > 1 ? this.time[high] - this.time[low] : 1;
    this.frame = n > 1 ? low : 0;
    this.share = n > 1 ? Math.min(Math.max((time - this.time[low]) / gap, 0), 1) : 0;
    this.next = Math.min(this.frame + 1, n - 1);
  }

  mix(values, width, i) {
    const x = values[this.frame * width + i];
    return x + this.share * (values[this.next * width + i] - x);
  }

  update(time) {
    this.locate(time);
    this.moveBodies();
    this.movePoints();
  }

  moveBodies() {
    const n = this.nBodies;
    for (let k = 0; k < n; k++) {
      const q = 4 * (this.frame * n + k), r = 4 * (this.next * n + k);
      const [w, x, y, z] = this.quaternion.subarray(q, q + 4);
      const [w2, x2, y2, z2] = this.quaternion.subarray(r, r + 4);
      this.a.set(x, y, z, w);
      this.b.set(x2, y2, z2, w2);
      this.a.slerp(this.b, this.share).normalize();
      this.at.set(...[0, 1, 2].map((c) => this.mix(this.position, 3 * n, 3 * k + c)));
      this.matrices[k].compose(this.at, this.a, this.one);
    }
  }

  movePoints() {
    const { points, local, mean, body } = this, riding = body.length;
    for (let p = 0; p < riding; p++) {
      const m = this.matrices[body[p]].elements, i = 3 * p;
      const x = local[i], y = local[i + 1], z = local[i + 2];
      points[i] = m[0] * x + m[4] * y + m[8] * z + m[12];
      points[i + 1] = m[1] * x + m[5] * y + m[9] * z + m[13];
      points[i + 2] = m[2] * x + m[6] * y + m[10] * z + m[14];
    }
    const free = points.subarray(3 * riding), row = mean.length;
    free.set(mean);
    for (let k = 0; k < this.nModes; k++) {
      const w = this.mix(this.weights, this.nModes, k), start = k * row;
      for (let i = 0; i < row; i++) free[i] += w * this.shapes[start + i];
    }
  }
}
