// The playhead: a line over every drawing that has a time axis, where the sound is now.
"use strict";
(() => {
  const sound = document.querySelector("audio[data-start]");
  if (!sound) return;
  const start = Number(sound.dataset.start);
  const heads = [];
  for (const figure of document.querySelectorAll("figure[data-from]")) {
    const card = figure.querySelector(".drawing");
    const axes = figure.querySelectorAll('g[id*="axes_"]');
    if (!card || !axes.length) continue;
    const line = document.createElement("div");
    line.className = "playhead";
    card.append(line);
    heads.push({
      card, line, frame: axes[0].querySelector("path"),
      from: Number(figure.dataset.from), to: Number(figure.dataset.to),
    });
    card.addEventListener("click", (event) => {
      const head = heads.find((one) => one.card === card);
      const box = head.frame.getBoundingClientRect();
      const share = (event.clientX - box.left) / box.width;
      const time = head.from + share * (head.to - head.from) - start;
      if (share >= 0 && share <= 1) sound.currentTime = Math.max(0, Math.min(time, sound.duration));
      draw();
    });
  }
  function draw() {
    for (const head of heads) {
      const share = (start + sound.currentTime - head.from) / (head.to - head.from);
      const box = head.frame.getBoundingClientRect();
      const card = head.card.getBoundingClientRect();
      head.line.style.left = `${box.left - card.left + head.card.scrollLeft + share * box.width}px`;
      head.line.hidden = share < 0 || share > 1;
    }
    if (!sound.paused) requestAnimationFrame(draw);
  }
  for (const name of ["play", "seeked", "timeupdate", "pause"]) sound.addEventListener(name, draw);
  addEventListener("resize", draw);
  draw();
})();
