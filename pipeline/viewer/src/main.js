// The viewer of a page: reads the scene that the page carries and plays it.
import { Vector3 } from "three";
import { Clock } from "./clock.js";
import { readScene } from "./data.js";
import { el } from "./dom.js";
import { Figure } from "./figure.js";
import { Labels } from "./labels.js";
import { follow } from "./listener.js";
import { Pacer } from "./pacer.js";
import { Panel } from "./panel.js";
import { Plots } from "./plots.js";
import { CAMERAS, Stage } from "./stage.js";
import { Steps } from "./steps.js";
import { TimeBar } from "./timebar.js";

const FIRST_PRESET = "skeleton", FIRST_CAMERA = "oblique", GAP = 0.76, LONGEST_WAIT = 0.25, KEPT_UPDATES = 500;

// A sound, if the page has one, begins with the clock and leads it.
const findSound = () => document.getElementById("scene-sound");

class Viewer {
  constructor(root, told) {
    this.root = root;
    this.told = told;
    this.rows = told.layers;
    this.canvas = el("canvas", { tabIndex: 0, "aria-label": "Torso in three dimensions; drag to turn" });
    this.picture = el("div", { className: "picture" }, this.canvas);
    this.stage = new Stage(this.canvas);
    this.labels = new Labels(this.picture, this.stage);
    this.built = [];
    this.opacity = {};
    const every = [...told.trajectories.keys()];
    this.shown = (told.steps ? every.slice(-1) : every).map((k) => this.figure(k));
    this.clock = new Clock(told.duration, {
      loop: told.loop, sound: findSound(), onchange: () => { if (this.bar) this.refresh(); },
    });
    this.labels.titles(this.titled());
    this.updates = [];
    this.build();
  }

  build() {
    this.panel = new Panel(this);
    this.bar = new TimeBar(this);
    this.plots = new Plots((time) => this.seek(time - this.start));
    this.root.append(this.picture, this.panel.node, this.bar.node);
    this.root.classList.add("live");
    this.canvas.addEventListener("keydown", (event) => this.key(event));
    this.stage.controls.addEventListener("change", () => { this.stale = true; });
    new ResizeObserver(() => this.resized()).observe(this.picture);
    this.stage.resize();
    this.preset(FIRST_PRESET);
    this.camera = FIRST_CAMERA;
    const pace = document.getElementById("pace");
    if (this.told.steps && pace) {
      this.steps = new Steps(pace, this.told.steps, this);
      this.steps.choose(this.told.steps.length - 1);
    } else this.look(FIRST_CAMERA);
    this.watch();
  }

  // A torso is built when it is first shown: a page of many opens as fast as a page of one.
  figure(k) {
    if (this.built[k]) return this.built[k];
    const made = new Figure(this.told.trajectories[k], this.rows, this.told.store), [other] = this.figures;
    if (other) Object.assign(made, { factor: other.factor, centred: other.centred, hiddenGroups: other.hiddenGroups });
    for (const [layer, opacity] of Object.entries(this.opacity)) made.setOpacity(layer, opacity);
    this.stage.scene.add(made.group);
    this.built[k] = made;
    return made;
  }

  get figures() {
    return this.built.filter(Boolean);
  }

  titled() {
    return this.shown.length > 1 || this.told.steps ? this.shown.map((figure) => figure.told.name) : [];
  }

  // A step by itself, or the first beside it, at the pace of the step.
  chose(k, beside) {
    const { steps } = this.told, { period } = steps[k], numbers = beside ? [0, k] : [k];
    this.shown = numbers.map((i) => this.figure(i));
    numbers.forEach((i, n) => { this.shown[n].pace = steps[i].period / period; });
    for (const figure of this.figures) figure.group.visible = this.shown.includes(figure);
    this.labels.titles(this.titled());
    this.clock.duration = period;
    this.clock.seek(0);
    this.bar.renew();
    this.look(this.camera);
  }

  // The one that the bar of time and the keys follow.
  get lead() {
    return this.told.steps ? this.shown.at(-1) : this.shown[0];
  }

  get start() {
    return this.told.start;
  }

  each(change) {
    this.figures.forEach(change);
    this.refresh();
  }

  setOpacity(layer, opacity) {
    this.opacity[layer] = opacity;
    for (const figure of this.figures) figure.setOpacity(layer, opacity);
    this.refresh();
  }

  preset(name) {
    for (const row of this.rows) {
      this.setOpacity(row.layer, row.presets[name]);
      this.panel.show(row.layer, row.presets[name]);
    }
    this.panel.marked(name);
  }

