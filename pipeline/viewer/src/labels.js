// Words over the picture: names of markers, and of torsos side by side.
import { Vector3 } from "three";
import { el } from "./dom.js";

export class Labels {
  constructor(picture, stage) {
    Object.assign(this, { picture, stage });
    this.markers = el("div", { className: "names" });
    this.torsos = el("div", { className: "names titles" });
    picture.append(this.markers, this.torsos);
  }

  names(words) {
    this.markers.replaceChildren(...words.map((word) => el("span", {}, word)));
  }

  titles(words) {
    this.torsos.replaceChildren(...words.map((word) => el("span", {}, word)));
  }

  // Where a point of the scene is seen, in the picture's pixels, and how deep.
  seen(at) {
    const { clientWidth: width, clientHeight: height } = this.picture, { x, y, z } = at.project(this.stage.camera);
    return { x: (0.5 + x / 2) * width, y: (0.5 - y / 2) * height, z };
  }

  // `shown` torsos have titles, the markers are those of `lead`.
  place(shown, lead) {
    const { target } = this.stage.controls, at = new Vector3();
    [...this.torsos.children].forEach((label, k) => {
      const { x } = this.seen(at.copy(target).setX(0).setY(0).add(shown[k].group.position));
      label.style.transform = `translate(calc(${x}px - 50%), .3rem)`;
    });
    const { places, group } = lead;
    if (!places) return;
    const middle = this.seen(at.copy(target));
    [...this.markers.children].forEach((label, m) => {
      const { x, y, z } = this.seen(at.fromArray(places, 3 * m).add(group.position));
      // what lies behind the middle of the torso has no name
      label.hidden = z > middle.z;
      label.style.transform = `translate(${x + 7}px, ${y - 8}px)`;
    });
  }
}
