// What is under the pointer: part or obstacle, and how near it is.
import * as THREE from "three";

const caster = new THREE.Raycaster();

export function nameUnderPointer(panes, stage, told) {
  for (const pane of panes.all) {
    let due = null;
    pane.window.addEventListener("pointermove", (event) => {
      if (event.pointerType === "touch" || event.buttons) return;
      due ??= setTimeout(() => { due = null; told(pane, found(panes, pane, stage, event), event); }, 50);
    });
    pane.window.addEventListener("pointerleave", () => told(pane, null));
  }
}

function found(panes, pane, stage, event) {
  const box = pane.window.getBoundingClientRect();
  const at = new THREE.Vector2(
    (2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height,
  );
  caster.setFromCamera(at, pane.eye.camera);
  stage.whole();
  panes.cutFor(pane);
  let nearest = null;
  for (const part of stage.parts) {
    if (!part.mesh.visible || !part.mesh.parent.visible) continue;
    for (const hit of caster.intersectObject(part.mesh, false)) {
      if (part.mesh.material.clippingPlanes.some((plane) => plane.distanceToPoint(hit.point) < 0)) continue;
      if (!nearest || hit.distance < nearest.distance) nearest = { part, distance: hit.distance };
      break;
    }
  }
  return nearest?.part ?? null;
}
