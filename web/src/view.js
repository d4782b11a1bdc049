// The 3-D view with its controls: motion, pose and what is looked at are one state.
import * as THREE from "three";
import { motionsOf } from "./data.js";
import { nameUnderPointer } from "./hover.js";
import { Panes } from "./panes.js";
import { across, placeOf, placeOfPart } from "./places.js";
import { Player } from "./player.js";
import { linkPlots, moveCursors } from "./plots.js";
import { Stage } from "./stage.js";
import { factsOf, nearestSample, sentence, thinnedOut, valueAt } from "./words.js";

const byId = (id) => document.getElementById(id);
const AXES = { x: new THREE.Vector3(1, 0, 0), y: new THREE.Vector3(0, 1, 0), z: new THREE.Vector3(0, 0, 1) };

export async function startView(result) {
  const view = new View(result);
  await view.start();
  window.borecheckView = view;
}

class View {
  constructor(result) {
    this.result = result;
    this.motions = motionsOf(result);
    Object.assign(this, { motion: 0, pose: 0, dispute: null, lit: 0, place: null, direction: null });
    const surfaces = [...(result.robot.parts ?? []), ...(result.scene.obstacles ?? [])];
    this.stage = new Stage(result.display, new Map(surfaces.map((s) => [s.name, s.closed])));
  }

  async start() {
    await this.stage.load();
    const worst = this.worstMotion();
    await this.stage.ready(worst);
    // From here on nothing waits until the eyes stand: the first frame is whole.
    this.panes = new Panes(byId("canvas-holder"), this.stage, (pane) => this.cutFor(pane));
    this.player = new Player(byId("play"), (start) => this.step(start));
    this.show(worst, null);
    // Eyes stand across from the robot's base, so that it does not hide the place.
    const middle = this.stage.bounds(this.stage.robot).getCenter(new THREE.Vector3());
    this.near = middle.y <= this.place.at.y ? 1 : -1;
    this.ahead = middle.x <= this.place.at.x ? -1 : 1;
    this.frameAll(false);
    this.listParts();
    this.listen();
    linkPlots(
      (motion, share) => this.choose(motion, nearestSample(this.motions[motion], share)),
      (motion, share) => valueAt(this.motions[motion], share),
    );
    thinnedOut(this.result.display, byId("thinned"));
  }

  // The motion that decides: contact before unknown before clear, then the narrowest.
  worstMotion() {
    const rank = { contact: 0, unknown: 1, clear: 2 };
    const badness = (m) => {
      const pose = m.poses[m.worst];
      return [rank[m.plan?.verdict ?? pose.verdict] ?? 1, pose.clearance_m ?? -1];
    };
    let best = 0;
    this.motions.forEach((m, k) => {
      const [a, b] = [badness(m), badness(this.motions[best])];
      if (a[0] < b[0] || (a[0] === b[0] && a[1] < b[1])) best = k;
    });
    return best;
  }

  listen() {
    const on = (id, kind, act) => byId(id)?.addEventListener(kind, act);
    const draw = () => this.panes.draw();
    on("motion", "change", (e) => this.choose(Number(e.target.value), null));
    on("slider", "input", (e) => { this.player.stop(); this.show(this.motion, Number(e.target.value)); });
    for (const id of ["cut", "cut-axis", "cut-at"]) on(id, "input", draw);
    on("opacity", "input", (e) => { this.stage.setOpacity(Number(e.target.value)); draw(); });
    for (const id of ["show-contacts", "show-closest", "show-plan", "only-pair"]) on(id, "input", () => this.mark());
    on("show-frames", "input", (e) => { this.stage.frames.visible = e.target.checked; draw(); });
    for (const button of document.querySelectorAll("button[data-view]")) {
      button.addEventListener("click", () => this.look(button.dataset.view));
    }
    for (const row of document.querySelectorAll("tr[data-fly]")) {
      row.addEventListener("click", () => this.follow(row));
    }
    nameUnderPointer(this.panes, this.stage, (pane, part, event) => this.tellOf(pane, part, event));
  }

  listParts() {
    for (const part of this.stage.parts) {
      const label = document.createElement("label");
      const box = document.createElement("input");
      box.type = "checkbox";
      box.checked = true;
      box.addEventListener("input", () => { part.mesh.visible = box.checked; this.panes.draw(); });
      label.append(box, ` ${part.name} (${part.role})`);
      byId("parts").append(label);
    }
  }

  show(motion, pose) {
    const another = motion !== this.motion;
    this.motion = motion;
    const { poses, worst } = this.motions[motion];
    this.pose = Math.min(pose ?? worst, poses.length - 1);
    this.dispute = null;
    this.lit = 0;
    if (byId("motion")) byId("motion").value = String(motion);
    byId("slider").max = String(poses.length - 1);
    byId("slider").value = String(this.pose);
    byId("along").hidden = byId("play").hidden = poses.length < 2;
    this.stage.setPose(motion, this.pose);
    this.mark();
    if (this.near && !another) this.aim();
  }

  step(start) {
    const { poses } = this.motions[this.motion];
    if (start) {
      if (this.pose >= poses.length - 1) this.show(this.motion, 0);
      return poses.length;
    }
    if (this.pose < poses.length - 1) this.show(this.motion, this.pose + 1);
    return this.pose < poses.length - 1;
  }

  // Another motion, or another pose of this one; eyes turn to what is new only.
  async choose(motion, pose) {
    this.player.stop();
    const another = motion !== this.motion;
    await this.stage.ready(motion);
    this.show(motion, pose);
    if (another) this.frameAll();
  }

