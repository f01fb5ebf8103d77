// Reads what pipeline/packing.py wrote.
import { unzlibSync } from "three/addons/libs/fflate.module.js";

const TYPES = {
  uint8: Uint8Array, uint16: Uint16Array, int16: Int16Array,
};

export class Store {
  constructor(text) {
    const packed = Uint8Array.from(atob(text.trim()), (c) => c.charCodeAt(0));
    this.bytes = unzlibSync(packed);
  }

  // Whole numbers as they lie there; rows that are steps are summed up, with wrap-around.
  whole(place) {
    const count = place.shape.reduce((a, b) => a * b, 1);
    const view = new TYPES[place.type](this.bytes.buffer, this.bytes.byteOffset + place.at, count);
    if (!place.steps) return view;
    const out = view.slice(), row = count / Math.max(place.shape[0], 1);
    for (let i = row; i < count; i++) out[i] += out[i - row];
    return out;
  }

  // Numbers: low + scale * whole, one low and scale for each last axis.
  values(place) {
    const whole = this.whole(place), n = place.low.length, out = new Float32Array(whole.length);
    for (let i = 0; i < whole.length; i++) out[i] = place.low[i % n] + place.scale[i % n] * whole[i];
    return out;
  }
}

export function readScene() {
  const description = document.getElementById("scene-description");
  const data = document.getElementById("scene-data");
  if (!description || !data) return null;
  return { ...JSON.parse(description.textContent), store: new Store(data.textContent) };
}
