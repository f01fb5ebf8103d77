// The cursor in every plot of the page that has time along it; a click there goes to that time.
const SVG = "http://www.w3.org/2000/svg";

export class Plots {
  constructor(onseek) {
    this.cursors = [];
    for (const svg of document.querySelectorAll("svg[data-time-axes]")) {
      const axes = JSON.parse(svg.dataset.timeAxes);
      for (const [left, top, width, height, start, end] of axes) {
        const line = document.createElementNS(SVG, "line");
        line.setAttribute("class", "time-cursor");
        line.setAttribute("y1", top);
        line.setAttribute("y2", top + height);
        svg.append(line);
        this.cursors.push({ line, left, width, start, end });
      }
      svg.addEventListener("click", (event) => {
        const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
        const axis = axes.find(([l, t, w, h]) => at.x >= l && at.x <= l + w && at.y >= t && at.y <= t + h);
        if (axis) onseek(axis[4] + ((at.x - axis[0]) / axis[2]) * (axis[5] - axis[4]));
      });
    }
  }

  show(time) {
    for (const { line, left, width, start, end } of this.cursors) {
      const x = left + (width * (time - start)) / (end - start);
      line.setAttribute("x1", x);
      line.setAttribute("x2", x);
      line.style.visibility = time >= start && time <= end ? "visible" : "hidden";
    }
  }
}
