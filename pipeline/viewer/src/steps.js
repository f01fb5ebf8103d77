// Steps of a retraining: which one is shown, and a pace to breathe with.
import { button, el } from "./dom.js";

const SVG = "http://www.w3.org/2000/svg";
const LEAST = 26, MOST = 46;

function svg(tag, attributes = {}, ...children) {
  const made = document.createElementNS(SVG, tag);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

// Out of the breath: the way in, 0 to 1, and how long the phase still lasts.
export function phase(step, time) {
  const t = ((time % step.period) + step.period) % step.period, inward = t < step.inspiration;
  const out = step.period - step.inspiration;
  const share = inward ? t / step.inspiration : 1 - (t - step.inspiration) / out;
  const left = inward ? step.inspiration - t : step.period - t;
  return { inward, left, size: 0.5 - 0.5 * Math.cos(Math.PI * share) };
}

export class Steps {
  constructor(root, steps, owner) {
    Object.assign(this, { steps, owner, chosen: 0, said: "" });
    this.still = window.matchMedia("(prefers-reduced-motion: reduce)");
    this.buttons = steps.map((step, k) => button(step.name, `Show ${step.name}`, () => this.choose(k), { className: "choice" }));
    this.play = button("Breathe with me", "Breathe with me", () => owner.toggle(), { className: "go" });
    this.circle = svg("circle", { cx: 50, cy: 50, r: LEAST, class: "lung" });
    this.word = svg("text", { x: 50, y: 50, class: "word" });
    this.count = svg("text", { x: 50, y: 60, class: "count" });
    const ring = svg("circle", { cx: 50, cy: 50, r: MOST, class: "ring" });
    const picture = svg("svg", { viewBox: "0 0 100 100", "aria-hidden": "true" }, ring, this.circle, this.word, this.count);
    // heard, not seen: a new phase, and only while it runs
    this.live = el("p", { className: "heard", role: "status", "aria-live": "polite" });
    this.told = el("p", { className: "pace" });
    this.beside = el("input", { type: "checkbox", onchange: () => this.choose(this.chosen) });
    root.append(
      el("div", { className: "row", role: "group", "aria-label": "Step" }, ...this.buttons),
      el("div", { className: "breathe" }, picture, el("div", {}, this.play, this.told,
        el("label", {}, this.beside, " my own breath beside it, at the same pace"), this.live)));
    root.classList.add("live");
  }

  get step() {
    return this.steps[this.chosen];
  }

  choose(k) {
    this.chosen = k;
    this.buttons.forEach((one, i) => one.setAttribute("aria-pressed", String(i === k)));
    const { period, inspiration } = this.step, rate = 60 / period;
    this.told.textContent = `${rate.toFixed(1)} breaths a minute: ${inspiration.toFixed(1)} s in, ${(period - inspiration).toFixed(1)} s out`;
    this.owner.chose(k, this.beside.checked && k > 0);
  }

  show(time, playing) {
    const { inward, left, size } = phase(this.step, time), word = inward ? "in" : "out";
    // who asked for less motion gets words and numbers alone
    this.circle.setAttribute("r", this.still.matches ? LEAST : LEAST + (MOST - LEAST) * size);
    this.word.textContent = playing ? word : "";
    this.count.textContent = playing ? Math.ceil(left) : "";
    this.play.textContent = playing ? "Stop" : "Breathe with me";
    this.play.setAttribute("aria-label", this.play.textContent);
    const seconds = Math.round(left);
    const said = playing ? `Breathe ${word}, ${seconds} second${seconds === 1 ? "" : "s"}` : "";
    if (playing !== this.wasPlaying || word !== this.lastWord) this.live.textContent = said;
    Object.assign(this, { wasPlaying: playing, lastWord: word });
  }
}