  // Contacts, closest points and plan of the pose, and what is said of it.
  mark() {
    const motion = this.motions[this.motion];
    const pose = motion.poses[this.pose];
    const pairs = this.pairs();
    const { plan } = motion;
    this.stage.clearPairs();
    if (pairs && byId("show-contacts").checked) this.stage.addPairs(pairs);
    const alone = this.dispute !== null && byId("only-pair")?.checked;
    this.stage.robot.visible = this.stage.around.visible = !alone;
    this.place = placeOf(pose, pairs, plan?.entry ? plan : null, this.stage, this.lit);
    this.panes.facts = factsOf(this, pose, pairs, {
      plan: byId("show-plan").checked && plan?.entry ? plan : null,
      marked: byId(pairs ? "show-contacts" : "show-closest").checked,
    });
    sentence(byId("instant"), motion, this.pose, pose);
    moveCursors(this.motion, motion.fractions?.[this.pose]);
    this.panes.draw();
  }

  pairs() {
    if (this.dispute !== null) return this.result.disagreements[this.dispute].corners.flat(3);
    const found = this.stage.lit[this.motion].get(this.pose);
    if (found) return [...found.array];
    if (!this.result.disagreements) return null;
    const here = this.result.disagreements.filter((d) => d.pose === this.pose);
    return here.length ? here.slice(0, 300).flatMap((d) => d.corners.flat(3)) : null;
  }

  // Every pane looks where the motion's narrowest place is.
  frameAll(fly = true) {
    for (const name of ["cut", "bore", "side"]) this.look(name, fly, false);
    this.direction = across(this.place.axis, this.ahead, this.near);
    this.panes.named.narrow.eye.look(this.direction, this.place.at, this.place.frame / 2, fly);
  }

  // The pane of the narrowest place goes with it.
  aim() {
    this.panes.named.narrow.eye.follow(this.place.at, this.place.frame / 2);
  }

  // A named view, in the pane that has it; others in the first pane.
  look(name, fly = true, enlarged = true) {
    const pane = this.panes.named[name] ?? this.panes.named.cut;
    if (name === "four") { this.panes.enlarge(null); return; }
    if (enlarged) this.panes.enlarge(pane);
    if (name === "narrow") { pane.eye.look(this.direction, this.place.at, this.place.frame / 2, fly); return; }
    const robot = this.stage.bounds(this.stage.robot);
    const radius = Math.min(0.8, Math.max(0.12, 0.3 * robot.getSize(new THREE.Vector3()).length()));
    const centre = this.place.at.clone().lerp(robot.getCenter(new THREE.Vector3()), 0.2);
    if (name === "bore") centre.set(this.place.at.x, 0.5 * this.place.at.y, 0.5 * this.place.at.z);
    const direction = {
      bore: [this.ahead, 0, -0.02], side: [0, -this.near, -0.02], top: [0.001, 0, -1], operator: [0.75, -this.near, -0.28],
    }[name] ?? [0.8, -1.25 * this.near, -0.55];
    const far = { bore: 0.75, operator: 2, top: 1.4 }[name] ?? 0.9;
    pane.eye.look(new THREE.Vector3(...direction).normalize(), centre, far * radius, fly);
  }

  // What a pane leaves out, so that the place can be seen.
  cutFor(pane) {
    const { stage, place } = this;
    if (pane.name === "narrow") {
      const towards = pane.eye.camera.position.clone().sub(place.at).normalize();
      stage.cut("robot", towards, place.at.clone().addScaledVector(towards, 0.6 * place.frame));
      for (const kind of ["housing", "rest"]) {
        stage.cut(kind, towards, place.at.clone().addScaledVector(towards, 0.06 * place.frame));
      }
    } else if (byId("cut").checked && pane.name === "bore") {
      const before = place.at.clone().setX(place.at.x - 0.02 * this.ahead);
      for (const kind of ["housing", "rest"]) stage.cut(kind, new THREE.Vector3(-this.ahead, 0, 0), before);
    } else if (byId("cut").checked) {
      const axis = byId("cut-axis").value;
      const side = { x: -this.ahead, y: this.near, z: 1 }[axis];
      const point = AXES[axis].clone().multiplyScalar(Number(byId("cut-at").value));
      stage.cut("housing", AXES[axis].clone().multiplyScalar(side), point);
    }
  }

  // A row of a table was chosen: go to its pose and look at its place.
  async follow(row) {
    this.player.stop();
    const { fly, motion, pose, lit, part, dispute } = row.dataset;
    for (const chosen of document.querySelectorAll("tr.chosen")) chosen.classList.remove("chosen");
    row.classList.add("chosen");
    await this.stage.ready(Number(motion));
    this.show(Number(motion), Number(pose));
    if (fly === "dispute") this.dispute = Number(dispute);
    if (fly === "lit") this.lit = Number(lit);
    this.mark();
    const { closest } = this.motions[this.motion].poses[this.pose];
    if (fly === "part" && closest?.link !== part) this.place = placeOfPart(this.stage, part);
    this.frameAll();
    byId("view").scrollIntoView({ block: "nearest" });
  }

  // The name of what the pointer is on, and its clearance where that is known.
  tellOf(pane, part, event) {
    const note = byId("hover");
    note.hidden = part === null;
    if (part === null) return;
    const clearance = this.motions[this.motion].poses[this.pose].link_clearance?.[part.name];
    note.textContent = `${part.name} (${part.role})` +
      (clearance === undefined ? "" : `: ${(1e3 * clearance).toFixed(1)} mm to the nearest obstacle`);
    const box = byId("canvas-holder").getBoundingClientRect();
    const x = Math.min(event.clientX - box.left + 14, box.width - note.offsetWidth - 4);
    note.style.transform = `translate(${x}px, ${event.clientY - box.top + 18}px)`;
  }
}
