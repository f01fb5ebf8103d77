// Play, step, speed, loop, and the bar of time with the lung's volume behind it.
import { button, el } from "./dom.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2];
const SVG = "http://www.w3.org/2000/svg";

export class TimeBar {
  constructor(viewer) {
    const { clock } = viewer;
    this.viewer = viewer;
    this.playButton = button("▶", "Play", () => viewer.toggle(), { className: "play" });
    this.slider = el("input", {
      type: "range", min: 0, max: clock.duration, step: "any", value: 0, className: "time", "aria-label": "Time",
      oninput: () => viewer.seek(Number(this.slider.value)),
    });
    this.speed = el("select", {
      "aria-label": "Speed", title: "Speed", onchange: () => clock.setSpeed(Number(this.speed.value)),
    }, ...SPEEDS.map((s) => el("option", { value: s, selected: s === 1 }, `${s} ×`)));
    this.loop = el("input", { type: "checkbox", checked: clock.loop, onchange: () => { clock.loop = this.loop.checked; } });
    this.told = el("output", { className: "told", "aria-live": "off" });
    const whole = button("full", "Whole screen", () => viewer.wholeScreen());
    this.node = el("div", { className: "timebar" },
      this.playButton, button("◀", "One frame back (←)", () => viewer.step(-1)),
      button("▶|", "One frame on (→)", () => viewer.step(1), { className: "forth" }),
      this.track = el("div", { className: "track" }, this.curve(), this.slider),
      this.speed, el("label", { className: "loop" }, this.loop, " loop"), whole, this.told);
  }

  // The lung's volume of every torso on one scale.
  curve() {
    const svg = document.createElementNS(SVG, "svg");
    svg.setAttribute("viewBox", "0 0 1000 100");
    svg.setAttribute("preserveAspectRatio", "none");
    svg.setAttribute("aria-hidden", "true");
    const drawn = this.viewer.shown.filter((f) => f.told.series.length);
    const values = drawn.flatMap((f) => f.told.series[0].values);
    const low = Math.min(...values), high = Math.max(...values);
    for (const figure of drawn) {
      const time = figure.times(), path = document.createElementNS(SVG, "path");
      const places = figure.told.series[0].values.map((v, k) => {
        const x = (1000 * time[k]) / figure.pace / (this.viewer.clock.duration || 1), y = 94 - (88 * (v - low)) / (high - low || 1);
        return `${x.toFixed(1)} ${y.toFixed(1)}`;
      });
      path.setAttribute("d", `M${places.join("L")}`);
      if (svg.children.length) path.setAttribute("stroke-dasharray", "4 3");
      svg.append(path);
    }
    return svg;
  }

  // Another run of another length is shown.
  renew() {
    this.slider.max = this.viewer.clock.duration;
    this.track.firstChild.replaceWith(this.curve());
  }

  show(time, playing, told) {
    this.slider.value = time;
    this.playButton.textContent = playing ? "❚❚" : "▶";
    this.playButton.setAttribute("aria-label", playing ? "Pause" : "Play");
    this.speed.value = this.viewer.clock.speed;
    this.told.textContent = told;
  }
}
