// Presets, layers, markers and cameras beside the picture.
import { button, el } from "./dom.js";
import { RAMP } from "./figure.js";
import { CAMERAS } from "./stage.js";

const FACTORS = [1, 2, 5, 10, 20], SEEN_MM = 16;

export class Panel {
  constructor(viewer) {
    this.viewer = viewer;
    this.sliders = {};
    this.node = el("div", { className: "panel" }, this.presets(), this.layers(), this.cameras());
    const figure = viewer.figures[0];
    if (figure.measured) this.node.append(this.errors());
    if (figure.muscles) this.node.append(this.legend(figure.muscles), this.groups(figure.muscles));
    this.node.append(this.facts());
  }

  part(title, ...children) {
    return el("fieldset", {}, el("legend", {}, title), ...children);
  }

  presets() {
    const names = Object.keys(this.viewer.rows[0].presets);
    this.presetButtons = names.map((name) =>
      button(name, `Show ${name}`, () => this.viewer.preset(name), { className: "choice" }));
    return this.part("Look at", el("div", { className: "row" }, ...this.presetButtons));
  }

  layers() {
    const rows = this.viewer.rows.filter((row) => this.viewer.figures.some((f) => f.has(row)));
    const lines = rows.map((row) => {
      const slider = el("input", {
        type: "range", min: 0, max: 100, step: 1, "aria-label": `Opacity of ${row.label}`,
        oninput: () => { this.marked(null); this.viewer.setOpacity(row.layer, slider.value / 100); },
      });
      slider.dataset.layer = row.layer;
      this.sliders[row.layer] = slider;
      const swatch = el("span", { className: row.kind === "muscles" ? "swatch ramp" : "swatch" });
      swatch.style.background = row.kind === "muscles" ? `linear-gradient(90deg, ${RAMP.join(",")})` : row.colour;
      return el("label", { className: "layer" }, swatch, el("span", {}, row.label), slider);
    });
    return this.part("Layers, opacity", ...lines);
  }

  cameras() {
    const buttons = Object.keys(CAMERAS).map((name, k) =>
      button(name, `Look from the ${name} (key ${k + 1})`, () => this.viewer.look(name), { className: "choice" }));
    return this.part("From", el("div", { className: "row" }, ...buttons));
  }

  errors() {
    const { viewer } = this;
    const factor = el("select", {
      "aria-label": "Enlarge errors", onchange: () => viewer.each((f) => { f.factor = Number(factor.value); }),
    }, ...FACTORS.map((k) => el("option", { value: k }, `${k} ×`)));
    // so large that a usual error can be seen
    const usual = viewer.figures[0].meanError() || 1;
    factor.value = FACTORS.filter((k) => k * usual <= SEEN_MM).pop() || 1;
    viewer.each((f) => { f.factor = Number(factor.value); });
    const centred = el("input", {
      type: "checkbox", checked: true, onchange: () => viewer.each((f) => { f.centred = centred.checked; }),
    });
    const names = el("input", { type: "checkbox", onchange: () => viewer.showNames(names.checked) });
    return this.part("Markers",
      el("p", { className: "key-line" }, el("i", { className: "ball" }), "simulated ", el("i", { className: "stone" }),
        "measured ", el("i", { className: "arrow" }), "error"),
      el("label", {}, "errors drawn ", factor),
      el("label", {}, centred, " mean offset of each marker left out, as in the error table"),
      el("label", {}, names, " names"));
  }

  legend(muscles) {
    const bar = el("span", { className: "bar" });
    bar.style.background = `linear-gradient(90deg, ${RAMP.join(",")})`;
    const ends = [0, 0.25, 1].map((share) => el("span", {}, `${(share * muscles.most).toPrecision(2)}`));
    ends[0].textContent = "0";
    return this.part("Tension of a fibre, N", bar, el("span", { className: "ticks" }, ...ends));
  }

  groups(muscles) {
    const boxes = muscles.groups.map((name) => {
      const box = el("input", {
        type: "checkbox", checked: true,
        onchange: () => this.viewer.each((f) => f.hiddenGroups[box.checked ? "delete" : "add"](name)),
      });
      return el("label", {}, box, ` ${name}`);
    });
    const all = (checked) => boxes.forEach((label) => {
      if (label.firstChild.checked !== checked) label.firstChild.click();
    });
    return el("details", {}, el("summary", {}, "Muscle groups"),
      el("div", { className: "row" }, button("all", "Show all groups", () => all(true)),
        button("none", "Hide all groups", () => all(false))), ...boxes);
  }

  facts() {
    const lines = this.viewer.told.facts.map((line) => el("p", {}, line));
    const keys = "Keys, with the picture in focus: space plays, ← → step, 1 to 5 choose where from, + − zoom.";
    return el("details", { className: "facts" }, el("summary", {}, "About this picture"), ...lines, el("p", {}, keys));
  }

  marked(name) {
    for (const one of this.presetButtons) one.setAttribute("aria-pressed", String(one.textContent === name));
  }

  show(layer, opacity) {
    if (this.sliders[layer]) this.sliders[layer].value = Math.round(100 * opacity);
  }
}
