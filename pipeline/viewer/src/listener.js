// A sound and the cursor in the plots, where there is no torso to be seen.
import { Plots } from "./plots.js";

export function follow(sound) {
  const start = Number(sound.dataset.start || 0);
  const plots = new Plots((time) => { sound.currentTime = Math.max(0, time - start); });
  const show = () => {
    plots.show(start + sound.currentTime);
    if (!sound.paused) requestAnimationFrame(show);
  };
  for (const name of ["play", "pause", "seeking"]) sound.addEventListener(name, show);
  show();
}
