"""Arm and manipulandum in the arm's joint angles, one trial, plain floats: the obvious version.

The simulator works at the hand, batched and with forces added there. Here the same machine is
written as a textbook would: one mass matrix over the arm's two angles, the robot and the masses at
the hand brought in through their Jacobians.
"""

from __future__ import annotations

from math import acos, atan2, cos, sin


class Chain:
    """Closed forms of a two-link chain as floats."""

    def __init__(self, link):
        self.link = link

    def angles(self, x, y):
        """Inverse kinematics by the law of cosines."""
        k = self.link
        rx, ry = x - k.base_x, y - k.base_y
        bend = k.elbow * acos((rx * rx + ry * ry - k.l1**2 - k.l2**2) / (2 * k.l1 * k.l2))
        return atan2(ry, rx) - atan2(k.l2 * sin(bend), k.l1 + k.l2 * cos(bend)), bend

    def position(self, q1, q2):
        k = self.link
        x = k.base_x + k.l1 * cos(q1) + k.l2 * cos(q1 + q2)
        return x, k.base_y + k.l1 * sin(q1) + k.l2 * sin(q1 + q2)

    def jacobian(self, q1, q2):
        k = self.link
        x2, y2 = k.l2 * cos(q1 + q2), k.l2 * sin(q1 + q2)
        return -k.l1 * sin(q1) - y2, -y2, k.l1 * cos(q1) + x2, x2

    def jacobian_rate_times_rate(self, q1, q2, w1, w2):
        k, w = self.link, w1 + w2
        ax = -k.l1 * cos(q1) * w1 * w1 - k.l2 * cos(q1 + q2) * w * w
        return ax, -k.l1 * sin(q1) * w1 * w1 - k.l2 * sin(q1 + q2) * w * w

    def mass_matrix(self, q2):
        k = self.link
        m12 = k.inertia2 + k.coupling * cos(q2)
        return k.inertia1 + k.inertia2 + 2 * k.coupling * cos(q2), m12, k.inertia2

    def coriolis(self, q2, w1, w2):
        c = self.link.coupling * sin(q2)
        return -c * (2 * w1 * w2 + w2 * w2), c * w1 * w1


class JointSpacePlant:
    """One trial of a `CoupledPlant`, in column `trial`, as a function for an ODE solver."""

    def __init__(self, plant, trial, onset_s, place, direction, profile):
        self.arm, self.robot = Chain(plant.arm.link), Chain(plant.robot.link)
        self.hand_mass = plant.cast_kg + plant.robot.handle_kg
        paths, self.passive = plant.arm.paths, plant.arm.passive
        command = [part[:, trial].tolist() for part in plant.muscles]
        tables = (paths.slope, paths.sine, paths.cosine)
        self.muscles = list(
            zip(*command, *(t[:, j].tolist() for j in (0, 1) for t in tables), strict=True)
        )
        g = plant.gains
        self.gains = [float(g.stiffness)] + [float(part[trial]) for part in g[1:]]
        self.onset, self.place, self.direction = onset_s, place, direction
        self.profile = profile

    def start(self):
        return [*self.arm.angles(*self.place), 0.0, 0.0]

    def muscle_torque(self, q1, q2, w1, w2, time):
        s1, c1, s2, c2 = sin(q1), cos(q1), sin(q2), cos(q2)
        p = self.passive
        tau1 = -p.stiffness[0] * (q1 - p.rest[0]) - p.viscosity[0] * w1
        tau2 = -p.stiffness[1] * (q2 - p.rest[1]) - p.viscosity[1] * w2
        for f0, k, b, length, velocity, _, a1, b1, d1, a2, b2, d2 in self.muscles:
            g1, g2 = a1 + b1 * c1 - d1 * s1, a2 + b2 * c2 - d2 * s2
            path = a1 * q1 + b1 * s1 + d1 * c1 + a2 * q2 + b2 * s2 + d2 * c2
            f = f0 + k * (path - length - velocity * time) + b * (g1 * w1 + g2 * w2)
            f = max(f, 0.0)
            tau1 -= g1 * f
            tau2 -= g2 * f
        return tau1, tau2

    def servo_force(self, x, y, vx, vy, time):
        kp, kd, fxx, fxy, fyy, hx, hy = self.gains
        p, v, a = self.profile(time)
        (x0, y0), (dx, dy) = self.place, self.direction
        fx = kp * (x0 + dx * p - x) + kd * (dx * v - vx) + (fxx * dx + fxy * dy) * a + hx
        fy = kp * (y0 + dy * p - y) + kd * (dy * v - vy) + (fxy * dx + fyy * dy) * a + hy
        return fx, fy

    def rate(self, state, t):
        """d/dt of (q1, q2, w1, w2) of the arm."""
        q1, q2, w1, w2 = (float(s) for s in state)
        time = t - self.onset
        x, y = self.arm.position(q1, q2)
        j11, j12, j21, j22 = self.arm.jacobian(q1, q2)
        cx, cy = self.arm.jacobian_rate_times_rate(q1, q2, w1, w2)
        vx, vy = j11 * w1 + j12 * w2, j21 * w1 + j22 * w2
        # robot: phidot = C qdot with C = Jr^-1 J
        p1, p2 = self.robot.angles(x, y)
        r11, r12, r21, r22 = self.robot.jacobian(p1, p2)
        det = r11 * r22 - r12 * r21
        c11, c12 = (r22 * j11 - r12 * j21) / det, (r22 * j12 - r12 * j22) / det
        c21, c22 = (r11 * j21 - r21 * j11) / det, (r11 * j22 - r21 * j12) / det
        u1, u2 = c11 * w1 + c12 * w2, c21 * w1 + c22 * w2
        ex, ey = self.robot.jacobian_rate_times_rate(p1, p2, u1, u2)
        ex, ey = cx - ex, cy - ey
        z1, z2 = (r22 * ex - r12 * ey) / det, (r11 * ey - r21 * ex) / det
        n11, n12, n22 = self.robot.mass_matrix(p2)
        g1, g2 = self.robot.coriolis(p2, u1, u2)
        b1, b2 = n11 * z1 + n12 * z2 + g1, n12 * z1 + n22 * z2 + g2
        # M = Ma + C^T Mr C + m J^T J
        m11, m12, m22 = self.arm.mass_matrix(q2)
        m = self.hand_mass
        m11 += n11 * c11**2 + 2 * n12 * c11 * c21 + n22 * c21**2 + m * (j11**2 + j21**2)
        m12 += n11 * c11 * c12 + n12 * (c11 * c22 + c12 * c21) + n22 * c21 * c22
        m12 += m * (j11 * j12 + j21 * j22)
        m22 += n11 * c12**2 + 2 * n12 * c12 * c22 + n22 * c22**2 + m * (j12**2 + j22**2)
        tau1, tau2 = self.muscle_torque(q1, q2, w1, w2, time)
        fx, fy = self.servo_force(x, y, vx, vy, time)
        fx, fy = fx - m * cx, fy - m * cy
        h1, h2 = self.arm.coriolis(q2, w1, w2)
        t1 = tau1 + j11 * fx + j21 * fy - h1 - c11 * b1 - c21 * b2
        t2 = tau2 + j12 * fx + j22 * fy - h2 - c12 * b1 - c22 * b2
        d = m11 * m22 - m12 * m12
        return [w1, w2, (m22 * t1 - m12 * t2) / d, (m11 * t2 - m12 * t1) / d]
