#!/usr/bin/env python3
"""The experiment of docs/energy.md: where FLIP's residual in contact comes from, in one dimension. Needs numpy.

A bar hits a rigid body of its own mass through a spring between its foremost point and the body. Cell, density and modulus are 1,
so the wave speed is 1 too. The ledger is the solver's: kinetic energy at t_n is the mean of those half a step before and after,
stress work is by the trapezoidal rule. Beside it stands the derived sum, -sum dv_c D dv (USF, MUSL) or -sum dv D dv (USL).
"""

import numpy as np

CELLS = 12
POINTS = 3  # a cell
SPEED = 0.01
END = 60.0
NODES = 60


def shape(x):
    """Quadratic B-splines and their derivatives: points by nodes."""
    s, g = np.zeros((2, len(x), NODES))
    first, all_points = np.floor(x - 0.5).astype(int), np.arange(len(x))
    for node in range(3):
        d = x - (first + node)
        near = np.abs(d) < 0.5
        s[all_points, first + node] = np.where(near, 0.75 - d * d, 0.5 * (1.5 - np.abs(d)) ** 2)
        g[all_points, first + node] = np.where(near, -2 * d, -np.sign(d) * (1.5 - np.abs(d)))
    return s, g


def collide(stiffness, dt, update):
    """The residual over the initial energy at each step, and the derived sum."""
    n = CELLS * POINTS
    mass = 1.0 / POINTS
    x = (np.arange(n) + 0.5) / POINTS + 10.13
    v, stress, work, volume = np.full(n, SPEED), np.zeros(n), np.zeros(n), np.full(n, mass)
    radius = 0.5 / POINTS
    wall, wall_v, wall_mass = x[-1] + radius + 0.2 * SPEED, 0.0, n * mass
    start = 0.5 * mass * (v**2).sum()
    residual, derived, total = [], [], 0.0

    def strain(gradients, velocity):
        nonlocal stress, work, volume
        by = gradients @ velocity * dt
        before = volume * stress
        stress, volume = stress + by, volume * (1 + by)
        work = work + 0.5 * (before + volume * stress) * by

    for step in range(int(END / dt)):
        s, g = shape(x)
        node_mass = s.T @ np.full(n, mass)
        there = node_mass > 1e-12
        per_mass = np.where(there, 1 / np.where(there, node_mass, 1), 0)
        node_v = per_mass * (s.T @ (mass * v))
        if update == "usf" and step > 0:
            strain(g, node_v)
        overlap = max(x[-1] + radius - wall, 0.0)
        push = stiffness * overlap
        kick = dt if step > 0 else 0.5 * dt
        by_contact = -per_mass * s[-1] * push * kick
        dv = by_contact - per_mass * (g.T @ (volume * stress)) * kick
        new_v, new_wall_v = v + s @ dv, wall_v + push / wall_mass * kick

        kinetic = 0.25 * mass * (v**2 + new_v**2).sum() + 0.25 * wall_mass * (wall_v**2 + new_wall_v**2)
        if step == 0:
            kinetic = start
        residual.append((kinetic + work.sum() + 0.5 * stiffness * overlap**2) / start - 1)
        left = dv if update == "usl" else by_contact
        total -= (left * node_mass * dv).sum() - mass * ((s @ left) * (s @ dv)).sum()
        derived.append(total / start)

        if update == "usl":
            strain(g, node_v + dv)
        if update == "musl":
            strain(g, per_mass * (s.T @ (mass * new_v)))
        x = x + dt * (s @ (node_v + dv))
        v, wall_v, wall = new_v, new_wall_v, wall + dt * new_wall_v
    return np.array(residual), np.array(derived)


def main():
    print("    k  scheme    step   residual: most      end   derived: most      end")
    for stiffness in (1.0, 100.0):
        longest = 1.6 / np.sqrt(4.8 + 3 * stiffness)
        for update in ("usf", "musl", "usl"):
            for share in (1, 0.5, 0.25, 0.125):
                r, d = collide(stiffness, longest * share, update)
                ends = f"{r.max():14.2e} {r[-1]:10.2e} {d.max():13.2e} {d[-1]:10.2e}"
                print(f"{stiffness:5.0f}  {update:<5} {longest * share:8.4f} {ends}")


if __name__ == "__main__":
    main()
