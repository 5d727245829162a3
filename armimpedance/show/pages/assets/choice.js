
// The page of trials: one trial at a time in front of those alike, a key to leave it out.
const more = read("more");
const trials = rows("trials");
const courses = new Map();
for (const row of rows("courses")) {
  if (!courses.has(row.trial)) courses.set(row.trial, []);
  courses.get(row.trial).push(row);
}
const left = new Map(trials.filter((t) => t.why !== null).map((t) => [t.trial, t.why]));
const at = (id) => document.getElementById(id);
const WIDTH = 420, HEIGHT = 190, EDGE = { left: 46, right: 8, top: 22, bottom: 24 };
let shown = [];
let current = 0;

const make = (name, attributes = {}, text = "") => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.textContent = text;
  return element;
};

/** The trials that the filters let pass, and the list of them. */
function filter() {
  const group = at("group").value;
  shown = trials.filter((t) => (group === "" || t.group === group) &&
    (!at("unlike").checked || t.look !== "used"));
  at("list").replaceChildren(...shown.map((trial, i) => {
    const button = document.createElement("button");
    const name = document.createElement("span");
    const note = document.createElement("span");
    name.textContent = `${trial.trial}  ${trial.direction}`;
    name.className = left.has(trial.trial) ? "out" : "";
    note.textContent = left.has(trial.trial) ? "left out" : trial.look === "used" ? "" : trial.look;
    note.className = "note";
    button.type = "button";
    button.append(name, note);
    button.addEventListener("click", () => show(i));
    return button;
  }));
  show(Math.min(current, Math.max(shown.length - 1, 0)));
}

/** Show one trial of the list. */
function show(i) {
  current = i;
  const trial = shown[i];
  [...at("list").children].forEach((b, k) => b.setAttribute("aria-current", String(k === i)));
  at("list").children[i]?.scrollIntoView({ block: "nearest" });
  at("panels").replaceChildren();
  at("which").textContent = trial ? `Trial ${trial.trial}: ${trial.group}, ${trial.direction}` : "No trial";
  if (!trial) return;
  at("toggle").setAttribute("aria-pressed", String(left.has(trial.trial)));
  at("toggle").textContent = left.has(trial.trial) ? "Take back" : "Leave out";
  at("why").value = left.get(trial.trial) ?? "";
  const alike = trials.filter((t) => t.group === trial.group && t.direction === trial.direction);
  at("panels").append(...more.panels.map(([column, label]) => panel(column, label, trial, alike)));
  at("count").textContent = `${left.size} of ${trials.length} trials left out by hand`;
}

/** One channel of a trial, the others behind it. */
function panel(column, label, trial, alike) {
  const all = alike.flatMap((t) => courses.get(t.trial));
  const range = (key) => {
    const values = all.map((row) => row[key]);
    return [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))];
  };
  const [t0, t1] = range("ms");
  // all axes of one kind have one scale, so that noise across the push does not fill a panel
  const kind = more.panels.map(([name]) => name).filter((name) => name.slice(0, 5) === column.slice(0, 5));
  const reach = Math.max(...kind.map((name) => range(name)).map(([a, b]) => b - a));
  const middle = range(column).reduce((a, b) => a + b) / 2;
  const [y0, y1] = [middle - reach / 2, middle + reach / 2];
  const x = (v) => EDGE.left + (v - t0) / (t1 - t0 || 1) * (WIDTH - EDGE.left - EDGE.right);
  const y = (v) => HEIGHT - EDGE.bottom - (v - y0) / (y1 - y0 || 1) * (HEIGHT - EDGE.top - EDGE.bottom);
  const line = (t) => `M${courses.get(t.trial).map((r) => `${x(r.ms).toFixed(1)} ${y(r[column]).toFixed(1)}`).join("L")}`;
  const svg = make("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": `${label} of trial ${trial.trial}` });
  svg.append(make("text", { x: EDGE.left, y: 13 }, label));
  for (const value of [y0, y1]) {
    svg.append(make("text", { x: EDGE.left - 4, y: y(value) + 4, "text-anchor": "end" }, value.toPrecision(3)));
  }
  for (const value of [t0, 0, t1]) {
    svg.append(make("text", { x: x(value), y: HEIGHT - 8, "text-anchor": value === t1 ? "end" : value === t0 ? "start" : "middle" }, `${Math.round(value)} ms`));
  }
  svg.append(make("path", { class: "axis", d: `M${x(0)} ${EDGE.top}V${HEIGHT - EDGE.bottom}` }));
  for (const other of alike) if (other !== trial && !left.has(other.trial)) svg.append(make("path", { class: "other", d: line(other) }));
  svg.append(make("path", { class: left.has(trial.trial) ? "own out" : "own", d: line(trial) }));
  return svg;
}

/** Leave the current trial out, or take it back. */
function toggle() {
  const trial = shown[current];
  if (!trial) return;
  if (!left.delete(trial.trial)) left.set(trial.trial, at("why").value);
  const button = document.activeElement?.closest?.("#list button") ? current : null;
  filter();
  if (button !== null) at("list").children[button]?.focus();
  say(`trial ${trial.trial} is ${left.has(trial.trial) ? "left out" : "taken back"}`);
}

/** The list, as `armimpedance estimate --leave-out` reads it. */
function saveList() {
  const chosen = trials.filter((t) => left.has(t.trial)).map((t) => [t.trial, left.get(t.trial)]);
  data.list = { trial: chosen.map(([trial]) => trial), why: chosen.map(([, why]) => why) };
  save("left_out.csv", csv("list"), "text/csv");
}

function move(step) {
  if (shown.length) show(Math.min(Math.max(current + step, 0), shown.length - 1));
  at("list").children[current]?.focus();
}

const names = ["", ...new Set(trials.map((t) => t.group))];
at("group").append(...names.map((name) => new Option(name === "" ? "all" : name, name)));
at("group").addEventListener("change", () => { current = 0; filter(); });
at("unlike").addEventListener("change", () => { current = 0; filter(); });
at("toggle").addEventListener("click", toggle);
at("save").addEventListener("click", saveList);
at("why").addEventListener("input", () => {
  const trial = shown[current]?.trial;
  if (left.has(trial)) left.set(trial, at("why").value);
});
document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("input, select")) return;
  const act = { ArrowDown: () => move(1), ArrowUp: () => move(-1), x: toggle, s: saveList }[event.key];
  if (act) { event.preventDefault(); act(); }
});
filter();
document.body.dataset.ready = "yes";
