// Four eyes on one stage. One canvas lies under all panes; each has its part of it, its own
// cut, and its own marks over it. One pane can be enlarged.
import * as THREE from "three";
import { Eye } from "./camera.js";
import { drawMarks } from "./marks.js";

export class Panes {
  // `cutFor(pane)` sets the stage's planes before a pane is drawn.
  constructor(holder, stage, cutFor) {
    Object.assign(this, { holder, stage, cutFor, frames: 0, facts: null });
    this.renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    this.renderer.localClippingEnabled = true;
    this.renderer.autoClear = false;
    this.renderer.setScissorTest(true);
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    holder.prepend(this.renderer.domElement);
    this.grid = holder.querySelector(".panes");
    this.all = [...this.grid.children].map((element) => this.pane(element));
    this.named = Object.fromEntries(this.all.map((pane) => [pane.name, pane]));
    new ResizeObserver(() => this.resize()).observe(holder);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.paint());
    this.paint();
    this.resize();
  }

  pane(element) {
    const window = element.querySelector(".window");
    const pane = { name: element.dataset.pane, element, window, stale: true };
    pane.marks = element.querySelector(".marks");
    pane.eye = new Eye(window, () => this.draw(pane));
    element.querySelector("button").addEventListener("click", () => this.toggle(pane));
    window.addEventListener("pointerdown", (event) => { pane.pressed = [event.clientX, event.clientY]; });
    window.addEventListener("click", (event) => {
      const [x, y] = pane.pressed ?? [event.clientX, event.clientY];
      if (Math.hypot(event.clientX - x, event.clientY - y) < 4) this.toggle(pane);
      window.focus();
    });
    window.addEventListener("keydown", (event) => {
      if (event.key === "Enter") this.toggle(pane);
      else if (event.key === "Escape") this.enlarge(null);
    });
    return pane;
  }

  toggle(pane) {
    this.enlarge(pane === this.large ? null : pane);
  }

  enlarge(pane) {
    this.large = pane;
    this.grid.classList.toggle("has-large", pane !== null);
    for (const one of this.all) {
      const on = one === pane;
      one.element.classList.toggle("is-large", on);
      one.element.querySelector("button").setAttribute("aria-pressed", String(on));
    }
    this.resize();
  }

  resize() {
    const { clientWidth, clientHeight } = this.holder;
    if (!clientWidth || !clientHeight) return;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.renderer.setScissor(0, 0, clientWidth, clientHeight);
    this.renderer.clear();
    const outer = this.holder.getBoundingClientRect();
    for (const pane of this.all) {
      const box = pane.window.getBoundingClientRect();
      pane.box = { x: box.left - outer.left, y: outer.bottom - box.bottom, width: box.width, height: box.height };
      if (box.width && box.height) pane.eye.reshape(box.width / box.height);
    }
    this.draw();
  }

  paint() {
    const style = getComputedStyle(document.documentElement);
    this.renderer.setClearColor(new THREE.Color(style.getPropertyValue("--stage").trim()));
    this.draw();
  }

  // Draws one pane, or all, with the next frame of the screen.
  draw(pane = null) {
    for (const one of pane ? [pane] : this.all) one.stale = true;
    this.waiting ??= requestAnimationFrame((now) => this.frame(now));
  }

  frame(now) {
    this.waiting = null;
    let flying = false;
    for (const pane of this.all) {
      const still = pane.eye.flight === null || pane.eye.flight === undefined;
      if (still && !pane.stale) continue;
      flying = pane.eye.advance(now) || flying;
      this.render(pane);
      pane.stale = false;
    }
    if (this.frames === 0) document.documentElement.dataset.firstFrameMs = performance.now().toFixed(0);
    this.frames += 1;
    if (flying) this.waiting ??= requestAnimationFrame((again) => this.frame(again));
  }

  render(pane) {
    const { x, y, width, height } = pane.box ?? {};
    if (!width || !height) return;
    this.stage.whole();
    this.cutFor(pane);
    this.renderer.setViewport(x, y, width, height);
    this.renderer.setScissor(x, y, width, height);
    this.renderer.clear();
    this.renderer.render(this.stage.scene, pane.eye.camera);
    if (this.facts) drawMarks(pane, this.facts);
  }
}
