// Unpacks the arrays that borecheck/report/display.py packed.

export async function inflated(text, ArrayType) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new ArrayType(await new Response(stream).arrayBuffer());
}

// Positions [m] in the mesh's own frame, three a vertex, and indices, three a triangle.
export async function meshArrays(block) {
  const [packed, indices] = await Promise.all([
    inflated(block.positions, Uint16Array),
    inflated(block.indices, Uint32Array),
  ]);
  const positions = new Float32Array(packed.length);
  for (let i = 0; i < packed.length; i += 1) {
    positions[i] = block.low[i % 3] + packed[i] * block.step[i % 3];
  }
  return { positions, indices };
}

// What a motion knows of each pose: the verdict's fields, and the plan if there is one.
export function motionsOf(result) {
  if (result.plans) {
    return result.plans
      .filter((plan) => plan.path)
      .map((plan) => ({ ...alongPath(plan.path), plan }));
  }
  if (result.path) {
    return [alongPath(result.path)];
  }
  if (result.poses) return [{ poses: result.poses, worst: 0 }];
  return [{ poses: [result], worst: 0 }];
}

function alongPath({ poses, fractions, intervals, worst }) {
  return { poses, fractions, intervals, worst: Math.max(0, fractions.indexOf(worst.fraction)) };
}
