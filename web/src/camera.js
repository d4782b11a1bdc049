// The eye: orbit by pointer and keys, named views, and flights to a place.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

// Direction of looking; x runs along the bore, z up.
const VIEWS = {
  oblique: [0.8, -1.25, -0.55],
  front: [1, 0, -0.02],
  bore: [-1, 0, -0.02],
  side: [0, -1, -0.02],
  top: [0.001, 0, -1],
};

export class Eye {
  constructor(element, changed) {
    this.camera = new THREE.PerspectiveCamera(32, 1, 0.005, 60);
    this.camera.up.set(0, 0, 1);
    this.changed = changed;
    this.controls = new OrbitControls(this.camera, element);
    this.controls.addEventListener("change", changed);
    this.controls.addEventListener("start", () => { this.flight = null; });
    this.still = matchMedia("(prefers-reduced-motion: reduce)");
    element.addEventListener("keydown", (event) => this.key(event));
  }

  // Looks along a named direction, so that a sphere fills the picture.
  // Views from aside come from the side `near` (1 or -1 on the y axis).
  look(view, centre, radius, near, fly = true) {
    const direction = new THREE.Vector3(...(VIEWS[view] ?? VIEWS.oblique)).normalize();
    direction.y *= near;
    this.lookAlong(direction, centre, radius, fly);
    this.home = { direction, centre: centre.clone(), radius };
  }

  lookAlong(direction, centre, radius, fly = true) {
    const fit = Math.min(1, this.camera.aspect);
    const distance = radius / Math.sin(THREE.MathUtils.degToRad(this.camera.fov / 2)) / fit;
    const goal = centre.clone().addScaledVector(direction, -distance);
    if (fly && !this.still.matches) {
      this.flight = {
        from: this.camera.position.clone(), to: goal, since: performance.now(),
        targetFrom: this.controls.target.clone(), targetTo: centre.clone(),
      };
    } else {
      this.camera.position.copy(goal);
      this.controls.target.copy(centre);
      this.controls.update();
    }
    this.changed();
  }

  // Flies to a place without turning more than needed.
  flyTo(centre, radius) {
    const direction = this.controls.target.clone().sub(this.camera.position).normalize();
    this.lookAlong(direction, centre, radius);
  }

  // True while a flight goes on.
  advance(now) {
    if (!this.flight) return false;
    const share = Math.min(1, (now - this.flight.since) / 600);
    const eased = share * share * (3 - 2 * share);
    this.camera.position.lerpVectors(this.flight.from, this.flight.to, eased);
    this.controls.target.lerpVectors(this.flight.targetFrom, this.flight.targetTo, eased);
    this.controls.update();
    if (share >= 1) this.flight = null;
    return share < 1;
  }

  key(event) {
    const turn = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const zoom = { "+": 0.85, "=": 0.85, "-": 1 / 0.85 }[event.key];
    if (!turn && !zoom && event.key !== "Home") return;
    event.preventDefault();
    this.flight = null;
    if (event.key === "Home") {
      if (this.home) this.lookAlong(this.home.direction, this.home.centre, this.home.radius);
      return;
    }
    const offset = this.camera.position.clone().sub(this.controls.target);
    if (zoom) offset.multiplyScalar(zoom);
    if (turn) {
      const polar = new THREE.Spherical().setFromVector3(new THREE.Vector3(offset.y, offset.z, offset.x));
      polar.theta += 0.08 * turn[0];
      polar.phi = Math.min(Math.PI - 0.05, Math.max(0.05, polar.phi + 0.08 * turn[1]));
      const turned = new THREE.Vector3().setFromSpherical(polar);
      offset.set(turned.z, turned.x, turned.y);
    }
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.changed();
  }
}
