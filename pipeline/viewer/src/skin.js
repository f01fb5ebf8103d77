// A skin bound to bodies and points: v = sum of w times where each of them alone would take it.
import { Matrix4, Quaternion, Vector3 } from "three";

const WHOLE = 65535, ROW = 12;

export class Skin {
  constructor(told, store) {
    this.rest = store.values(told.rest);
    this.count = store.whole(told.count);
    this.handle = store.whole(told.handle);
    this.weight = Float32Array.from(store.whole(told.weight), (w) => w / WHOLE);
    this.follow = store.whole(told.follow);
    this.start = store.values(told.start);
    this.length = this.count.length;
    const one = new Vector3(1, 1, 1);
    this.back = told.position.map((at, b) => {
      const [w, x, y, z] = told.quaternion[b];
      return new Matrix4().compose(new Vector3(...at), new Quaternion(x, y, z, w), one).invert();
    });
    this.moves = new Float64Array(ROW * (this.back.length + this.follow.length));
    this.now = new Matrix4();
  }

  // Rows of three by four: what each body and each point does since the rest.
  locate(pose) {
    const { moves, follow, start } = this, n = this.back.length;
    for (let b = 0; b < n; b++) {
      const m = this.now.multiplyMatrices(pose.matrices[b], this.back[b]).elements;
      for (let r = 0; r < 3; r++) for (let c = 0; c < 4; c++) moves[ROW * b + 4 * r + c] = m[4 * c + r];
    }
    for (let k = 0; k < follow.length; k++) {
      const at = ROW * (n + k);
      for (let r = 0; r < 3; r++) {
        moves[at + 5 * r] = 1;
        moves[at + 4 * r + 3] = pose.points[3 * follow[k] + r] - start[3 * k + r];
      }
    }
  }

  place(pose, out) {
    this.locate(pose);
    const { rest, count, handle, weight, moves } = this;
    for (let v = 0, e = 0; v < count.length; v++) {
      const i = 3 * v, x = rest[i], y = rest[i + 1], z = rest[i + 2];
      let a = 0, b = 0, c = 0;
      for (const end = e + count[v]; e < end; e++) {
        const w = weight[e], m = ROW * handle[e];
        a += w * (moves[m] * x + moves[m + 1] * y + moves[m + 2] * z + moves[m + 3]);
        b += w * (moves[m + 4] * x + moves[m + 5] * y + moves[m + 6] * z + moves[m + 7]);
        c += w * (moves[m + 8] * x + moves[m + 9] * y + moves[m + 10] * z + moves[m + 11]);
      }
      out[i] = a;
      out[i + 1] = b;
      out[i + 2] = c;
    }
  }
}
