// What stands in the view: meshes of robot and surroundings, triangles in contact, the
// needle's line, frames; and the planes that cut them. Knows nothing of panes or buttons.
import * as THREE from "three";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import { inflated, meshArrays } from "./data.js";
import { hatched } from "./hatching.js";

// A plane that cuts nothing.
const NOWHERE = 1e3;
// Pixels of the needle's line, and of the halo that parts it from what is behind.
const NEEDLE_PX = 3, HALO_PX = 6;

const styled = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

export class Stage {
  // `closed` tells of every surface by name whether it encloses a solid.
  constructor(display, closed) {
    this.scene = new THREE.Scene();
    this.display = display;
    this.closed = closed;
    this.robot = new THREE.Group();
    this.around = new THREE.Group();
    this.marks = new THREE.Group();
    this.frames = new THREE.Group();
    this.frames.visible = false;
    this.parts = [];
    // What is cut apart: housings, what one sees whole unless all is cut, the robot.
    this.planes = { housing: null, rest: null, robot: null };
    for (const kind of Object.keys(this.planes)) {
      this.planes[kind] = new THREE.Plane(new THREE.Vector3(0, 1, 0), NOWHERE);
    }
    this.scene.add(this.robot, this.around, this.marks, this.frames);
    this.lights();
  }

  lights() {
    const key = new THREE.DirectionalLight(0xffffff, 1.9);
    key.position.set(1.5, 2.5, 3.5);
    const fill = new THREE.DirectionalLight(0xffffff, 0.8);
    fill.position.set(-2.5, -2.5, 1);
    this.scene.add(key, fill, new THREE.HemisphereLight(0xffffff, 0x9aa4ae, 1.5));
  }

  async load() {
    const { links, obstacles, motions, frames, needle } = this.display;
    for (const block of links) {
      const mesh = await this.solid(block, block.link === needle ? "needle" : "robot", this.planes.robot);
      mesh.userData.frame = frames.indexOf(block.link);
      if (block.link === needle) this.needleLine(mesh);
      this.robot.add(mesh);
      this.parts.push({ name: block.name, role: "robot", mesh });
    }
    for (const block of obstacles) {
      const whole = block.role === "couch" || block.role === "patient";
      const mesh = await this.solid(block, block.role, whole ? this.planes.rest : this.planes.housing);
      this.around.add(mesh);
      this.parts.push({ name: block.name, role: block.role, mesh });
    }
    this.placements = [];
    this.lit = [];
    this.coming = motions.map(() => null);
    for (let k = 0; k < frames.length; k += 1) {
      const axes = new THREE.AxesHelper(0.08);
      axes.material.depthTest = false;
      axes.renderOrder = 8;
      axes.matrixAutoUpdate = false;
      this.frames.add(axes);
    }
  }

  // A motion's numbers are unpacked when it is shown first: a page may hold a thousand.
  ready(motion) {
    this.coming[motion] ??= this.unpack(motion);
    return this.coming[motion];
  }

  async unpack(motion) {
    const { placements, lit } = this.display.motions[motion];
    const byPose = new Map();
    for (const found of lit) {
      byPose.set(found.pose, { ...found, array: await inflated(found.corners, Float32Array) });
    }
    this.placements[motion] = await inflated(placements, Float32Array);
    this.lit[motion] = byPose;
  }

