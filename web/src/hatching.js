// The face of a cut, as drawn on paper: flat, a little darker, hatched by 45 degrees.
import * as THREE from "three";

// Pixels from line to line.
const STEP_PX = 8;

export function hatched(colour, clippingPlanes) {
  const material = new THREE.MeshBasicMaterial({
    color: colour.clone().multiplyScalar(0.6), side: THREE.BackSide, clippingPlanes,
  });
  material.onBeforeCompile = (shader) => {
    shader.fragmentShader = shader.fragmentShader.replace(
      "#include <color_fragment>",
      `#include <color_fragment>
      float across = fract((gl_FragCoord.x + gl_FragCoord.y) / ${STEP_PX.toFixed(1)});
      diffuseColor.rgb *= across < 0.2 ? 0.72 : 1.0;`,
    );
  };
  return material;
}
