// What is written over a pane: the plan with entry and target, the closest pair or the
// contact with its leader line, names and millimetres. The same forms and colours as on
// still pictures: `page.css`.
import * as THREE from "three";

const NS = "http://www.w3.org/2000/svg";
const SHAPES = {
  clear: ["M12 1a11 11 0 1 0 .01 0z", "M6.5 12.5l4 4 7-8.5"],
  contact: ["M7.5 1h9L23 7.5v9L16.5 23h-9L1 16.5v-9z", "M7.5 7.5l9 9m0-9l-9 9"],
  unknown: ["M12 1L23.5 21.5H.5z", "M12 8.5v6m0 2.8v1.2"],
};
// How far a label stands from what it is about, in pixels.
const AWAY = 34;

export function drawMarks(pane, facts) {
  const { marks, eye, window: { clientWidth: width, clientHeight: height } } = pane;
  marks.setAttribute("viewBox", `0 0 ${width} ${height}`);
  marks.replaceChildren();
  const at = (point) => {
    const p = new THREE.Vector3(...point).project(eye.camera);
    return p.z > 1 ? null : [(p.x / 2 + 0.5) * width, (0.5 - p.y / 2) * height];
  };
  const sheet = { marks, width, height, taken: [] };
  if (facts.plan) drawPlan(sheet, at(facts.plan.entry), at(facts.plan.target));
  if (facts.ends) drawPair(sheet, facts, ...facts.ends.map(at), pane.name === "narrow");
  const spot = facts.spot && at(facts.spot);
  if (spot) drawChip(sheet, spot, facts, pane.name === "narrow" && facts.ends);
}

function drawPlan(sheet, entry, target) {
  if (!entry || !target) return;
  line(sheet, entry, target, "plan");
  add(sheet.marks, "circle", { class: "plan entry", cx: entry[0], cy: entry[1], r: 5 });
  const [x, y] = target;
  add(sheet.marks, "path", { class: "plan target", d: `M${x - 7} ${y}h14M${x} ${y - 7}v14` });
  const side = entry[0] > target[0] ? 1 : -1;
  write(sheet, "entry", [entry[0] + 9 * side, entry[1] - 6], side, "plan");
  write(sheet, "target", [x - 9 * side, y + 14], -side, "plan");
}

function drawPair(sheet, facts, a, b, named) {
  if (!a || !b) return;
  line(sheet, a, b, `pair ${facts.verdict}`);
  for (const [x, y] of [a, b]) add(sheet.marks, "circle", { class: `pair ${facts.verdict}`, cx: x, cy: y, r: 3.5 });
  if (!named) return;
  // Names stand aside of the line, where nothing is written yet.
  const length = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1;
  const aside = [(a[1] - b[1]) / length, (b[0] - a[0]) / length];
  const turn = aside[0] < 0 ? -1 : 1;
  for (const [name, end, sign] of [[facts.names[0], a, -1], [facts.names[1], b, 1]]) {
    const tries = [turn, -turn].map((t) => [
      end[0] + 1.6 * AWAY * t * aside[0],
      end[1] + AWAY * t * aside[1] + sign * 0.4 * AWAY,
    ]);
    const free = tries.find((to) => !sheet.taken.some((t) => covers(t, to, to[0] < end[0] ? -60 : 60))) ?? tries[0];
    add(sheet.marks, "line", { class: "leader", x1: end[0], y1: end[1], x2: free[0], y2: free[1] - 4 });
    write(sheet, name, [free[0] + (free[0] < end[0] ? -3 : 3), free[1]], free[0] < end[0] ? -1 : 1, "part");
  }
}

const covers = (box, [x, y], wide) =>
  Math.max(x, x + wide) > box[0] && Math.min(x, x + wide) < box[2] && y + 4 > box[1] && y - 12 < box[3];

// The verdict's shape, colour and words, with a line to the place they are about.
function drawChip(sheet, spot, { long, short, verdict }, brief) {
  const { marks, width, height } = sheet;
  if (spot[0] < 0 || spot[1] < 0 || spot[0] > width || spot[1] > height) return;
  const leader = add(marks, "line", { class: `leader ${verdict}` });
  const chip = add(marks, "g", { class: `chip ${verdict}` });
  const ground = add(chip, "rect", { rx: 5, height: 24 });
  const shape = add(chip, "g", { class: "shape", transform: "translate(6 4) scale(0.667)" });
  SHAPES[verdict].forEach((d, k) => add(shape, "path", { d, class: k ? "stroke" : "fill" }));
  const text = add(chip, "text", { x: 27, y: 17 });
  text.textContent = brief ? short : long;
  if (text.getComputedTextLength() + 45 > width) text.textContent = short;
  const size = 35 + text.getComputedTextLength();
  ground.setAttribute("width", size);
  const [x, y] = placed(sheet, spot, size);
  chip.setAttribute("transform", `translate(${x} ${y})`);
  const end = [Math.min(Math.max(spot[0], x), x + size), Math.min(Math.max(spot[1], y), y + 24)];
  for (const [name, value] of Object.entries({ x1: spot[0], y1: spot[1], x2: end[0], y2: end[1] })) {
    leader.setAttribute(name, value);
  }
}

// Of the places around a spot the one in the pane that covers least of other labels.
function placed({ width, height, taken }, spot, size) {
  const tries = [];
  for (const away of [AWAY, 2.2 * AWAY]) {
    for (const [sx, sy] of [[1, -1], [-1, -1], [1, 1], [-1, 1]]) {
      const x = sx > 0 ? spot[0] + away * 0.6 : spot[0] - away * 0.6 - size;
      const y = sy > 0 ? spot[1] + away : spot[1] - away - 24;
      tries.push([Math.min(Math.max(x, 4), width - size - 4), Math.min(Math.max(y, 30), height - 28)]);
    }
  }
  const cost = ([x, y]) =>
    taken.filter((t) => x < t[2] && x + size > t[0] && y < t[3] && y + 24 > t[1]).length +
    (spot[0] > x - 6 && spot[0] < x + size + 6 && spot[1] > y - 6 && spot[1] < y + 30 ? 2 : 0);
  return tries.reduce((best, found) => (cost(found) < cost(best) ? found : best));
}

function line(sheet, a, b, kind) {
  const ends = { x1: a[0], y1: a[1], x2: b[0], y2: b[1] };
  add(sheet.marks, "line", { class: "halo", ...ends });
  add(sheet.marks, "line", { class: kind, ...ends });
}

function write(sheet, words, [x, y], side, kind) {
  const anchor = side < 0 ? "end" : "start";
  const text = add(sheet.marks, "text", { class: `name ${kind}`, x, y, "text-anchor": anchor });
  text.textContent = words;
  const length = text.getComputedTextLength();
  const left = side < 0 ? x - length : x;
  sheet.taken.push([left, y - 12, left + length, y + 4]);
}

function add(parent, name, attributes) {
  const element = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent.append(element);
  return element;
}
