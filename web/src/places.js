// Where something is decided: the contact, else the closest pair, else the plan; and from
// where it is seen best.
import * as THREE from "three";

// Frame of the narrowest place, [m]: ten times the gap, within these.
const LEAST_FRAME = 0.06, MOST_FRAME = 0.3;

const vector = (point) => new THREE.Vector3(...point);

// `at` the place, `axis` across the gap (or null), `frame` the length worth seeing, [m].
export function placeOf(pose, pairs, plan, stage, pair = 0) {
  if (pairs) {
    const box = smaller(pairs, pair);
    return { at: box.getCenter(new THREE.Vector3()), axis: normalOf(pairs, pair), frame: MOST_FRAME };
  }
  const inside = (pose.contained ?? []).find((c) => c.state !== "unknown");
  if (inside) return placeOfPart(stage, inside.link);
  if (pose.closest) {
    const [a, b] = pose.closest.points.map(vector);
    const gap = a.distanceTo(b);
    const frame = gap > 0 ? Math.max(LEAST_FRAME, 2.5 * gap, Math.min(10 * gap, MOST_FRAME)) : MOST_FRAME;
    return { at: a.clone().lerp(b, 0.5), axis: gap > 0 ? b.sub(a).normalize() : null, frame };
  }
  if (plan) return { at: vector(plan.entry).lerp(vector(plan.target), 0.5), axis: null, frame: MOST_FRAME };
  return { at: stage.bounds(stage.robot).getCenter(new THREE.Vector3()), axis: null, frame: MOST_FRAME };
}

export function placeOfPart(stage, name) {
  const { mesh } = stage.parts.find((part) => part.name === name);
  const box = mesh.geometry.boundingBox.clone().applyMatrix4(mesh.matrix);
  const frame = Math.max(MOST_FRAME, 1.2 * box.getSize(new THREE.Vector3()).length());
  return { at: box.getCenter(new THREE.Vector3()), axis: null, frame };
}

// A direction of looking across which the gap lies, as near as can be to along the bore,
// from the end and the side that `ahead` and `near` (1 or -1) tell.
export function across(axis, ahead, near) {
  const wanted = [new THREE.Vector3(ahead, -0.35 * near, -0.3), new THREE.Vector3(0.35 * ahead, -near, -0.3)];
  if (!axis) return wanted[0].normalize();
  const flat = wanted.map((w) => w.addScaledVector(axis, -w.dot(axis)));
  return (flat[0].length() > 0.4 ? flat[0] : flat[1]).normalize();
}

// Box of the smaller triangle of a pair, in an array of 18 numbers a pair: the larger one
// may span a whole housing.
function smaller(array, pair) {
  const [a, b] = [0, 9].map((side) => new THREE.Box3().setFromArray(array.slice(18 * pair + side, 18 * pair + side + 9)));
  const size = (box) => box.getSize(new THREE.Vector3()).length();
  return size(a) < size(b) ? a : b;
}

// Normal of the other surface's triangle.
function normalOf(array, pair) {
  const [a, b, c] = [9, 12, 15].map((k) => new THREE.Vector3().fromArray(array, 18 * pair + k));
  const normal = b.sub(a).cross(c.sub(a));
  return normal.length() > 0 ? normal.normalize() : null;
}
