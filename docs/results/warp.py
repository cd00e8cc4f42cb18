#!/usr/bin/env python3
"""The bar of bench/peers in one dimension, by Tandem's scheme and by that of the other programs: why their errors differ.

    target/peers/venv/bin/python docs/results/warp.py

Printed is the error of the swing after a quarter of a period, which is the figure of docs/performance.md: for bars of 25, 50, 100 and
200 cells, at the speed of the bench (strains of 1e-7) and at a thousand times that, which it had before. The two schemes differ in three things, which can
be chosen one by one: the gradient, the law, and whether strains are computed first or last in the step. Needs numpy; takes ten seconds.

- gradient "exact": that of the interpolated velocity, sum v_I dw_I/dx, of quadratic B-splines. Tandem.
- gradient "moments": APIC's matrix, 4/h^2 sum v_I w_I (x_I - x). MLS-MPM: Warp's, Taichi's and C's programs in bench/peers.
"""

import math

import numpy as np

LENGTH, YOUNG, DENSITY, SOUND = 1.0, 1e5, 1e3, 10.0
END = 0.1  # half a period, in s
CELLS = [25, 50, 100, 200]
SPEED = 1e-6  # of bench/peers/bar.json
OUTSIDE = 4  # cells beside the bar

TANDEM = {"strains": "exact", "forces": "exact", "order": "first", "law": "hencky"}
WARP = {"strains": "moments", "forces": "moments", "order": "last", "law": "linear"}

# Kirchhoff stress over Young's modulus of the elongation e.
LAWS = {
    "hencky": np.log1p,
    "hypoelastic": lambda e: np.log1p(e) * (1 + e),
    "linear": lambda e: e,
}
# P = E (e - a e^2 + ...): a of the nominal stress P of each law.
SECOND = {"hencky": 1.5, "hypoelastic": 0.5, "linear": 1.0}


def bent(law, speed):
    """What the swing after a quarter of a period is by the law, where it would be 0 if stress were linear: to first order in the
    strain, -0.589 a V/c (docs/performance.md)."""
    series = sum(8 / math.pi / (n * (n * n - 4)) ** 2 for n in range(1, 99, 2))
    return -2 * SECOND[law] * speed / SOUND * series


def layout(cells, per_cell, irregular, seed):
    """Middles and lengths of the points, of equal length, or with random boundaries between them."""
    count = cells * per_cell
    chance = np.random.default_rng(seed).uniform(-0.5, 0.5, count - 1)
    edges = np.concatenate([[0.0], np.arange(1, count) + irregular * chance, [count]]) * LENGTH / count
    return 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)


def weights(x, h):
    """First node, weights, and both gradients of quadratic B-splines."""
    base = (x / h - 0.5).astype(int)
    f = x / h - base
    w = np.stack([0.5 * (1.5 - f) ** 2, 0.75 - (f - 1) ** 2, 0.5 * (f - 0.5) ** 2])
    away = (np.arange(3)[:, None] - f) * h
    return base, w, away, {"exact": np.stack([f - 1.5, 2 - 2 * f, f - 0.5]) / h, "moments": 4 / h**2 * w * away}


def steps_of(cells):
    """Steps of half a period, as in bench/peers/run."""
    return 2 * math.ceil(1000 * cells / 200 / 2)


def by_wave(cells, scheme, per_cell, shift):
    """The swing from how a long wave travels through a bar without ends: pi/2 (k h)^2 times the share that its speed lacks, which is 1/8 +
    <m'>/6 with exact gradients and 2/3 <n> - 2 <m^2> by moments, where m and n are the third and fourth moments of the weights at a
    point, u from the nearest node: u/4 - u^3 and 1/4 - 3/2 u^2 + 3 u^4 (lengths in cells). The step gives a little of it back."""
    u = (np.arange(per_cell) + 0.5) / per_cell + shift
    u -= np.round(u)
    if scheme["forces"] == "exact":
        lacks = 1 / 8 + np.mean(1 / 4 - 3 * u**2) / 6
    else:
        lacks = 2 / 3 * np.mean(1 / 4 - 1.5 * u**2 + 3 * u**4) - 2 * np.mean((u / 4 - u**3) ** 2)
    courant = SOUND * END / steps_of(cells) * cells / LENGTH
    return math.pi / 2 * (math.pi / cells) ** 2 * (lacks - courant**2 / 24)