  look(name) {
    this.camera = name;
    const { box } = this.stage, { shown } = this, middle = (shown.length - 1) / 2;
    this.stage.look(name, (right) => {
      shown.forEach((f, k) => f.group.position.copy(right).multiplyScalar((k - middle) * GAP));
      for (const figure of shown) figure.update(this.clock.time);
      box.makeEmpty();
      for (const figure of shown) {
        figure.group.updateMatrixWorld(true);
        for (const [mesh] of figure.rigid) box.expandByObject(mesh);
        const at = new Vector3();
        for (const points of [figure.pose.points, ...figure.skins.map(([, skin]) => skin.rest)]) {
          for (let i = 0; i < points.length; i += 3) box.expandByPoint(at.fromArray(points, i).add(figure.group.position));
        }
      }
    });
    this.refresh();
  }

  seek(time) {
    this.clock.seek(time);
    this.refresh();
  }

  step(count) {
    this.clock.pause();
    const times = this.lead.times(), now = this.clock.time;
    const [before, after] = [times.filter((t) => t < now - 1e-6), times.filter((t) => t > now + 1e-6)];
    this.seek(count < 0 ? before.pop() ?? times.at(-1) : after[0] ?? times[0]);
  }

  toggle() {
    if (this.clock.playing) this.clock.pause(); else this.clock.play();
    this.refresh();
  }

  key(event) {
    const cameras = Object.keys(CAMERAS), number = Number(event.key);
    const actions = {
      " ": () => this.toggle(), ArrowLeft: () => this.step(-1), ArrowRight: () => this.step(1), Home: () => this.seek(0),
      "+": () => this.stage.zoom(0.9), "-": () => this.stage.zoom(1.1),
    };
    const action = actions[event.key] || (cameras[number - 1] && (() => this.look(cameras[number - 1])));
    if (!action) return;
    event.preventDefault();
    action();
  }

  wholeScreen() {
    if (document.fullscreenElement) document.exitFullscreen();
    else if (this.root.requestFullscreen) this.root.requestFullscreen();
  }

  showNames(shown) {
    this.labels.names(shown ? this.told.trajectories[0].markers.names : []);
    this.refresh();
  }

  refresh() {
    this.moved = true;
    this.stale = true;
  }

  resized() {
    this.stage.resize();
    this.look(this.camera);
    this.draw();
  }

  readings() {
    const words = [`${(this.start + this.clock.time).toFixed(2)} s`], several = this.titled().length > 0;
    for (const figure of this.shown) {
      const told = figure.told.series.slice(0, several ? 1 : undefined);
      if (several) words.push(figure.told.name);
      told.forEach((s, k) => words.push(`${s.name} ${figure.series(k).toFixed(s.digits)} ${s.unit}`));
    }
    const { lead } = this;
    if (lead.measured && this.panel.sliders.markers.value > 0) words.push(`error ${lead.error().toFixed(2)} mm`);
    return words.join(" · ");
  }

  // The torso, the bar and the plots at the clock's time.
  move() {
    const began = performance.now();
    for (const figure of this.shown) figure.update(this.clock.time);
    this.updates.push(performance.now() - began);
    if (this.updates.length > KEPT_UPDATES) this.updates.shift();
    this.bar.show(this.clock.time, this.clock.playing, this.readings());
    this.plots.show(this.start + this.clock.time);
    if (this.steps) this.steps.show(this.clock.time, this.clock.playing);
    this.moved = false;
  }

  draw() {
    if (this.moved) this.move();
    this.stage.render();
    this.labels.place(this.shown, this.lead);
    this.stale = false;
    if (this.firstPicture === undefined) this.firstPicture = performance.now();
  }

  // Draws while something changes and the picture can be seen.
  watch() {
    let last = performance.now(), seen = true;
    new IntersectionObserver((entries) => { seen = entries.at(-1).isIntersecting; }).observe(this.picture);
    const tick = (now) => {
      this.clock.advance(Math.min((now - last) / 1000, LONGEST_WAIT));
      last = now;
      if (this.clock.playing) this.refresh();
      if (seen && (this.moved || this.stale)) this.draw();
      else if (this.moved) { this.move(); this.stale = true; }
      requestAnimationFrame(tick);
    };
    this.draw();
    requestAnimationFrame(tick);
  }
}

function show(root, told) {
  try {
    window.pleuraViewer = new Viewer(root, told);
    return true;
  } catch (error) {
    root.replaceChildren();
    const word = document.getElementById("no-webgl");
    if (word) word.hidden = false;
    if (!/webgl/i.test(String(error))) throw error;
    return false;
  }
}

function start() {
  const root = document.getElementById("viewer"), told = root && readScene(), sound = findSound();
  if (told && show(root, told)) return;
  const pace = document.getElementById("pace");
  if (told?.steps && pace) window.pleuraPacer = new Pacer(pace, told);
  else if (sound) follow(sound);
}

// plots and sound may stand below the script
if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", start);
else start();
