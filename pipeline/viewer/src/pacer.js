// The steps and their pace where there is no torso to be seen.
import { Clock } from "./clock.js";
import { Plots } from "./plots.js";
import { Steps } from "./steps.js";

export class Pacer {
  constructor(root, told) {
    this.clock = new Clock(told.duration, { loop: true });
    this.plots = new Plots((time) => { this.clock.seek(time); this.show(); });
    this.steps = new Steps(root, told.steps, this);
    this.steps.choose(told.steps.length - 1);
  }

  chose() {
    this.clock.duration = this.steps.step.period;
    this.clock.seek(0);
    this.show();
  }

  toggle() {
    if (this.clock.playing) { this.clock.pause(); this.show(); return; }
    this.clock.play();
    let last = performance.now();
    const tick = (now) => {
      this.clock.advance((now - last) / 1000);
      last = now;
      this.show();
      if (this.clock.playing) requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  show() {
    this.steps.show(this.clock.time, this.clock.playing);
    this.plots.show(this.clock.time);
  }
}
