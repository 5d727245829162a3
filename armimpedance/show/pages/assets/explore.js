// The page: what is chosen, and what follows from it.
const more = read("more");
const arm = more.arm;
const models = more.models.map(opened);
const measured = more.measured.map((row) => ({
  ...row, muscles: row.alpha ? row.muscles : [], hand: openedMatrices(row.hand), joint: openedMatrices(row.joint),
}));
const at = (id) => document.getElementById(id);
const UNITS = { hand: { K: "N/m", B: "N s/m", M: "kg" }, joint: { K: "N m/rad", B: "N m s/rad", M: "kg m²" } };
const ELEMENTS = { hand: ["xx", "xy", "yy"], joint: ["ss", "se", "ee"] };
const ONE_PLACE_M = 0.01;
const SMALL_N = 0.5;
const NONE = [[0, 0, 0], [0, 0, 0], [0, 0, 0]];
const state = { model: models[0] ?? null, q: [1.04, 1.57], F: [0, 0], alpha: new Map(), symbol: "K", chosen: null, zoom: 0 };
const scales = {};
for (const one of measured) one.place = placesOf(arm, one.q).hand;
for (const one of measured) one.alike = measured.filter((other) => apart(one.place, other.place) <= ONE_PLACE_M).length;
let spoken = 0;

function openedMatrices(found) {
  return Object.fromEntries(Object.entries(found).map(([symbol, made]) =>
    [symbol, { ...made, covariance: unpacked(made.covariance) }]));
}

function apart(a, b) { return Math.hypot(a[0] - b[0], a[1] - b[1]); }

/** What the chosen model says here, at the hand and at the joints; the inertia is the arm's. */
function computed() {
  const alpha = state.model ? state.model.muscles.map((name) => state.alpha.get(name)) : [];
  const now = state.model ? predicted(state.model, arm, state.q, alpha, state.F) : { joint: {}, hand: {}, parts: [] };
  if (arm.mass_known) {
    const inertia = (value) => ({ value, covariance: NONE, half: [0, 0, 0] });
    now.joint.M = inertia(jointInertia(arm, state.q));
    if (now.hand) now.hand.M = inertia(times(toHand(arm, state.q), now.joint.M.value));
  }
  return { ...now, alpha, place: placesOf(arm, state.q).hand };
}

/** The chosen measured estimate's matrix with half-widths. */
function chosenMatrix(level) {
  const made = state.chosen?.[level][state.symbol];
  return made && { ...made, half: halfWidths(made.covariance, state.chosen.t) };
}

/** Say the numbers once the hand rests. */
function aloud(text) {
  clearTimeout(spoken);
  spoken = setTimeout(() => { at("aloud").textContent = text; }, 400);
}

/** Metres for one unit of the shown matrix, and a usual value of it: fixed, so that sizes compare. */
function scaleOf(now) {
  if (!scales[state.symbol]) {
    const all = [now.hand?.[state.symbol], ...measured.map((one) => one.hand[state.symbol])].filter(Boolean);
    const majors = all.map((made) => ellipseOf(made.value)?.major).filter(Boolean);
    const largest = majors.sort((a, b) => a - b)[Math.floor(majors.length / 2)] ?? 1;
    scales[state.symbol] = { one: 0.12 * (arm.upper_arm_m + arm.forearm_hand_m) / largest, largest };
  }
  const { one, largest } = scales[state.symbol];
  return { scale: one * 2 ** state.zoom, largest: largest / 2 ** state.zoom };
}

const hand = handle("hand", "Hand: arrow keys move it by 10 mm, with Shift by 1 mm", 11, moveHand,
  (step) => moveHand(placesOf(arm, state.q).hand.map((v, i) => v + 0.01 * step[i])));
const tip = handle("tip", "Force of the hand: arrow keys change it by 1 N, with Shift by 0.1 N", 8,
  (place) => setForce(forceAt(placesOf(arm, state.q).hand, place)),
  (step) => setForce(add(state.F, step)));
const moving = element("g"), marks = element("g");

function moveHand(place) {
  if (fixedPosture()) return;
  state.q = anglesOf(arm, reachable(arm, place));
  if (state.model) choose(null);
  render();
}

function setForce(F) { state.F = F; render(); }
function fixedPosture() { return state.model?.kind === "activation"; }

/** Measured outlines, the chosen one on top; drawn again only where they change. */
function drawMeasured(scale) {
  const shown = at("measured").checked ? measured.filter((one) => one !== state.chosen) : [];
  const asked = [scale, state.symbol, shown.length, measured.indexOf(state.chosen)].join();
  if (drawMeasured.last === asked) return;
  drawMeasured.last = asked;
  marks.replaceChildren(...shown.concat(state.chosen ?? []).flatMap((one) => measuredMarks(one, state.symbol, scale, one === state.chosen)));
}

