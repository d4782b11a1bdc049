// What stands in the view: meshes of robot and surroundings, needle plan, contacts,
// closest points, frames. Knows nothing of buttons.
import * as THREE from "three";
import { inflated, meshArrays } from "./data.js";

const COLOURS = {
  robot: 0x4e79a7, needle: 0x22242a, scanner: 0xcdd1d6, couch: 0x949eaa, patient: 0xe2bca0, other: 0xaaa0b9,
};
const CONTACT = [0xd55e00, 0xf0c000];
const CLOSEST = 0xb5006e;
const PLAN = 0x0a58d0;

export class Stage {
  constructor(display) {
    this.scene = new THREE.Scene();
    this.display = display;
    this.robot = new THREE.Group();
    this.around = new THREE.Group();
    this.marks = new THREE.Group();
    this.frames = new THREE.Group();
    this.frames.visible = false;
    this.parts = [];
    this.plane = new THREE.Plane(new THREE.Vector3(0, 1, 0), 1e3);
    this.surroundings = [];
    this.scene.add(this.robot, this.around, this.marks, this.frames);
    this.lights();
  }

  lights() {
    const key = new THREE.DirectionalLight(0xffffff, 1.9);
    key.position.set(1.5, 2.5, 3.5);
    const fill = new THREE.DirectionalLight(0xffffff, 0.7);
    fill.position.set(-2.5, -1.5, 1);
    this.scene.add(key, fill, new THREE.HemisphereLight(0xffffff, 0x9aa4ae, 1.5));
  }

  async load() {
    const { links, obstacles, motions, frames, needle } = this.display;
    for (const block of links) {
      const colour = block.link === needle ? COLOURS.needle : COLOURS.robot;
      const mesh = await this.solid(block, colour, []);
      mesh.userData.frame = frames.indexOf(block.link);
      this.robot.add(mesh);
      this.parts.push({ name: block.name, role: "robot", mesh });
    }
    for (const block of obstacles) {
      const mesh = await this.solid(block, COLOURS[block.role] ?? COLOURS.other, [this.plane]);
      this.around.add(mesh);
      this.surroundings.push(mesh);
      this.parts.push({ name: block.name, role: block.role, mesh });
    }
    this.placements = await Promise.all(motions.map((m) => inflated(m.placements, Float32Array)));
    this.lit = await Promise.all(
      motions.map(async (m) => {
        const byPose = new Map();
        for (const found of m.lit) {
          byPose.set(found.pose, { ...found, array: await inflated(found.corners, Float32Array) });
        }
        return byPose;
      }),
    );
    for (let k = 0; k < frames.length; k += 1) {
      const axes = new THREE.AxesHelper(0.08);
      axes.material.depthTest = false;
      axes.renderOrder = 8;
      axes.matrixAutoUpdate = false;
      this.frames.add(axes);
    }
  }

  // A mesh and, in a flat shade, its inside: where a section opens a closed surface, the
  // inside shows and the cut reads as solid.
  async solid(block, colour, clippingPlanes) {
    const { positions, indices } = await meshArrays(block);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
    geometry.setIndex(new THREE.BufferAttribute(indices, 1));
    geometry.computeBoundingBox();
    geometry.computeBoundingSphere();
    const outside = new THREE.MeshStandardMaterial({
      color: colour, roughness: 0.75, metalness: 0.0, flatShading: true, side: THREE.FrontSide, clippingPlanes,
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
    });
    const inside = new THREE.MeshBasicMaterial({
      color: new THREE.Color(colour).multiplyScalar(0.5), side: THREE.BackSide, clippingPlanes,
    });
    const mesh = new THREE.Mesh(geometry, outside);
    const back = new THREE.Mesh(geometry, inside);
    mesh.add(back);
    mesh.matrixAutoUpdate = false;
    mesh.userData.back = back;
    return mesh;
  }

  setOpacity(opacity) {
    for (const mesh of this.surroundings) {
      const solid = opacity >= 0.999;
      mesh.material.transparent = !solid;
      mesh.material.opacity = opacity;
      mesh.material.depthWrite = solid;
      mesh.material.needsUpdate = true;
      mesh.userData.back.visible = solid;
    }
  }

  setSection(axis, at, on, near) {
    // What lies between the eye of the named views and the plane goes.
    const side = { x: 1, y: -near, z: -1 }[axis];
    this.plane.normal.set(Number(axis === "x"), Number(axis === "y"), Number(axis === "z"));
    this.plane.normal.multiplyScalar(side);
    this.plane.constant = on ? -side * at : 1e3;
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

  clearMarks() {
    for (const mark of [...this.marks.children]) {
      this.marks.remove(mark);
      mark.geometry?.dispose();
      mark.material?.dispose();
    }
  }

  // Triangle pairs, 18 numbers each: the robot's triangle, then the other one.
  addPairs(array) {
    for (const side of [0, 1]) {
      const corners = [];
      for (let k = side * 9; k < array.length; k += 18) corners.push(...array.slice(k, k + 9));
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(corners), 3));
      const surface = new THREE.Mesh(
        geometry,
        new THREE.MeshBasicMaterial({
          color: CONTACT[side], side: THREE.DoubleSide, transparent: true, opacity: 0.75, depthTest: false,
        }),
      );
      surface.renderOrder = 6 - side;
      const edges = new THREE.LineSegments(
        outlines(corners),
        new THREE.LineBasicMaterial({ color: side ? 0x6b5200 : 0x7a2600, depthTest: false, transparent: true }),
      );
      edges.renderOrder = 7;
      this.marks.add(surface, edges);
    }
  }

  addSegment(a, b, kind) {
    const colour = kind === "plan" ? PLAN : CLOSEST;
    const length = Math.hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
    const radius = kind === "plan" ? 0.0018 : 0.0015;
    const material = () => new THREE.MeshBasicMaterial({ color: colour, depthTest: false, transparent: true });
    if (length > 0) {
      const rod = new THREE.Mesh(new THREE.CylinderGeometry(radius, radius, length, 12), material());
      const along = new THREE.Vector3(...b).sub(new THREE.Vector3(...a)).normalize();
      rod.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along);
      rod.position.set((a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2);
      rod.renderOrder = 9;
      this.marks.add(rod);
    }
    for (const point of [a, b]) {
      const ball = new THREE.Mesh(new THREE.SphereGeometry(2.6 * radius, 16, 12), material());
      ball.position.set(...point);
      ball.renderOrder = 9;
      this.marks.add(ball);
    }
  }

  bounds(group) {
    const box = new THREE.Box3();
    group.updateMatrixWorld(true);
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
