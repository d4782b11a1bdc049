// The 3-D view with its controls: what is chosen is one state, drawn on demand.
import * as THREE from "three";
import { Eye } from "./camera.js";
import { motionsOf } from "./data.js";
import { linkPlots, moveCursors } from "./plots.js";
import { Stage } from "./stage.js";

const byId = (id) => document.getElementById(id);

export async function startView(result) {
  const view = new View(result);
  await view.start();
  window.borecheckView = view;
}

class View {
  constructor(result) {
    this.result = result;
    this.motions = motionsOf(result);
    this.motion = 0;
    this.pose = 0;
    this.dispute = null;
    this.frames = 0;
    this.holder = byId("canvas-holder");
    this.renderer = new THREE.WebGLRenderer({ antialias: true });
    this.renderer.localClippingEnabled = true;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.holder.append(this.renderer.domElement);
    this.stage = new Stage(result.display);
    this.eye = new Eye(this.holder, () => this.draw());
  }

  async start() {
    await this.stage.load();
    this.paint();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.paint());
    new ResizeObserver(() => this.resize()).observe(this.holder);
    this.resize();
    this.listParts();
    this.listen();
    linkPlots((motion, share) => this.showFraction(motion, share));
    this.told();
    this.show(this.worstMotion(), null);
    // The eye stands across from the robot's base, so that it does not hide the bore.
    const middle = this.stage.bounds(this.stage.robot).getCenter(new THREE.Vector3());
    this.near = middle.y < 0 ? 1 : -1;
    this.setSection();
    this.stage.setOpacity(Number(byId("opacity").value));
    this.overview("oblique", false);
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
    on("motion", "change", (e) => this.show(Number(e.target.value), null));
    on("slider", "input", (e) => { this.stop(); this.show(this.motion, Number(e.target.value)); });
    on("play", "click", () => (this.playing ? this.stop() : this.play()));
    for (const id of ["cut", "cut-axis", "cut-at"]) on(id, "input", () => this.setSection());
    on("opacity", "input", (e) => { this.stage.setOpacity(Number(e.target.value)); this.draw(); });
    for (const id of ["show-contacts", "show-closest", "show-plan", "only-pair"]) on(id, "input", () => this.mark());
    on("show-frames", "input", (e) => { this.stage.frames.visible = e.target.checked; this.draw(); });
    for (const button of document.querySelectorAll("button[data-view]")) {
      button.addEventListener("click", () => this.overview(button.dataset.view));
    }
    for (const row of document.querySelectorAll("tr[data-fly]")) {
      row.addEventListener("click", () => this.follow(row));
    }
  }

  listParts() {
    for (const part of this.stage.parts) {
      const label = document.createElement("label");
      const box = document.createElement("input");
      box.type = "checkbox";
      box.checked = true;
      box.addEventListener("input", () => { part.mesh.visible = box.checked; this.draw(); });
      label.append(box, ` ${part.name} (${part.role})`);
      byId("parts").append(label);
    }
  }

  told() {
    const thin = [...this.result.display.links, ...this.result.display.obstacles].filter(
      (block) => block.triangles < block.triangles_checked,
    );
    if (!thin.length) return;
    const list = thin.map((b) =>
      `${b.name}: ${b.triangles.toLocaleString("en")} of ${b.triangles_checked.toLocaleString("en")}` +
      (b.moved_m > 0 ? `, moved by at most ${(1e3 * b.moved_m).toFixed(1)} mm` : ""));
    byId("thinned").hidden = false;
    byId("thinned").textContent =
      `For display only, triangles were left out (${list.join("; ")}). Every check used all of them.`;
  }

  show(motion, pose) {
    this.motion = motion;
    const { poses, worst } = this.motions[motion];
    this.pose = Math.min(pose ?? worst, poses.length - 1);
    this.dispute = null;
    if (byId("motion")) byId("motion").value = String(motion);
    byId("slider").max = String(poses.length - 1);
    byId("slider").value = String(this.pose);
    byId("along").hidden = byId("play").hidden = poses.length < 2;
    this.stage.setPose(motion, this.pose);
    this.mark();
  }

  showFraction(motion, share) {
    const { fractions } = this.motions[motion];
    let nearest = 0;
    fractions.forEach((f, k) => { if (Math.abs(f - share) < Math.abs(fractions[nearest] - share)) nearest = k; });
    this.stop();
    this.show(motion, nearest);
  }

  // Contacts, closest points and plan of the pose, and the line that tells of it.
  mark() {
    const { stage } = this;
    const motion = this.motions[this.motion];
    const pose = motion.poses[this.pose];
    stage.clearMarks();
    const alone = this.dispute !== null && byId("only-pair")?.checked;
    stage.robot.visible = stage.around.visible = !alone;
    const pairs = this.pairs();
    if (byId("show-contacts").checked && pairs) stage.addPairs(pairs);
    const plan = motion.plan;
    if (plan?.entry && byId("show-plan").checked) stage.addSegment(plan.entry, plan.target, "plan");
    this.closest = pose.closest && pose.closest.distance > 0 ? pose.closest : null;
    if (!byId("show-closest").checked) this.closest = null;
    if (this.closest) stage.addSegment(this.closest.points[0], this.closest.points[1], "closest");
    this.tag(pose, pairs);
    byId("instant").textContent = this.sentence(motion, pose);
    moveCursors(this.motion, motion.fractions?.[this.pose]);
    this.draw();
  }

  // The label in the picture: the distance at the closest points, or contact.
  tag(pose, pairs) {
    const label = byId("distance");
    this.place = null;
    if (this.closest) {
      const [a, b] = this.closest.points.map((p) => new THREE.Vector3(...p));
      this.place = a.lerp(b, 0.5);
      label.textContent = `${(1e3 * this.closest.distance).toFixed(1)} mm`;
    } else if (pairs && byId("show-contacts").checked) {
      this.place = smaller(pairs, 0).getCenter(new THREE.Vector3());
      label.textContent = this.dispute === null && pose.verdict ? "contact" : "disputed";
    }
    label.classList.toggle("hit", !this.closest);
  }

  sentence(motion, pose) {
    const where = motion.fractions ? `${(100 * motion.fractions[this.pose]).toFixed(1)} %` : `pose ${this.pose}`;
    const count = `${this.pose + 1} of ${motion.poses.length}`;
    if (!pose.verdict) {
      const says = Object.entries(pose.verdicts ?? {}).map(([name, said]) => `${name}: ${said ? "contact" : "none"}`);
      return [`Pose ${this.pose} (${count})`, says.join(", ")].filter(Boolean).join(" – ");
    }
    if (!motion.fractions && motion.poses.length < 2) return `${pose.verdict}: ${pose.reason}`;
    return `${where} (sample ${count}) – ${pose.verdict}: ${pose.reason}`;
  }

  pairs() {
    if (this.dispute !== null) return this.result.disagreements[this.dispute].corners.flat(3);
    const found = this.stage.lit[this.motion].get(this.pose);
    if (found) return [...found.array];
    if (!this.result.disagreements) return null;
    const here = this.result.disagreements.filter((d) => d.pose === this.pose);
    return here.length ? here.slice(0, 300).flatMap((d) => d.corners.flat(3)) : null;
  }

  // A row of a table was chosen: go to its pose and look at its place.
  follow(row) {
    this.stop();
    const { fly, motion, pose, lit, part, dispute } = row.dataset;
    for (const chosen of document.querySelectorAll("tr.chosen")) chosen.classList.remove("chosen");
    row.classList.add("chosen");
    this.show(Number(motion), Number(pose));
    if (fly === "dispute") {
      this.dispute = Number(dispute);
      this.mark();
      this.flyToTriangles(this.pairs(), 0);
    } else if (fly === "lit" && this.pairs()) {
      this.flyToTriangles(this.pairs(), Number(lit));
    } else if (fly === "part") {
      const mesh = this.stage.parts.find((p) => p.name === part).mesh;
      const closest = this.motions[this.motion].poses[this.pose].closest;
      if (closest?.link === part) this.narrow();
      else this.flyToBox(mesh.geometry.boundingBox.clone().applyMatrix4(mesh.matrix));
    } else {
      this.narrow();
    }
    byId("view").scrollIntoView({ block: "nearest" });
  }

  // To the smaller triangle of a pair: the larger one may span a whole housing.
  flyToTriangles(array, pair) {
    this.flyToBox(smaller(array, pair));
  }

  flyToBox(box) {
    const radius = Math.max(0.03, 0.8 * box.getSize(new THREE.Vector3()).length());
    this.eye.flyTo(box.getCenter(new THREE.Vector3()), radius);
  }

  narrow() {
    const here = this.pairs();
    if (here) { this.flyToTriangles(here, 0); return; }
    const closest = this.motions[this.motion].poses[this.pose].closest;
    if (!closest) return;
    const [a, b] = closest.points.map((p) => new THREE.Vector3(...p));
    this.eye.flyTo(a.clone().lerp(b, 0.5), Math.max(0.12, 2.5 * a.distanceTo(b)));
  }

  overview(name, fly = true) {
    if (name === "narrow") { this.narrow(); return; }
    // The robot and what is near it; a scanner's housing may run out of the picture.
    const centre = this.stage.bounds(this.stage.robot).getCenter(new THREE.Vector3()).multiplyScalar(0.5);
    centre.z = 0.05;
    if (name === "bore") centre.set(0, 0, 0);
    this.setSection();
    this.eye.look(name, centre, name === "bore" ? 0.75 : 1.2, this.near, fly);
  }

  setSection() {
    const axis = byId("cut-axis").value;
    this.stage.setSection(axis, Number(byId("cut-at").value), byId("cut").checked, this.near);
    this.draw();
  }

  play() {
    const { poses } = this.motions[this.motion];
    if (this.pose >= poses.length - 1) this.show(this.motion, 0);
    byId("play").textContent = "Pause";
    byId("play").setAttribute("aria-pressed", "true");
    const wait = Math.min(300, Math.max(40, 4000 / poses.length));
    this.playing = setInterval(() => {
      if (this.pose >= poses.length - 1) this.stop();
      else this.show(this.motion, this.pose + 1);
    }, wait);
  }

  stop() {
    clearInterval(this.playing);
    this.playing = null;
    byId("play").textContent = "Play";
    byId("play").setAttribute("aria-pressed", "false");
  }

  paint() {
    const colour = getComputedStyle(document.documentElement).getPropertyValue("--stage").trim();
    this.renderer.setClearColor(new THREE.Color(colour));
    this.draw();
  }

  resize() {
    const { clientWidth, clientHeight } = this.holder;
    if (!clientWidth || !clientHeight) return;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.eye.camera.aspect = clientWidth / clientHeight;
    this.eye.camera.updateProjectionMatrix();
    this.draw();
  }

  draw() {
    if (this.waiting) return;
    this.waiting = requestAnimationFrame((now) => {
      this.waiting = null;
      const flying = this.eye.advance(now);
      this.renderer.render(this.stage.scene, this.eye.camera);
      this.placeLabel();
      if (this.frames === 0) document.documentElement.dataset.firstFrameMs = performance.now().toFixed(0);
      this.frames += 1;
      if (flying) this.draw();
    });
  }

  placeLabel() {
    const label = byId("distance");
    label.hidden = !this.place;
    if (!this.place) return;
    const at = this.place.clone().project(this.eye.camera);
    const x = (at.x / 2 + 0.5) * this.holder.clientWidth;
    const y = (0.5 - at.y / 2) * this.holder.clientHeight;
    label.style.transform = `translate(${Math.round(x + 12)}px, ${Math.round(y - 12)}px)`;
    label.hidden = at.z > 1 || x < 0 || y < 0 || x > this.holder.clientWidth - 60 || y > this.holder.clientHeight;
  }
}

// Box of the smaller triangle of a pair, in an array of 18 numbers a pair.
function smaller(array, pair) {
  const box = (start) => {
    const b = new THREE.Box3();
    for (let k = 0; k < 9; k += 3) b.expandByPoint(new THREE.Vector3().fromArray(array, start + k));
    return b;
  };
  const boxes = [box(18 * pair), box(18 * pair + 9)];
  const size = (b) => b.getSize(new THREE.Vector3()).length();
  return size(boxes[0]) < size(boxes[1]) ? boxes[0] : boxes[1];
}