/** Everything anew from the state. */
function render() {
  const now = computed();
  const place = now.place;
  const line = Math.atan2(place[1], place[0]);
  const own = now.hand?.[state.symbol];
  const { scale, largest } = scaleOf(now);
  const drawn = own && ellipseOf(own.value);
  const band = drawn && own.covariance !== NONE ? bandOf(own.value, own.covariance, now.t) : null;
  drawMeasured(scale);
  const there = tipOf(place, state.F);
  const arrow = element("path", { class: "force", d: `M${MM * place[0]} ${-MM * place[1]}L${MM * there[0]} ${-MM * there[1]}` });
  moving.replaceChildren(...limb(arm, state.q), ...(drawn ? modelMarks(own.value, band, place, scale, now.extrapolated && state.symbol !== "M") : []),
    arrow, ...scaleBar(arm, scale, largest, UNITS.hand[state.symbol]));
  putHandle(hand, place);
  putHandle(tip, there);
  fillTable("hand", now, line);
  fillTable("joint", now, line);
  fillParts(now);
  const verdict = fillState(now, own?.value);
  at("where").textContent = `${state.model?.title ?? "no model"}; hand at ${millimetres(place)} mm, force ${state.F.map((f) => f.toFixed(1)).join(", ")} N`;
  for (const [id, value, digits] of [["hand_x", MM * place[0], 1], ["hand_y", MM * place[1], 1], ["force_x", state.F[0], 2], ["force_y", state.F[1], 2]]) {
    if (document.activeElement !== at(id)) at(id).value = Number(value.toFixed(digits));
  }
  showActivation();
  const axes = drawn ? `${state.symbol} major axis ${shown(drawn.major, 0)}, minor ${shown(drawn.minor, 0)} ${UNITS.hand[state.symbol]}` : "no ellipse";
  aloud(`Hand at ${millimetres(place)} mm, to the right and forward; ${state.model ? axes : "no model"}. ${verdict}`);
  window.exploreState = { kind: state.model?.kind ?? null, q: state.q, F: state.F, band, ...now };
}

/** Background, legend and muscles of another model. */
function setModel(model) {
  state.model = model;
  if (fixedPosture()) state.q = [...model.joint_angles];
  at("workspace").replaceChildren(...background(at("workspace"), arm, model), marks, moving, tip, hand);
  hand.setAttribute("aria-disabled", String(fixedPosture()));
  at("hand_x").disabled = at("hand_y").disabled = fixedPosture();
  buildMuscles();
  buildLegend();
  const warned = [...more.notes, ...(model?.warnings ?? [])];
  at("warned").hidden = warned.length === 0;
  at("warned").firstElementChild.textContent = `What is to be known of the sources (${warned.length})`;
  at("warned").lastElementChild.replaceChildren(...warned.map((text) => {
    const item = document.createElement("li");
    item.textContent = text;
    return item;
  }));
  render();
}

function buildLegend() {
  const kinds = [];
  if (state.model) kinds.push(["outline", "the model at the hand; shaded: its 95 % band; dashed: extrapolated"]);
  if (measured.length) kinds.push(["measured chosen", "measured, where the hand was"]);
  kinds.push(["force", `force of the hand, ${FORCE_MM_PER_N} mm a newton`]);
  if (state.model) kinds.push(["region", state.model.region ? "hatched: postures where nothing was measured" : "hatched: measured in one posture only"]);
  at("legend").replaceChildren(...kinds.map(([name, text]) => {
    const item = document.createElement("li");
    const swatch = element("svg", { viewBox: "0 0 30 12", "aria-hidden": "true", id: "" });
    const line = element("line", { x1: 0, y1: 6, x2: 30, y2: 6 });
    line.style.cssText = { outline: "stroke: var(--blue); stroke-width: 3", "measured chosen": "stroke: var(--care); stroke-width: 3", force: "stroke: var(--bad); stroke-width: 3", region: "stroke: var(--soft); stroke-width: 8; stroke-dasharray: 2 3" }[name];
    swatch.removeAttribute("id");
    swatch.append(line);
    item.append(swatch, text);
    return item;
  }));
}

