// Links the plots to the view: a click in a plot moves the robot, the cursor follows it, and
// the pointer reads the value of the nearest sample.

export function linkPlots(chosen, valueAt) {
  for (const plot of document.querySelectorAll("svg[data-plot]")) {
    const motion = Number(plot.dataset.plot);
    const share = (event) => {
      const box = plot.getBoundingClientRect();
      const x = ((event.clientX - box.left) / box.width) * plot.viewBox.baseVal.width;
      const [left, right] = ends(plot);
      return Math.min(1, Math.max(0, (x - left) / (right - left)));
    };
    plot.addEventListener("click", (event) => chosen(motion, share(event)));
    plot.addEventListener("pointermove", (event) => {
      if (event.buttons === 1) chosen(motion, share(event));
      else read(plot, valueAt(motion, share(event)));
    });
    plot.addEventListener("pointerleave", () => { plot.querySelector(".value").textContent = ""; });
  }
}

// Left and right end of the axis in the plot's own units.
const ends = (plot) => [Number(plot.dataset.left), Number(plot.dataset.right)];

function read(plot, { fraction, words }) {
  const [left, right] = ends(plot);
  const text = plot.querySelector(".value");
  text.textContent = words;
  text.setAttribute("x", left + fraction * (right - left));
  text.setAttribute("text-anchor", fraction > 0.5 ? "end" : "start");
}

export function moveCursors(motion, fraction) {
  for (const line of document.querySelectorAll(".plot .cursor")) {
    if (Number(line.dataset.motion) !== motion || fraction === undefined) continue;
    const [left, right] = ends(line.closest("svg"));
    const x = left + fraction * (right - left);
    line.setAttribute("x1", x);
    line.setAttribute("x2", x);
  }
}
