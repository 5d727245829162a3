// The two-link arm, symmetric 2 x 2 matrices as triples [ss, se, ee], ellipses. Pure functions.

export const zeros = (n) => new Array(n).fill(0);
export const add = (a, b) => a.map((v, i) => v + b[i]);
export const sum = (values) => values.reduce((a, b) => a + b, 0);

/** A covariance from its lower triangle, row by row, as rows. */
export function unpacked(lower) {
  const n = Math.round((Math.sqrt(8 * lower.length + 1) - 1) / 2);
  return Array.from({ length: n }, (_, i) => Array.from({ length: n }, (_, j) =>
    lower[i >= j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i]));
}

/** S C S^T (r, r) of rows S (r, n) and a covariance C (n, n). */
export function spread(S, C) {
  const half = S.map((row) => C.map((other) => sum(other.map((c, j) => c * row[j]))));
  return half.map((moved) => S.map((row) => sum(row.map((s, j) => s * moved[j]))));
}

/** Half the length of the 95 % interval of each element. */
export const halfWidths = (covariance, t) => covariance.map((row, i) => t * Math.sqrt(Math.max(row[i], 0)));

/** Hand and elbow from the shoulder at joint angles q, m. */
export function placesOf(arm, [shoulder, elbow]) {
  const joint = [arm.upper_arm_m * Math.cos(shoulder), arm.upper_arm_m * Math.sin(shoulder)];
  const forearm = [
    arm.forearm_hand_m * Math.cos(shoulder + elbow), arm.forearm_hand_m * Math.sin(shoulder + elbow),
  ];
  return { elbow: joint, forearm, hand: add(joint, forearm) };
}

/** The nearest place that the hand can reach, a little inside of the stretched and the folded arm. */
export function reachable(arm, [x, y]) {
  const [l1, l2] = [arm.upper_arm_m, arm.forearm_hand_m];
  const margin = 1e-4 * (l1 + l2);
  const distance = Math.hypot(x, y);
  const held = Math.min(Math.max(distance, Math.abs(l1 - l2) + margin), l1 + l2 - margin);
  return distance > 0 ? [x * held / distance, y * held / distance] : [0, held];
}

/** Joint angles with the hand there, the elbow in 0 to pi; the place is one that it can reach. */
export function anglesOf(arm, [x, y]) {
  const [l1, l2] = [arm.upper_arm_m, arm.forearm_hand_m];
  const cosine = Math.min(Math.max((x * x + y * y - l1 * l1 - l2 * l2) / (2 * l1 * l2), -1), 1);
  const sine = Math.sqrt(1 - cosine * cosine);
  const shoulder = Math.atan2(y, x) - Math.atan2(l2 * sine, l1 + l2 * cosine);
  const turn = 2 * Math.PI;
  const past = (Math.PI - shoulder) % turn;
  return [Math.PI - (past < 0 ? past + turn : past), Math.atan2(sine, cosine)];
}

/** J as [[dx/dqs, dx/dqe], [dy/dqs, dy/dqe]]. */
export function jacobian(arm, q) {
  const { hand, forearm } = placesOf(arm, q);
  return [[-hand[1], -forearm[1]], [hand[0], forearm[0]]];
}

/** The condition of a 2 x 2 matrix. */
export function condition([[a, b], [c, d]]) {
  const size = (a * a + b * b + c * c + d * d) / 2;
  const determinant = a * d - b * c;
  const largest = size + Math.sqrt(Math.max(size * size - determinant * determinant, 0));
  return largest / Math.abs(determinant);
}

/** What a hand force F adds, Gamma_ij = sum_k F_k d2p_k/dq_i dq_j, N m/rad. */
export function forceTerm(arm, q, F) {
  const { hand, forearm } = placesOf(arm, q);
  const along = (v) => -(F[0] * v[0] + F[1] * v[1]);
  return [along(hand), along(forearm), along(forearm)];
}

