// What fitted models say of K and B at the joints: the numbers of `predict`. Pure functions.

const EDGE = 1e-6;
const scaled = (box, q) => q.map((v, j) => (v - (box[j][0] + box[j][1]) / 2) / ((box[j][1] - box[j][0]) / 2));

/** The point of a convex polygon (or segment, or point) that is nearest to p. */
export function nearestIn(vertices, p) {
  let best = p, least = Infinity, inside = vertices.length > 2;
  vertices.forEach((start, i) => {
    const end = vertices[(i + 1) % vertices.length];
    const edge = [end[0] - start[0], end[1] - start[1]];
    const away = [p[0] - start[0], p[1] - start[1]];
    const length2 = Math.max(edge[0] ** 2 + edge[1] ** 2, Number.MIN_VALUE);
    const along = Math.min(Math.max((away[0] * edge[0] + away[1] * edge[1]) / length2, 0), 1);
    const foot = [start[0] + along * edge[0], start[1] + along * edge[1]];
    const gap = (p[0] - foot[0]) ** 2 + (p[1] - foot[1]) ** 2;
    if (gap < least) [best, least] = [foot, gap];
    inside = inside && edge[0] * away[1] - edge[1] * away[0] >= 0;
  });
  return inside ? p : best;
}

/** Whether scaled angles are inside of the measured postures, and how far beyond they are. */
export function within(region, u) {
  const nearest = nearestIn(region.vertices, u);
  const beyond = u.map((v, j) => Math.abs(v - nearest[j]));
  return { inside: Math.hypot(beyond[0], beyond[1]) <= region.tolerance, beyond };
}

/** The largest eigenvalue of a symmetric 3 x 3 matrix. */
export function largestEigenvalue(A) {
  const mean = (A[0][0] + A[1][1] + A[2][2]) / 3;
  const off = A[0][1] ** 2 + A[0][2] ** 2 + A[1][2] ** 2;
  const p = Math.sqrt((sum(A.map((row, i) => (row[i] - mean) ** 2)) + 2 * off) / 6);
  if (p === 0) return mean;
  const [[a, b, c], [, d, e], [, , f]] = A.map((row, i) => row.map((v, j) => (v - (i === j ? mean : 0)) / p));
  const half = (a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d)) / 2;
  return mean + 2 * p * Math.cos(Math.acos(Math.min(Math.max(half, -1), 1)) / 3);
}

const reasonOf = (muscles, outside) => outside.some(Boolean)
  ? `activation outside of the measured range: ${muscles.filter((_, i) => outside[i]).join(", ")}` : "";

/** Polynomials over posture. */
function posture(model, q) {
  const u = scaled(model.box, q);
  const X = model.exponents.map(([i, j]) => u[0] ** i * u[1] ** j);
  const terms = X.length;
  const matrix = (made) => ({
    value: [0, 1, 2].map((a) => sum(X.map((x, t) => x * made.coefficients[t][a]))),
    covariance: spread([0, 1, 2].map((a) => {
      const row = zeros(3 * terms);
      X.forEach((x, t) => { row[a * terms + t] = x; });
      return row;
    }), made.covariance),
  });
  const { inside, beyond } = within(model.region, u);
  const degrees = beyond.map((v, j) => (v * (model.box[j][1] - model.box[j][0]) / 2 * 180 / Math.PI).toFixed(0));
  const reason = inside ? "" : `${degrees[0]} deg (shoulder) and ${degrees[1]} deg (elbow) outside of what was measured`;
  return { K: matrix(model.stiffness), B: matrix(model.viscosity), reason, parts: [] };
}

/** Powers of activation at one posture. */
function activation(model, q, alpha) {
  const N = model.order;
  const columns = (patterns) => [0, 1, 2].map((e) => [
    ...[0, 1, 2].map((k) => Number(k === e)),
    ...alpha.flatMap((a, i) => Array.from({ length: N }, (_, k) => patterns[i][e] * a ** (k + 1))),
  ]);
  const X = columns(model.patterns), X_B = columns(model.viscous_patterns);
  const rest = model.stiffness.slice(0, 3);
  const own = (i) => model.muscle_covariance.slice(i * N, (i + 1) * N).map((row) => row.slice(i * N, (i + 1) * N));
  const parts = model.muscles.map((name, i) => {
    const mine = X.map((row) => row.slice(3 + i * N, 3 + (i + 1) * N));
    const c = model.stiffness.slice(3 + i * N, 3 + (i + 1) * N);
    return { name, value: times(mine, c), covariance: spread(mine, own(i)) };
  });
  const outside = alpha.map((a, i) => a < model.range[i][0] - EDGE || a > model.range[i][1] + EDGE);
  const far = largestEigenvalue(spread(X, model.leverage)) > model.leverage_limit * (1 + 1e-9);
  const reason = reasonOf(model.muscles, outside) || (far ? "a combination of activations far from all measured ones" : "");
  const atRest = spread([0, 1, 2].map((e) => X[e].map((x, k) => k < 3 ? x : 0)), model.stiffness_covariance);
  return {
    K: { value: times(X, model.stiffness), covariance: spread(X, model.stiffness_covariance) },
    B: { value: times(X_B, model.viscosity), covariance: spread(X_B, model.viscosity_covariance) },
    reason, parts: [{ name: "at rest, not split", value: rest, covariance: atRest }, ...parts],
  };
}

/** Running sums of Bernstein polynomials: what the increments of a rising curve multiply. */
function rising(s, order) {
  const basis = [];
  let choose = 1;
  for (let k = 0; k <= order; k++) {
    basis.push(choose * s ** k * (1 - s) ** (order - k));
    choose = choose * (order - k) / (k + 1);
  }
  return basis.map((_, k) => sum(basis.slice(k)));
}