  // A mesh and its inside: where a plane opens a closed surface, the inside is hatched as
  // a cut through a solid is drawn. What lies within the solid stays visible before it.
  async solid(block, role, plane) {
    const { positions, indices } = await meshArrays(block);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
    geometry.setIndex(new THREE.BufferAttribute(indices, 1));
    geometry.computeBoundingBox();
    geometry.computeBoundingSphere();
    const closed = this.closed.get(block.name) ?? true;
    const colour = new THREE.Color(styled(`role-${role}`) || styled("role-other"));
    const clippingPlanes = [plane];
    const mesh = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({
      color: colour, flatShading: true, side: closed ? THREE.FrontSide : THREE.DoubleSide, clippingPlanes,
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
    }));
    if (closed) mesh.add(new THREE.Mesh(geometry, hatched(colour, clippingPlanes)));
    mesh.matrixAutoUpdate = false;
    return mesh;
  }

  // The needle is thinner than a pixel: a line along its longest side is never.
  needleLine(mesh) {
    const box = mesh.geometry.boundingBox;
    const [from, to] = [box.getCenter(new THREE.Vector3()), box.getCenter(new THREE.Vector3())];
    const size = box.getSize(new THREE.Vector3()).toArray();
    const longest = size.indexOf(Math.max(...size));
    from.setComponent(longest, box.min.getComponent(longest));
    to.setComponent(longest, box.max.getComponent(longest));
    const geometry = new LineSegmentsGeometry().setPositions([...from.toArray(), ...to.toArray()]);
    const line = (colour, linewidth, order) => {
      const material = new LineMaterial({ color: colour, linewidth, clippingPlanes: [this.planes.robot] });
      const made = new LineSegments2(geometry, material);
      made.renderOrder = order;
      made.raycast = () => {};
      return made;
    };
    mesh.add(line("#ffffff", HALO_PX, 1), line(styled("role-needle"), NEEDLE_PX, 2));
    mesh.children.at(-2).material.depthWrite = false;
  }

  setOpacity(opacity) {
    const solid = opacity >= 0.999;
    for (const { mesh, role } of this.parts) {
      if (role !== "scanner" && role !== "other") continue;
      Object.assign(mesh.material, { transparent: !solid, opacity, depthWrite: solid, needsUpdate: true });
      for (const inside of mesh.children) inside.visible = solid;
    }
  }

  // Cuts away what lies beyond a point along `normal`, of one kind of surfaces.
  cut(kind, normal, point) {
    this.planes[kind].normal.copy(normal).negate();
    this.planes[kind].constant = normal.dot(point);
  }

  whole() {
    for (const plane of Object.values(this.planes)) plane.constant = NOWHERE;
  }

  placement(motion, pose, frame) {
    const start = (pose * this.display.frames.length + frame) * 12;
    const m = this.placements[motion].subarray(start, start + 12);
    return new THREE.Matrix4().set(...m, 0, 0, 0, 1);
  }

  setPose(motion, pose) {
    for (const mesh of this.robot.children) {
      mesh.matrix.copy(this.placement(motion, pose, mesh.userData.frame));
      mesh.matrixWorldNeedsUpdate = true;
    }
    this.frames.children.forEach((axes, k) => {
      axes.matrix.copy(this.placement(motion, pose, k));
      axes.matrixWorldNeedsUpdate = true;
    });
  }

  clearPairs() {
    for (const mark of [...this.marks.children]) {
      this.marks.remove(mark);
      mark.geometry.dispose();
      mark.material.dispose();
    }
  }

  // Triangle pairs, 18 numbers each: the robot's triangle, then the other one.
  addPairs(array) {
    for (const side of [0, 1]) {
      const corners = [];
      for (let k = side * 9; k < array.length; k += 18) corners.push(...array.slice(k, k + 9));
      const colour = new THREE.Color(styled(side ? "touched" : "touching"));
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(corners), 3));
      const surface = new THREE.Mesh(
        geometry,
        new THREE.MeshBasicMaterial({
          color: colour, side: THREE.DoubleSide, transparent: true, opacity: 0.75, depthTest: false,
        }),
      );
      surface.renderOrder = 6 - side;
      const edges = new THREE.LineSegments(
        outlines(corners),
        new THREE.LineBasicMaterial({ color: colour.clone().multiplyScalar(0.3), depthTest: false, transparent: true }),
      );
      edges.renderOrder = 7;
      this.marks.add(surface, edges);
    }
  }

  bounds(group) {
    const box = new THREE.Box3();
    for (const mesh of group.children) {
      box.union(mesh.geometry.boundingBox.clone().applyMatrix4(mesh.matrix));
    }
    return box;
  }
}

function outlines(corners) {
  const lines = [];
  for (let k = 0; k < corners.length; k += 9) {
    const [a, b, c] = [corners.slice(k, k + 3), corners.slice(k + 3, k + 6), corners.slice(k + 6, k + 9)];
    lines.push(...a, ...b, ...b, ...c, ...c, ...a);
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(lines), 3));
  return geometry;
}