/** What gravity in the plane adds, dg/dq, N m/rad. */
export function gravityTerm(arm, q) {
  const { elbow, forearm } = placesOf(arm, q);
  const below = arm.forearm_hand_kg * arm.forearm_hand_com_m / arm.forearm_hand_m;
  const above = arm.upper_arm_kg * arm.upper_arm_com_m / arm.upper_arm_m + arm.forearm_hand_kg;
  const along = (v) => v[0] * arm.gravity_m_s2[0] + v[1] * arm.gravity_m_s2[1];
  const lower = below * along(forearm);
  return [above * along(elbow) + lower, lower, lower];
}

/** The arm's inertia at the joints, kg m^2. */
export function jointInertia(arm, [, elbow]) {
  const coupling = arm.forearm_hand_kg * arm.upper_arm_m * arm.forearm_hand_com_m * Math.cos(elbow);
  const lower = arm.forearm_hand_inertia_kgm2 + arm.forearm_hand_kg * arm.forearm_hand_com_m ** 2;
  const upper = arm.upper_arm_inertia_kgm2 + arm.upper_arm_kg * arm.upper_arm_com_m ** 2;
  const whole = upper + lower + arm.forearm_hand_kg * arm.upper_arm_m ** 2;
  return [whole + 2 * coupling, lower + coupling, lower];
}

/** From a triple at the joints to the one at the hand, J^-T A J^-1, as rows (3, 3). */
export function toHand(arm, q) {
  const [[p, r], [s, u]] = jacobian(arm, q);
  const determinant = p * u - r * s;
  const [a, b, c, d] = [u / determinant, -r / determinant, -s / determinant, p / determinant];
  return [[a * a, 2 * a * c, c * c], [a * b, a * d + b * c, c * d], [b * b, 2 * b * d, d * d]];
}

export const times = (rows, vector) => rows.map((row) => sum(row.map((v, i) => v * vector[i])));

/** Semi-axes and the direction of the major axis from +x; null where there is no ellipse. */
export function ellipseOf([a, c, b]) {
  const [mean, radius] = [(a + b) / 2, Math.hypot((a - b) / 2, c)];
  if (!(mean - radius > 1e-13 * mean)) return null;
  const [major, minor] = [mean + radius, mean - radius];
  return { major, minor, angle: Math.atan2(c, (a - b) / 2) / 2, size: Math.PI * major * minor, shape: minor / major };
}

/** An axis' direction from a line, in (-pi/2, pi/2]. */
export function fromLine(angle, line) {
  const past = (Math.PI / 2 - (angle - line)) % Math.PI;
  return Math.PI / 2 - (past < 0 ? past + Math.PI : past);
}

/** The closed curve of A u, |u| = 1, as n points. */
export function locus([a, c, b], n = 121) {
  return Array.from({ length: n }, (_, i) => {
    const angle = 2 * Math.PI * i / (n - 1);
    const [x, y] = [Math.cos(angle), Math.sin(angle)];
    return [a * x + c * y, c * x + b * y];
  });
}

/** Inner and outer outline of the 95 % band, pointwise along each direction, to first order. */
export function bandOf(A, covariance, t, n = 121) {
  const [a, c, b] = A;
  const determinant = a * b - c * c;
  const inverse = ([x, y]) => [(b * x - c * y) / determinant, (a * y - c * x) / determinant];
  const inner = [], outer = [];
  for (const [x, y] of locus(A, n)) {
    const length = Math.hypot(x, y);
    const e = [x / length, y / length];
    // |A^-1 e| r = 1, w = A^-1 e, dr = r^3 (A^-1 w)^T dA w
    const w = inverse(e);
    const radius = 1 / Math.hypot(w[0], w[1]);
    const v = inverse(w);
    const slope = [v[0] * w[0], v[0] * w[1] + v[1] * w[0], v[1] * w[1]].map((part) => part * radius ** 3);
    const half = t * Math.sqrt(Math.max(spread([slope], covariance)[0][0], 0));
    inner.push(e.map((part) => part * Math.max(radius - half, 0)));
    outer.push(e.map((part) => part * (radius + half)));
  }
  return { inner, outer };
}
