#!/usr/bin/env python3
"""The largest frequency that a scheme steps, by dense matrices, beside the solver's bound of it (mpm-proc/src/pass/limits.rs).

    python3 docs/results/wave_bound.py      # needs numpy; two minutes

Each row: a cloud of points of a linear elastic material (nu = 0.25), and for the grid (M^-1 K), FLIP (Z^T N^T N Z) and APIC the
step 2/omega over that of the bound of single points, g c^2. Three experiments:
  crossing   blocks of 10 x 10 cells, whole, jittered and sheared, in ten places within a cell: smallest and largest ratio
  few        the stiffest cloud of n points that a random search finds: no bound from a place in the cell can be longer
  growth     how much the frequency grows (largest ratio of omega) if each point moves by 0.1 cells in a direction of its own
"""

import numpy as np

BULK, SHEAR = 1.0, 0.6
WAVES = 2 * BULK + 2 / 3 * SHEAR  # c^2, with a density and a cell of 1


def kernel(shape, d, half):
    r, sign = np.abs(d), np.sign(d)
    if shape == "quadratic":
        parts = [(r < 0.5, 0.75 - r * r, -2 * r), (r < 1.5, 0.5 * (1.5 - r) ** 2, r - 1.5)]
    elif shape == "cubic":
        parts = [(r < 1, r**3 / 2 - r * r + 2 / 3, 1.5 * r * r - 2 * r), (r < 2, (2 - r) ** 3 / 6, -((2 - r) ** 2) / 2)]
    else:
        end = 1 + half - r
        parts = [(r < half, 1 - (r * r + half**2) / (2 * half), -r / half), (r < 1 - half, 1 - r, -np.ones_like(r)),
                 (r < 1 + half, end**2 / (4 * half), -end / (2 * half))]
    where = [p[0] for p in parts]
    return np.select(where, [p[1] for p in parts]), np.select(where, [p[2] for p in parts]) * sign


def stiffest(shape, half):
    return {"quadratic": 6.0, "cubic": 3.13683}.get(shape) or 2 / half + 1 / (1 - half)


def steps(x, shape, half, which):
    """Step over that of the bound, of points of equal mass and volume (a quarter of a cell's, which cancels)."""
    low = np.floor(x.min(0)).astype(int) - 2
    count = np.ceil(x.max(0)).astype(int) + 3 - low
    (sx, gx), (sy, gy) = (kernel(shape, x[:, a, None] - (low[a] + np.arange(count[a])), half) for a in (0, 1))
    over = lambda u, v: (u[:, :, None] * v[:, None, :]).reshape(len(x), -1)
    s, along, across = over(sx, sy), over(gx, sy), over(sx, gy)
    used = s.sum(0) > 1e-14
    s, along, across = s[:, used], along[:, used], across[:, used]
    mass = s.sum(0)
    if which == "grid":
        z = np.diag(mass**-0.5)
    else:
        z = s.T / mass[:, None]
        if which == "apic":
            inertia = {"quadratic": 1 / 4, "cubic": 1 / 3}[shape]
            nodes = np.stack(np.meshgrid(*(low[a] + np.arange(count[a]) for a in (0, 1)), indexing="ij"), -1).reshape(-1, 2)[used]
            arms = [(s * (nodes[None, :, a] - x[:, None, a])).T / mass[:, None] / inertia**0.5 for a in (0, 1)]
            z = np.hstack([z, *arms])
    p, q = along @ z, across @ z
    a, b = (BULK + SHEAR / 3) ** 0.5, SHEAR**0.5
    strains = np.block([[a * p, a * q], [b * p, -b * q], [b * q, b * p]])
    return (stiffest(shape, half) * WAVES) ** 0.5 / max(np.linalg.norm(strains, 2), 1e-9)  # points that no node joins: none


def block(per_axis, at, jitter, shear, rng):
    h = 1 / per_axis
    line = (np.arange(10 * per_axis) + 0.5) * h
    x = np.stack(np.meshgrid(line, line), -1).reshape(-1, 2)
    x = x + jitter * h * rng.uniform(-1, 1, x.shape)
    x[:, 0] += shear * x[:, 1]
    return x + at


CASES = [("quadratic", 2), ("cubic", 2), ("ugimp", 2), ("ugimp", 3)]
for shape, per_axis in CASES:
    half = 0.5 / per_axis
    for which in ("grid", "flip", "apic")[: 2 if shape == "ugimp" else 3]:
        name = f"{shape}, {per_axis**2} a cell, {which}"
        for jitter, shear in ((0, 0), (0.3, 0), (0, 0.3)):
            places = np.arange(0, 1, 0.1)
            found = [steps(block(per_axis, (t, 0.37 * t), jitter, shear, np.random.default_rng(1)), shape, half, which) for t in places]
            print(f"crossing {name}, jitter {jitter}, shear {shear}: {min(found):.2f} to {max(found):.2f}", flush=True)
        rng = np.random.default_rng(3)
        for n in (2, 4, 10):
            cloud, best = None, np.inf
            for trial in range(600):
                if trial < 200:
                    other = 10 + rng.uniform(0, rng.choice([1.0, 2.0, 3.0]), (n, 2))
                else:
                    other = cloud + 0.2 * 0.99 ** (trial - 200) * rng.normal(size=cloud.shape)
                step = steps(other, shape, half, which)
                if step < best:
                    cloud, best = other, step
            print(f"few      {name}, {n} points: {best:.3f}", flush=True)
        for kind, draw in (("block", lambda: block(2, rng.uniform(0, 1, 2), 0.3, 0, rng)[:100]),
                           ("4 points in 2 x 2 cells", lambda: 10 + rng.uniform(0, 2, (4, 2)))):
            most = 0
            for _ in range(5 if kind == "block" else 300):
                x = draw()
                turn = rng.uniform(0, 2 * np.pi, len(x))
                moved = x + 0.1 * np.stack([np.cos(turn), np.sin(turn)], 1)
                most = max(most, steps(x, shape, half, which) / steps(moved, shape, half, which))
            print(f"growth   {name}, {kind}: {most:.2f}", flush=True)