/** First and second derivatives of the length terms by the angles. */
function lengthTerms(model, q) {
  const u = scaled(model.box, q);
  const half = model.box.map(([low, high]) => (high - low) / 2);
  const once = (x, e, order, h) => {
    let value = x ** Math.max(e - order, 0);
    for (let r = 0; r < order; r++) value = value * (e - r) / h;
    return value;
  };
  const by = (s, e) => model.exponents.map(([i, j]) => once(u[0], i, s, half[0]) * once(u[1], j, e, half[1]));
  return { gradient: [by(1, 0), by(0, 1)], second: [by(2, 0), by(1, 1), by(0, 2)] };
}

/** Muscles of an arm over posture and activation. */
function muscles(model, q, alpha) {
  const { gradient, second } = lengthTerms(model, q);
  const m = model.muscles.length, n = model.values.length, N1 = model.order + 1, C = model.muscle.length;
  const z = model.values.slice(0, C);
  const lengths = model.base.map((row) => [...row]);
  model.muscle.forEach((i, c) => model.change[c].forEach((d, t) => { lengths[i][t] += z[c] * d; }));
  const curved = model.curvature ? 1 / model.stiffness_per_tension : 0;
  const g = lengths.map((row) => times(gradient, row));
  const bend = lengths.map((row) => times(second, row).map((v) => v * curved));
  const basis = alpha.map((a, i) => rising(a / model.highest[i], model.order));
  const matrix = (start, stiff) => {
    const slope = [0, 1, 2].map(() => zeros(n));
    const owner = zeros(n).fill(-1);
    const passive = start + m * N1;
    const values = [[model.values[passive], 0, model.values[passive + 1]]];
    slope[0][passive] = slope[2][passive + 1] = 1;
    owner[passive] = owner[passive + 1] = 0;
    const f = [], t = [];
    for (let i = 0; i < m; i++) {
      const square = [g[i][0] * g[i][0], g[i][0] * g[i][1], g[i][1] * g[i][1]];
      const increments = model.values.slice(start + i * N1, start + (i + 1) * N1);
      f[i] = sum(increments.map((v, k) => v * basis[i][k]));
      t[i] = stiff ? sum(increments.slice(1).map((v, k) => v * basis[i][k + 1])) : 0;
      values.push([0, 1, 2].map((e) => f[i] * square[e] + t[i] * bend[i][e]));
      for (let k = 0; k < N1; k++) {
        owner[start + i * N1 + k] = i + 1;
        for (let e = 0; e < 3; e++) slope[e][start + i * N1 + k] = basis[i][k] * (square[e] + (stiff && k ? bend[i][e] : 0));
      }
    }
    model.muscle.forEach((i, c) => {
      const dg = times(gradient, model.change[c]);
      const change = [2 * g[i][0] * dg[0], g[i][0] * dg[1] + g[i][1] * dg[0], 2 * g[i][1] * dg[1]];
      const changed = times(second, model.change[c]).map((v) => v * curved);
      owner[c] = i + 1;
      for (let e = 0; e < 3; e++) slope[e][c] = f[i] * change[e] + t[i] * changed[e];
    });
    const masked = (part) => slope.map((row) => row.map((v, k) => owner[k] === part ? v : 0));
    return {
      value: values.reduce(add), covariance: spread(slope, model.covariance),
      parts: !stiff ? [] : values.map((value, part) => ({ value, covariance: spread(masked(part), model.covariance) })),
    };
  };
  const K = matrix(C, true), B = matrix(C + m * N1 + 2, false);
  const { inside } = within(model.region, scaled(model.box, q));
  const above = reasonOf(model.muscles, alpha.map((a, i) => a > model.highest[i] + EDGE));
  const reason = [inside ? "" : "posture outside of the measured ones", above].filter(Boolean).join("; ");
  const names = ["passive joints", ...model.muscles];
  return { K, B, reason, parts: K.parts.map((part, i) => ({ name: names[i], ...part })) };
}

const KINDS = { "moment-arms": posture, activation, muscles };

/** The model with its covariances as rows. */
export function opened(model) {
  if (!model) return model;
  const open = (part) => ({ ...part, covariance: unpacked(part.covariance) });
  const made = { ...model };
  for (const key of Object.keys(made)) {
    if (/covariance$|^leverage$/.test(key)) made[key] = unpacked(made[key]);
    else if (made[key]?.covariance) made[key] = open(made[key]);
  }
  return made;
}

/** K and B at the joints and at the hand, what makes up K, and whether the model was measured there. */
export function predicted(model, arm, q, alpha, F) {
  const joint = KINDS[model.kind](model, q, alpha);
  const gamma = forceTerm(arm, q, F), gravity = gravityTerm(arm, q);
  const whole = (matrix, values) => ({ value: values, covariance: matrix.covariance, half: halfWidths(matrix.covariance, model.t) });
  const T = toHand(arm, q);
  const moved = (matrix, values) => whole({ covariance: spread(T, matrix.covariance) }, times(T, values));
  const stretched = !(condition(jacobian(arm, q)) <= 1e8);
  return {
    joint: { K: whole(joint.K, joint.K.value), B: whole(joint.B, joint.B.value) },
    hand: stretched ? null : {
      K: moved(joint.K, add(joint.K.value, add(gamma, gravity))), B: moved(joint.B, joint.B.value),
    },
    parts: joint.parts.map((part) => ({ name: part.name, value: part.value, half: halfWidths(part.covariance, model.t) })),
    gamma, gravity, t: model.t, extrapolated: joint.reason !== "", reason: joint.reason,
  };
}
