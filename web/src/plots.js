// Links the plots to the view: a click in a plot moves the robot, the cursor follows it.

// Left and right end of the axis in the plot's own units: borecheck/report/figures.py.
const [LEFT, RIGHT] = [58, 746];

export function linkPlots(chosen) {
  for (const plot of document.querySelectorAll("svg[data-plot]")) {
    const at = (event) => {
      const box = plot.getBoundingClientRect();
      const x = ((event.clientX - box.left) / box.width) * plot.viewBox.baseVal.width;
      chosen(Number(plot.dataset.plot), Math.min(1, Math.max(0, (x - LEFT) / (RIGHT - LEFT))));
    };
    plot.addEventListener("click", at);
    plot.addEventListener("pointermove", (event) => { if (event.buttons === 1) at(event); });
  }
}

export function moveCursors(motion, fraction) {
  for (const line of document.querySelectorAll(".plot .cursor")) {
    if (Number(line.dataset.motion) !== motion || fraction === undefined) continue;
    const x = LEFT + fraction * (RIGHT - LEFT);
    line.setAttribute("x1", x);
    line.setAttribute("x2", x);
  }
}
