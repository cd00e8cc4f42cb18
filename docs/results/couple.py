#!/usr/bin/env python3
"""The experiment of docs/energy.md, "Friction turns a point": a disc of points strikes a plane that they stick to. Needs numpy.

Cell, density and P-wave modulus are 1. Quadratic B-splines, the stress first, all points move with the mapped velocities. The
force of the plane acts on the centres of points alone (`none`); or with its moment, at the nodes (`couple`); and then contact
sees the surface of a point, which turns with the field (`surface`). What a spring still holds when contact opens counts as lost.
"""

import numpy as np

NODES = 20
LAMBDA, MU = 1 / 3, 1 / 3
RADIUS, SPACING, CONTACT_RADIUS = 4.0, 0.5, 0.25
MASS = VOLUME = SPACING**2
STIFFNESS = 2.0
SPEED = (0.02, -0.02)
END = 60.0
INERTIA = 0.25  # D of the quadratic spline


def spline(x):
    base = np.floor(x - 0.5).astype(int)
    d = x[:, None] - (base[:, None] + np.arange(3))
    near = abs(d) < 0.5
    return base, np.where(near, 0.75 - d * d, 0.5 * (1.5 - abs(d)) ** 2), np.where(near, -2 * d, -np.sign(d) * (1.5 - abs(d)))


def maps(x):
    """S, dS/dx and dS/dy: points by nodes."""
    (bx, wx, gx), (by, wy, gy) = spline(x[:, 0]), spline(x[:, 1])
    out = np.zeros((3, len(x), NODES, NODES))
    p = np.arange(len(x))
    for i in range(3):
        for j in range(3):
            at = p, bx + i, by + j
            out[0][at], out[1][at], out[2][at] = wx[:, i] * wy[:, j], gx[:, i] * wy[:, j], wx[:, i] * gy[:, j]
    return out.reshape(3, len(x), -1)


def strike(how, dt, apic):
    """Least and largest change of the energy over that at the start, and by how much L of disc and plane changes over the spin."""
    row = np.arange(-8, 8) * SPACING + SPACING / 2
    x = np.array([[a, b] for a in row for b in row if a * a + b * b < RADIUS**2]) + [NODES / 2 - 2.03, 8.0]
    floor = x[:, 1].min() - CONTACT_RADIUS - 0.1
    n = len(x)
    v, B, F, slip = np.tile(SPEED, (n, 1)), np.zeros((n, 2, 2)), np.tile(np.eye(2), (n, 1, 1)), np.zeros(n)
    nodes = np.array([[i, j] for i in range(NODES) for j in range(NODES)], float)
    given, lost, energy = 0.0, 0.0, []

    def momentum():
        return MASS * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0] + B[:, 1, 0] - B[:, 0, 1]).sum()

    def mapped():
        p = MASS * S.T @ v
        if apic:
            p += MASS * np.einsum("pn,pij,npj->ni", S, B / INERTIA, nodes[:, None] - x)
        return per_mass * p

    start, kinetic = momentum(), 0.5 * MASS * (v * v).sum()
    for step in range(int(END / dt)):
        S, GX, GY = maps(x)
        mass = MASS * S.sum(0)[:, None]
        per_mass = np.divide(1, mass, where=mass > 0, out=np.zeros_like(mass))
        before = mapped()
        if step:
            F = F + dt * np.stack([GX @ before, GY @ before], 2) @ F
        inverse, log = np.linalg.inv(F).transpose(0, 2, 1), np.log(np.linalg.det(F))
        tau = (MU * (F - inverse) + LAMBDA * log[:, None, None] * inverse) @ F.transpose(0, 2, 1)
        stored = VOLUME * (0.5 * MU * ((F * F).sum((1, 2)) - 2 - 2 * log) + 0.5 * LAMBDA * log**2).sum()

        overlap = np.maximum(0, floor + CONTACT_RADIUS - x[:, 1])
        on = overlap > 0
        lost += 0.5 * STIFFNESS * (slip[~on] ** 2).sum()
        slip[~on] = 0
        arm = np.where(on, CONTACT_RADIUS - overlap / 2, 0)  # of the centre above the contact
        force = STIFFNESS * np.stack([-slip, overlap], 1)
        couple = 0.5 * arm * force[:, 0]
        f = S.T @ force - VOLUME * (GX.T @ tau[:, :, 0] + GY.T @ tau[:, :, 1])
        if how != "none":
            f += np.stack([-GY.T @ couple, GX.T @ couple], 1)

        kick = dt if step else dt / 2
        given += kick * (x[:, 0] * force[:, 1] - (x[:, 1] - arm) * force[:, 0]).sum()
        gain, old = per_mass * f * kick, v
        v = v + S @ gain
        if apic:
            v = S @ (before + gain)
            B = np.einsum("pn,ni,npj->pij", S, before + gain, nodes[:, None] - x)
        if step:
            springs = 0.5 * STIFFNESS * (overlap**2 + slip**2).sum()
            energy.append(0.25 * MASS * ((old * old).sum() + (v * v).sum()) + stored + springs + lost)
        after = mapped()
        way = dt * (S @ after)
        x = x + way
        turn = 0.5 * dt * (GX @ after[:, 1] - GY @ after[:, 0])
        slip = slip + np.where(on, way[:, 0] + (turn * arm if how == "surface" else 0), 0)
    off = momentum() - start - given
    c, u = x - x.mean(0), v - v.mean(0)
    spin = MASS * (c[:, 0] * u[:, 1] - c[:, 1] * u[:, 0]).sum()
    change = np.array(energy) / kinetic - 1
    return change.min(), change.max(), off / abs(spin)


if __name__ == "__main__":
    for apic in (False, True):
        for how in ("none", "couple", "surface"):
            for dt in (0.2, 0.1, 0.05):
                least, most, off = strike(how, dt, apic)
                print(f"{'apic' if apic else 'flip'} {how:8s} {dt:5}: energy {least:+.1e} to {most:+.1e}, L {off:+.2e}", flush=True)