const sliders = new Map();
let all = null;
function buildMuscles() {
  const names = state.model?.muscles ?? [];
  sliders.clear();
  at("activation_title").hidden = names.length === 0;
  const slider = (text, most, changed) => {
    const label = document.createElement("label");
    const name = document.createElement("span");
    const input = document.createElement("input");
    const told = document.createElement("output");
    name.textContent = text;
    Object.assign(input, { type: "range", min: 0, max: most, step: 0.005 });
    input.addEventListener("input", () => { changed(Number(input.value)); render(); });
    label.append(name, input, told);
    return { label, input, told };
  };
  names.forEach((name, i) => {
    const [, high] = state.model.range[i];
    if (!state.alpha.has(name)) state.alpha.set(name, high / 2);
    sliders.set(name, { ...slider(words(name), Math.min(1, Math.ceil(40 * high) / 20), (v) => state.alpha.set(name, v)), range: state.model.range[i] });
  });
  all = slider("all together", 1, (v) => names.forEach((name, i) => state.alpha.set(name, v * state.model.range[i][1])));
  all.input.id = "all_muscles";
  at("muscles").replaceChildren(...(names.length ? [all.label, ...[...sliders.values()].map((one) => one.label)] : []));
}

function showActivation() {
  const parts = [...sliders].map(([name, { range }]) => state.alpha.get(name) / range[1]);
  if (parts.length) {
    const mean = sum(parts) / parts.length;
    if (document.activeElement !== all.input) all.input.value = mean;
    all.told.textContent = `${(100 * mean).toFixed(0)} %`;
    all.input.setAttribute("aria-valuetext", `${(100 * mean).toFixed(0)} % of what was measured`);
    all.input.title = "part of the measured activation, the mean of all muscles";
  }
  for (const [name, { input, told, range }] of sliders) {
    const value = state.alpha.get(name);
    const beyond = value < range[0] - 1e-6 || value > range[1] + 1e-6;
    if (document.activeElement !== input) input.value = value;
    told.textContent = `${(100 * value).toFixed(1)} of ${(100 * range[1]).toFixed(0)} %`;
    told.className = beyond ? "beyond" : "";
    const to = `measured from ${(100 * range[0]).toFixed(0)} to ${(100 * range[1]).toFixed(0)} %`;
    input.setAttribute("aria-valuetext", `${(100 * value).toFixed(1)} % of the maximum, ${to}`);
    input.title = to;
  }
}

/** Take a measured condition, or none; the arm goes to its posture, force and activation. */
function choose(one) {
  state.chosen = one;
  at("condition").value = one ? String(measured.indexOf(one)) : "";
  if (!one) return;
  if (!fixedPosture()) state.q = [...one.q];
  state.F = [...one.force];
  (one.alpha ?? []).forEach((value, i) => {
    if (sliders.has(one.muscles[i])) state.alpha.set(one.muscles[i], Math.min(Math.max(value, 0), 1));
  });
}

/** Where to begin: the model's posture, the middle of the measured ones. */
function start() {
  const region = models.find((model) => model.region);
  if (region) {
    const middle = [0, 1].map((j) => sum(region.region.vertices.map((v) => v[j])) / region.region.vertices.length);
    state.q = middle.map((v, j) => (region.box[j][0] + region.box[j][1]) / 2 + v * (region.box[j][1] - region.box[j][0]) / 2);
  } else if (measured.length) state.q = [...measured[0].q];
  if (!models.length && measured.length) choose(measured[0]);
}

at("model").append(...models.map((model, i) => new Option(model.title, i)));
at("models").hidden = models.length === 0;
at("conditions").hidden = at("around").hidden = measured.length === 0;
at("condition").append(new Option("none", ""), ...measured.map((one, i) => new Option(one.name, i)));
at("model").addEventListener("change", () => setModel(models[at("model").value]));
at("quantity").addEventListener("change", () => { state.symbol = at("quantity").value; render(); });
at("condition").addEventListener("change", () => { choose(measured[at("condition").value] ?? null); render(); });
at("measured").addEventListener("change", render);
at("zoom").addEventListener("input", () => { state.zoom = Number(at("zoom").value); render(); });
at("no_force").addEventListener("click", () => setForce([0, 0]));
const typed = (ids) => ids.map((id) => Number(at(id).value) || 0);
for (const id of ["hand_x", "hand_y"]) at(id).addEventListener("change", () => moveHand(typed(["hand_x", "hand_y"]).map((v) => v / MM)));
for (const id of ["force_x", "force_y"]) at(id).addEventListener("input", () => setForce(typed(["force_x", "force_y"])));
window.addEventListener("resize", render);
window.addEventListener("beforeprint", () => { at("warned").open = true; });
at("arm_said").textContent = `Upper arm ${(100 * arm.upper_arm_m).toFixed(1)} cm, forearm with hand ${(100 * arm.forearm_hand_m).toFixed(1)} cm: ${more.lengths_from}.`;
at("warned").open = more.notes.length > 0;
start();
setModel(state.model);
document.body.dataset.ready = "yes";
