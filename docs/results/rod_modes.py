"""Why the error of scenes/jiang2020/rod.toml does not fall steadily with the cell: the rod as a chain of the grid's nodes.

    python3 docs/results/rod_modes.py

FLIP gives a kick f dt to the nodes as M^-1 C M^-1 f dt (docs/energy.md: v + P S dv), M the lumped and C the consistent mass of the rod's
20 columns of points. With linear functions averaged over a point (uGIMP), the contact spring at the last column and small strains
that is all of the scene. Printed: error of v^2 after over before against the closed form, and what is left in the modes of the rod over
the energy at the start; the closed form leaves 1.23 %.
"""

import math

DENSITY, MODULUS, LENGTH = 2000.0, 5e5 + 4.0 / 3.0 * 3.7e5, 0.01
STIFFNESS, SPEED, COLUMNS = 1.2e8, 2.0, 20
MASS = DENSITY * LENGTH
EXPECTED = (1.9876008**2 + (SPEED - 1.9876008) ** 2) / SPEED**2
STEP, END = 2e-7, 1.5e-3


def weights(x, cell, cells):
    """uGIMP of a point at x: the mean of the linear functions over its width."""
    found, parts, width = {}, 8, LENGTH / COLUMNS
    for part in range(parts):
        at = (x - width / 2 + width * (part + 0.5) / parts) / cell
        node = min(int(at), cells - 1)
        for i, weight in ((node, 1 - at + node), (node + 1, at - node)):
            found[i] = found.get(i, 0.0) + weight / parts
    return found


def collide(cells):
    cell, nodes = LENGTH / cells, range(cells + 1)
    points = [weights((i + 0.5) * LENGTH / COLUMNS, cell, cells) for i in range(COLUMNS)]
    lumped, consistent = [0.0 for _ in nodes], [[0.0 for _ in nodes] for _ in nodes]
    for point in points:
        for i, a in point.items():
            lumped[i] += MASS / COLUMNS * a
            for j, b in point.items():
                consistent[i][j] += MASS / COLUMNS * a * b
    x, v, place, speed = [0.0 for _ in nodes], [SPEED for _ in nodes], 0.0, 0.0
    for _ in range(round(END / STEP)):
        force = [0.0 for _ in nodes]
        for i in range(cells):
            tension = MODULUS * (x[i + 1] - x[i]) / cell
            force[i] += tension
            force[i + 1] -= tension
        overlap = sum(a * x[i] for i, a in points[-1].items()) - place
        if overlap > 0.0:
            speed += STEP * STIFFNESS * overlap / MASS
            for i, a in points[-1].items():
                force[i] -= STIFFNESS * overlap * a
        kicked = [STEP * f / m for f, m in zip(force, lumped)]
        for i in nodes:
            near = range(max(0, i - 2), min(cells + 1, i + 3))
            v[i] += sum(consistent[i][j] * kicked[j] for j in near) / lumped[i]
            x[i] += STEP * v[i]
        place += STEP * speed
    return speed, x, v


def modes(cells, x, v, count):
    """Energy of the first modes over that of the start."""
    cell, energies = LENGTH / cells, []
    inner = [cell * (0.5 if i in (0, cells) else 1.0) for i in range(cells + 1)]
    for mode in range(1, count + 1):
        if mode > cells:
            energies.append(0.0)
            continue
        shape = [math.cos(mode * math.pi * i / cells) for i in range(cells + 1)]
        norm = sum(a * s * s for a, s in zip(inner, shape))
        amplitude, rate = (sum(a * s * q for a, s, q in zip(inner, shape, of)) / norm for of in (x, v))
        turn = math.cos(mode * math.pi / cells)
        elastic = MODULUS / cell**2 * (1.0 - turn) * norm * amplitude**2
        kinetic = 0.5 * DENSITY * norm * 3.0 / (2.0 + turn) * rate**2
        energies.append((elastic + kinetic) / (0.5 * MASS * SPEED**2))
    return energies


if __name__ == "__main__":
    print("| cell, mm | error of v^2, % | left in mode 1, % | 2 | 3 | 4 |")
    print("| --- " * 6 + "|")
    for cells in (1, 2, 3, 4, 5, 6, 8, 10, 20):
        speed, x, v = collide(cells)
        error = (speed**2 + (SPEED - speed) ** 2) / SPEED**2 / EXPECTED - 1.0
        left = " | ".join(f"{100 * e:.2f}" for e in modes(cells, x, v, 4))
        print(f"| {10 / cells:.2f} | {100 * error:.2f} | {left} |", flush=True)
