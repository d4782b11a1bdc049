// The eye of a pane: orbit by pointer and keys, flights to a place.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

export class Eye {
  constructor(element, changed) {
    this.camera = new THREE.PerspectiveCamera(32, 1, 0.005, 60);
    this.camera.up.set(0, 0, 1);
    this.changed = changed;
    this.controls = new OrbitControls(this.camera, element);
    // The wheel belongs to the page until somebody has chosen this pane.
    this.controls.enableZoom = false;
    element.style.touchAction = "pan-y";
    element.addEventListener("focus", () => { this.controls.enableZoom = true; });
    element.addEventListener("blur", () => { this.controls.enableZoom = false; });
    this.controls.addEventListener("change", changed);
    this.controls.addEventListener("start", () => { this.flight = null; });
    this.still = matchMedia("(prefers-reduced-motion: reduce)");
    element.addEventListener("keydown", (event) => this.key(event));
  }

  // Looks along a direction so that a sphere fills the pane; Home comes back to it.
  look(direction, centre, radius, fly = true) {
    this.home = { direction: direction.clone(), centre: centre.clone(), radius };
    this.lookAlong(direction, centre, radius, fly);
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
      this.flight = null;
      this.camera.position.copy(goal);
      this.controls.target.copy(centre);
      this.controls.update();
    }
    this.changed();
  }

  // The same view of another place: as far away and as it was turned.
  follow(centre, radius) {
    const direction = this.controls.target.clone().sub(this.camera.position).normalize();
    this.home = { ...this.home, centre: centre.clone(), radius };
    this.lookAlong(direction, centre, radius, false);
  }

  // The pane has another shape: what was in view before comes into view again.
  reshape(aspect) {
    const fit = Math.min(1, aspect) / Math.min(1, this.camera.aspect);
    this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
    const { target } = this.controls;
    this.camera.position.sub(target).divideScalar(fit).add(target);
  }

  // True while a flight goes on.
  advance(now) {
    if (!this.flight) return false;
    const share = Math.min(1, (now - this.flight.since) / 600);
    const eased = share * share * (3 - 2 * share);
    this.camera.position.lerpVectors(this.flight.from, this.flight.to, eased);
    this.controls.target.lerpVectors(this.flight.targetFrom, this.flight.targetTo, eased);
    if (share >= 1) this.flight = null;
    this.controls.update();
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