def swing(cells, speed, scheme, per_cell=2, shift=0.0, drift=0.0, irregular=0.0, seed=1, finer=1):
    """The swing after a quarter of a period. `shift` is how far the bar's end is from a node, in cells; `drift` is a speed of the whole
    bar in m/s, `irregular` the share of their distance by which boundaries of points are moved at most, `finer` divides the step."""
    h, steps = LENGTH / cells, steps_of(cells) * finer
    dt = END / steps
    place, volume = layout(cells, per_cell, irregular, seed)
    mass, x, e = DENSITY * volume, place + (OUTSIDE + shift) * h, np.zeros_like(place)
    start = speed * np.cos(math.pi * place / LENGTH)
    v, c = start + drift, -speed * math.pi / LENGTH * np.sin(math.pi * place / LENGTH)
    nodes = cells + 2 * OUTSIDE + 2 + int(drift * END / h)
    left = place < 0.5 * LENGTH
    difference = lambda u: np.average(u[left], weights=volume[left]) - np.average(u[~left], weights=volume[~left])
    swings = []
    for step in range(steps // 2 + 1):
        base, w, away, gradients = weights(x, h)
        node = base + np.arange(3)[:, None]
        total = lambda of, node=node: np.bincount(node.ravel(), of.ravel(), nodes)
        node_mass = total(w * mass)
        per_mass = np.where(node_mass > 0, 1 / np.where(node_mass > 0, node_mass, 1), 0)
        node_v = per_mass * total(w * mass * (v + c * away))
        if scheme["order"] == "first" and step > 0:
            # As seen from the end of the interval: exact, as Tandem's gradient of the middle is.
            by = dt * (gradients[scheme["strains"]] * node_v[node]).sum(axis=0)
            e = (e + by) / (1 - by)
        stress = YOUNG * LAWS[scheme["law"]](e)
        force = -total(gradients[scheme["forces"]] * volume * stress)
        node_v = node_v + dt * per_mass * force  # the first force is 0, so half a kick there is the same
        v, c = (w * node_v[node]).sum(axis=0), (gradients["moments"] * node_v[node]).sum(axis=0)
        if scheme["order"] == "last":
            e = e + dt * (gradients[scheme["strains"]] * node_v[node]).sum(axis=0) * (1 + e)
        x = x + dt * v
        swings.append(difference(v) / difference(start))
    return 0.5 * (swings[-1] + swings[-2])  # velocities are half a step behind


def row(name, scheme, speed=SPEED, **how):
    print(f"| {name} | " + " | ".join(f"{swing(cells, speed, scheme, **how):.4e}" for cells in CELLS) + " |", flush=True)


def title(text):
    print(f"\n{text}\n\n| | " + " | ".join(f"{cells} cells" for cells in CELLS) + " |\n| --- |" + " --- |" * len(CELLS))


def both(name, **how):
    row(f"{name}, Tandem", TANDEM, **how)
    row(f"{name}, Warp", WARP, **how)


def wave(per_cell=2, shift=0.0):
    """Both schemes on the finest bar, with what the wave gives."""
    found = [f"{of:.4e}" for scheme in (TANDEM, WARP) for of in (
        swing(CELLS[-1], SPEED, scheme, per_cell=per_cell, shift=shift), by_wave(CELLS[-1], scheme, per_cell, shift))]
    print(f"| {per_cell} along the bar, end {shift} of a cell from a node | " + " | ".join(found) + " |", flush=True)


def main():
    for speed in (SPEED, 1e-3):
        title(f"One change at a time, V = {speed:g} m/s")
        row("Tandem", TANDEM, speed)
        row("strains last", dict(TANDEM, order="last"), speed)
        row("linear law", dict(TANDEM, law="linear"), speed)
        row("hypoelastic law", dict(TANDEM, law="hypoelastic"), speed)
        row("strains by moments", dict(TANDEM, strains="moments"), speed)
        row("forces by moments", dict(TANDEM, forces="moments"), speed)
        row("both by moments", dict(TANDEM, strains="moments", forces="moments"), speed)
        row("both, and last", dict(WARP, law="hencky"), speed)
        row("Warp: both, last, linear law", WARP, speed)
        print("\nby the law itself: " + ", ".join(f"{law} {bent(law, speed):.3e}" for law in LAWS))
    title("The end of the bar a quarter of a cell from a node")
    both("0.25", shift=0.25)
    print(f"\nWhere the points are, {CELLS[-1]} cells\n\n| | Tandem | by the wave | Warp | by the wave |\n| --- | --- | --- | --- | --- |")
    for shift in (0.0, 0.125, 0.25, 0.375, 0.5):
        wave(shift=shift)
    for per_cell in (1, 3, 4):
        wave(per_cell=per_cell)
    title("The step divided by so much")
    for finer in (2, 4):
        both(f"{finer}", finer=finer)
    title("The bar moves by so many m/s")
    for drift in (0.1, 1.0, 3.0):
        both(f"{drift}", drift=drift)
    title("Irregular points, of which so much of a distance")
    for irregular in (0.2, 0.5, 0.9):
        for seed in (1, 2, 3):
            both(f"{irregular}, seed {seed}", irregular=irregular, seed=seed)


if __name__ == "__main__":
    main()
