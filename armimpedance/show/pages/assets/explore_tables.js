// The numbers beside the picture: tables, shares, and in words whether to believe them.
const millimetres = (place) => place.map((v) => Math.round(MM * v)).join(", ");
const words = (name) => name.replaceAll("_", " ");
const row = (tag, cells) => {
  const made = document.createElement("tr");
  made.append(...cells.map((cell) => {
    if (cell instanceof Node) return cell;
    const one = document.createElement(tag);
    one.textContent = cell;
    return one;
  }));
  return made;
};
const head = (text, scope) => {
  const made = document.createElement("th");
  made.scope = scope;
  made.textContent = text;
  return made;
};

/** A number with as many decimals as two digits of its half-width, at most six digits. */
function shown(value, half) {
  const largest = value ? Math.floor(Math.log10(Math.abs(value))) : 0;
  const exponent = half > 0 ? Math.floor(Math.log10(half)) : largest - 2;
  const decimals = Math.min(1 - exponent, 5 - Math.max(largest, exponent));
  return value.toFixed(Math.min(Math.max(decimals, 0), 8)).replace(/^-(0\.?0*)$/, "$1");
}

/** A cell with a value and half of its interval's length; without one, to the digits of another. */
function cell(value, half, like = 0) {
  const made = document.createElement("td");
  if (value === 0 && !half) {
    made.textContent = "0";
    return made;
  }
  made.append(shown(value, half || like));
  if (half > 0) {
    const small = document.createElement("span");
    small.className = "half";
    small.textContent = ` ± ${shown(half, half)}`;
    made.append(small);
  }
  return made;
}

/** Elements at one level, of the model and as measured, and of the hand the ellipse. */
function fillTable(level, now, line) {
  const own = state.symbol === "M" ? "from the body's mass" : "model";
  const columns = [[own, now[level]?.[state.symbol]], [`measured: ${state.chosen?.name ?? ""}`, chosenMatrix(level)]]
    .filter(([, made]) => made);
  const caption = document.createElement("caption");
  const symbol = `${state.symbol}${level === "hand" ? "ₑ at the hand" : "ⱼ at the joints"}`;
  caption.textContent = `${symbol}, ${UNITS[level][state.symbol]}, ± half of the 95 % interval`;
  const top = document.createElement("thead");
  top.append(row("th", [head("", "col"), ...columns.map(([name]) => head(name, "col"))]));
  const body = document.createElement("tbody");
  ELEMENTS[level].forEach((name, e) => body.append(
    row("td", [head(name, "row"), ...columns.map(([, made]) => cell(made.value[e], made.half[e]))])));
  if (level === "hand") {
    const ellipses = columns.map(([, made]) => ellipseOf(made.value));
    const told = [
      ["major axis", (one) => shown(one.major, 0)], ["minor axis", (one) => shown(one.minor, 0)],
      ["major axis from the line shoulder to hand", (one) => `${(fromLine(one.angle, line) * 180 / Math.PI).toFixed(1)}°`],
    ];
    for (const [name, tell] of told) {
      body.append(row("td", [head(name, "row"), ...ellipses.map((one) => one ? tell(one) : "no ellipse")]));
    }
  }
  at(`${level}_table`).replaceChildren(caption, top, body);
  at(`${level}_table`).hidden = columns.length === 0;
}

const SPLIT = {
  muscles: "Muscles that span the same joint are told apart less well than their sum: hence the wide intervals of single ones.",
  activation: "What is there at rest cannot be split between muscles and passive joints.",
};

/** What makes up the stiffness of the joints that the hand shows. */
function fillParts(now) {
  const table = at("parts_table");
  at("parts_said").textContent = SPLIT[state.model?.kind] ?? "";
  table.hidden = !state.model;
  if (!state.model) return;
  const K = now.joint.K;
  const exact = (name, value) => ({ name, value, half: [0, 0, 0] });
  const rows = [...now.parts, { name: "Kⱼ", value: K.value, half: K.half, total: true }, exact("force term Γ(F)", now.gamma)];
  if (now.gravity.some((v) => v !== 0)) rows.push(exact("arm's weight dg/dθ", now.gravity));
  const borne = rows.slice(now.parts.length).map((one) => one.value).reduce(add);
  rows.push({ name: "JᵀKₑJ, what the hand shows", value: borne, half: K.half, total: true });
  const trace = borne[0] + borne[2];
  const most = Math.max(...rows.flatMap((one) => one.value.map(Math.abs)));
  const caption = document.createElement("caption");
  caption.textContent = "What makes up the stiffness, N m/rad, ± half of the 95 % interval";
  const top = document.createElement("thead");
  top.append(row("th", ["", "share", "ss", "se", "ee"].map((name) => head(name, "col"))));
  const body = document.createElement("tbody");
  for (const one of rows) {
    const cells = one.value.map((value, e) => {
      const made = cell(value, one.half[e], K.half[e]);
      if (value === 0) return made;
      const bar = document.createElement("span");
      bar.className = `share${value < 0 ? " negative" : ""}`;
      bar.style.width = `${(100 * Math.abs(value) / most).toFixed(1)}%`;
      made.append(bar);
      return made;
    });
    const share = `${(100 * (one.value[0] + one.value[2]) / trace).toFixed(0)} %`.replace(/^-0 /, "0 ");
    const made = row("td", [head(words(one.name), "row"), share, ...cells]);
    if (one.total) made.className = "total";
    body.append(made);
  }
  table.replaceChildren(caption, top, body);
}

/** Whether to believe the numbers, in words. */
function fillState(now, A) {
  const said = [];
  const mark = now.extrapolated ? "Extrapolated" : state.model ? "Inside of what was measured" : "No model";
  if (!state.model) said.push("Only measured estimates are shown: choose one.");
  if (state.model?.kind === "activation") said.push("This model holds in the one posture where it was fitted: the arm stays there.");
  if (state.model && !now.hand) said.push("The arm is stretched, its joints do not set the hand's stiffness.");
  if (A && !ellipseOf(A)) said.push(`${state.symbol}ₑ is not positive definite here: it has no ellipse.`);
  if (state.symbol === "M" && now.hand?.M) said.push("The arm's inertia follows from the body's mass and the lengths; no interval is known.");
  if (state.symbol === "M" && !arm.mass_known && state.model) said.push("The body's mass is not known, hence no inertia.");
  if (state.model && Math.hypot(...state.F) > SMALL_N) said.push("The force adds Γ(F) alone; whether muscles so active bear it, the model does not say.");
  const chosen = state.chosen;
  const away = chosen ? apart(chosen.place, now.place) : 0;
  if (away > ONE_PLACE_M) said.push(`${chosen.name} was measured with the hand ${Math.round(MM * away)} mm away.`);
  if (chosen && state.model?.muscles.some((name) => !chosen.muscles.includes(name))) said.push(`The activation of some muscles is not known of ${chosen.name}.`);
  if (state.model && !state.model.muscles.length) said.push("The model holds at the one activation at which it was measured.");
  const strong = document.createElement("strong");
  strong.textContent = now.extrapolated ? `${mark}:` : mark;
  const first = now.extrapolated ? ` ${now.reason}.` : "";
  const lines = [[strong, first], ...said.map((text) => [text])].map((parts) => {
    const p = document.createElement("p");
    p.append(...parts);
    return p;
  });
  at("state").className = `state${now.extrapolated || !state.model ? " extrapolated" : ""}`;
  at("state").replaceChildren(...lines);
  return [first ? `${mark}:${first}` : `${mark}.`, ...said].join(" ");
}
