// What is said of a pose: over the panes, and in the line beside them.

// Millimetres that a lower bound may be given as: never more than it is.
export const mm = (metres) => `${(Math.floor(1e4 * metres + 1e-6) / 10).toFixed(1)} mm`;

// A sample's verdict; of a clear one what is proven of the motion around it.
export function verdictAt(motion, number) {
  const { verdict } = motion.poses[number];
  if (verdict !== "clear" || !motion.fractions) return verdict;
  const at = motion.fractions[number];
  const around = motion.intervals.filter((found) => found.from <= at && at <= found.to);
  return around.every((found) => found.verdict === "clear") ? "clear" : "unknown";
}

// What the marks of a pane draw.
export function factsOf(view, pose, pairs, { plan, marked }) {
  const verdict = verdictAt(view.motions[view.motion], view.pose) ?? "unknown";
  const facts = { plan, verdict, spot: null, ends: null, short: "", long: "" };
  if (!marked) return facts;
  if (pairs) {
    const found = view.dispute === null ? pose.contacts?.[0] ?? pose.self_contacts?.[0] : view.result.disagreements[view.dispute];
    facts.names = found ? [found.link, found.obstacle] : null;
    facts.short = pose.verdict && view.dispute === null ? "contact" : "disputed";
    facts.long = found ? `${facts.short}: ${facts.names.join(" – ")}` : facts.short;
    facts.spot = view.place.at.toArray();
  } else if (pose.closest && pose.closest.distance > 0) {
    const { closest } = pose;
    facts.ends = closest.points;
    facts.names = [closest.link, closest.obstacle];
    facts.short = mm(closest.distance);
    const margin = view.result.margin_m;
    if (pose.qualifiers?.includes("within_margin")) facts.short += ` of ${(1e3 * margin).toFixed(0)} mm`;
    facts.long = `${facts.short}: ${facts.names.join(" – ")}`;
    facts.spot = view.place.at.toArray();
  } else {
    const inside = (pose.contained ?? []).find((c) => c.state !== "unknown");
    if (inside) {
      facts.short = "contact";
      facts.long = inside.state === "a_in_b" ? `${inside.link} in ${inside.obstacle}` : `${inside.obstacle} in ${inside.link}`;
      facts.spot = view.place.at.toArray();
    }
  }
  return facts;
}

// The line beside the panes: where on the motion, the verdict, its reason.
export function sentence(element, motion, number, pose) {
  element.dataset.verdict = verdictAt(motion, number) ?? "";
  const where = motion.fractions ? `${(100 * motion.fractions[number]).toFixed(1)} %` : `pose ${number}`;
  const count = `${number + 1} of ${motion.poses.length}`;
  if (!pose.verdict) {
    const says = Object.entries(pose.verdicts ?? {}).map(([name, said]) => `${name}: ${said ? "contact" : "none"}`);
    element.textContent = [`Pose ${number} (${count})`, says.join(", ")].filter(Boolean).join(" – ");
  } else if (!motion.fractions && motion.poses.length < 2) {
    element.textContent = `${pose.verdict}: ${pose.reason}`;
  } else {
    element.textContent = `${where} (sample ${count}) – ${pose.verdict}: ${pose.reason}`;
    if (pose.verdict !== element.dataset.verdict) element.textContent += "; around it not proven";
  }
}

export function nearestSample({ fractions }, share) {
  let nearest = 0;
  fractions.forEach((f, k) => { if (Math.abs(f - share) < Math.abs(fractions[nearest] - share)) nearest = k; });
  return nearest;
}

// What a plot tells of its nearest sample.
export function valueAt(motion, share) {
  const number = nearestSample(motion, share);
  const { clearance_m: clearance, verdict } = motion.poses[number];
  const fraction = motion.fractions[number];
  const known = clearance === null || clearance === undefined ? verdict : mm(clearance);
  return { fraction, words: `${(100 * fraction).toFixed(1)} %: ${known}` };
}

// Which meshes are shown with fewer triangles than were checked.
export function thinnedOut(display, note) {
  const thin = [...display.links, ...display.obstacles].filter((block) => block.triangles < block.triangles_checked);
  if (!thin.length) return;
  const list = thin.map((b) =>
    `${b.name}: ${b.triangles.toLocaleString("en")} of ${b.triangles_checked.toLocaleString("en")}` +
    (b.moved_m > 0 ? `, moved by at most ${(1e3 * b.moved_m).toFixed(1)} mm` : ""));
  note.hidden = false;
  note.textContent =
    `For display only, triangles were left out (${list.join("; ")}). Every check used all of them.`;
}
