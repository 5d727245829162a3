// The picture of the arm: what was measured, the limb, ellipses, handles. Millimetres, y upwards.
const MM = 1000;
const FORCE_MM_PER_N = 4, TIP_MM = 30;
/** How much larger handles and letters are drawn where the picture is small. */
const grown = () => Math.max(1, 650 / (document.getElementById("workspace").clientWidth || 650));
const SVG = "http://www.w3.org/2000/svg";

const element = (name, attributes = {}, text = "") => {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text) made.textContent = text;
  return made;
};
const titled = (made, text) => { made.append(element("title", {}, text)); return made; };
const pathOf = (points) => `M${points.map(([x, y]) => `${(MM * x).toFixed(2)} ${(-MM * y).toFixed(2)}`).join("L")}Z`;
const placed = (points, [x, y], scale) => points.map(([dx, dy]) => [x + scale * dx, y + scale * dy]);

/** The largest of 1, 2, 5 times a power of ten that is not above the value. */
function roundNumber(value) {
  const ten = 10 ** Math.floor(Math.log10(value));
  return ten * [5, 2, 1].find((step) => step * ten <= value * (1 + 1e-9));
}

/** The measured postures of a model as a closed line of hand places; null where it is one posture. */
function regionPath(model, arm) {
  const corners = model.region?.vertices;
  if (!corners || corners.length < 2) return null;
  const unscaled = (u) => u.map((v, j) => {
    const [low, high] = model.box[j];
    return (low + high) / 2 + v * (high - low) / 2;
  });
  return corners.flatMap((start, i) => {
    const end = corners[(i + 1) % corners.length];
    return Array.from({ length: 24 }, (_, k) =>
      placesOf(arm, unscaled(start.map((v, j) => v + (end[j] - v) * k / 24))).hand);
  });
}

/** What stays while the hand moves: frame, reach, what was measured where. */
function background(svg, arm, model) {
  const reach = MM * (arm.upper_arm_m + arm.forearm_hand_m);
  const least = MM * Math.abs(arm.upper_arm_m - arm.forearm_hand_m);
  const [left, top, width, height] = [-reach - 15, -reach - 15, 2 * reach + 30, 1.3 * reach + 15];
  svg.setAttribute("viewBox", [left, top, width, height].map((v) => v.toFixed(1)).join(" "));
  const defs = element("defs");
  const pattern = element("pattern", { id: "hatching", width: 14, height: 14, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)" });
  pattern.append(element("line", { class: "hatch", x1: 0, y1: 0, x2: 0, y2: 14 }));
  defs.append(pattern);
  const circle = (r) => `M${-r} 0A${r} ${r} 0 1 0 ${r} 0A${r} ${r} 0 1 0 ${-r} 0Z`;
  const ring = `${circle(reach)}${least > 1 ? circle(least) : ""}`;
  const made = [defs, element("path", { class: "reach", d: ring })];
  if (model) {
    const region = regionPath(model, arm);
    const inside = region ? pathOf(region) : "";
    made.push(element("path", { class: "beyond", "fill-rule": "evenodd", d: ring + inside }));
    if (region) made.push(element("path", { class: "region", d: inside }));
  }
  return made;
}

/** A measured estimate's outline at its place, with its band where it is chosen. */
function measuredMarks(row, symbol, scale, chosen) {
  const A = row.hand[symbol].value;
  const { place } = row;
  const dot = titled(element("circle", { class: "spot", cx: MM * place[0], cy: -MM * place[1], r: 4 }), row.name);
  if (!ellipseOf(A)) return [dot];
  const line = element("path", { class: `measured${chosen ? " chosen" : ""}`, d: pathOf(placed(locus(A), place, scale)) });
  // many conditions at one place would hide what lies below
  if (!chosen) line.style.opacity = Math.max(0.7 / row.alike, 0.08);
  const marks = [dot, titled(line, row.name)];
  if (chosen) {
    const { inner, outer } = bandOf(A, row.hand[symbol].covariance, row.t);
    marks.unshift(element("path", { class: "measured-band", d: pathOf(placed(outer, place, scale)) + pathOf(placed(inner, place, scale)) }));
  }
  return marks;
}

/** Upper arm and forearm. */
function limb(arm, q) {
  const { elbow, hand } = placesOf(arm, q);
  const at = ([x, y]) => `${(MM * x).toFixed(2)} ${(-MM * y).toFixed(2)}`;
  const joint = ([x, y], r) => element("circle", { class: "joint", cx: MM * x, cy: -MM * y, r });
  return [
    element("path", { class: "limb", d: `M0 0L${at(elbow)}L${at(hand)}` }),
    titled(joint([0, 0], 11), "shoulder"), titled(joint(elbow, 8), "elbow"),
  ];
}

/** The model's ellipse at the hand with its band. */
function modelMarks(A, band, place, scale, extrapolated) {
  const marks = [];
  if (band) marks.push(element("path", { class: "band", d: pathOf(placed(band.outer, place, scale)) + pathOf(placed(band.inner, place, scale)) }));
  marks.push(element("path", { class: `outline${extrapolated ? " extrapolated" : ""}`, d: pathOf(placed(locus(A), place, scale)) }));
  return marks;
}

/** A bar of a round number in a corner. */
function scaleBar(arm, scale, largest, unit) {
  const value = roundNumber(largest);
  const reach = MM * (arm.upper_arm_m + arm.forearm_hand_m);
  const [length, x, y] = [MM * scale * value, reach, 0.26 * reach];
  return [
    element("line", { class: "bar", x1: x - length, y1: y, x2: x, y2: y }),
    element("text", { x, y: y - 10, "text-anchor": "end", "font-size": 20 * grown() }, `${value} ${unit}`),
  ];
}

/** Where the tip of the force's arrow is: a little off the hand, so that no force can be dragged. */
function tipOf(hand, F) {
  const size = Math.hypot(F[0], F[1]);
  const direction = size > 0 ? [F[0] / size, F[1] / size] : [Math.SQRT1_2, -Math.SQRT1_2];
  return direction.map((d, i) => hand[i] + d * (TIP_MM * grown() + FORCE_MM_PER_N * size) / MM);
}

/** The force whose tip is dragged there. */
function forceAt(hand, place) {
  const away = place.map((v, i) => MM * (v - hand[i]));
  const size = Math.hypot(away[0], away[1]);
  const least = TIP_MM * grown();
  return size <= least ? [0, 0] : away.map((v) => v / size * (size - least) / FORCE_MM_PER_N);
}

/** A handle that is dragged or moved by the arrow keys. */
function handle(className, label, radius, moved, nudged) {
  const made = element("g", { class: `handle ${className}`, tabindex: 0, role: "application", "aria-label": label });
  made.append(element("circle", { class: "halo", r: radius + 6 }), element("circle", { r: radius }));
  made.addEventListener("pointerdown", (event) => {
    made.setPointerCapture(event.pointerId);
    made.focus();
    event.preventDefault();
  });
  made.addEventListener("pointermove", (event) => {
    if (!made.hasPointerCapture(event.pointerId)) return;
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(made.ownerSVGElement.getScreenCTM().inverse());
    moved([at.x / MM, -at.y / MM]);
  });
  made.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (!step || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    nudged(step.map((v) => v * (event.shiftKey ? 0.1 : 1)));
  });
  return made;
}

function putHandle(made, [x, y]) {
  made.setAttribute("transform", `translate(${(MM * x).toFixed(2)} ${(-MM * y).toFixed(2)}) scale(${grown().toFixed(3)})`);
}
