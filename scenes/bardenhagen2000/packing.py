"""A packing of discs that is periodic in y: sizes of a given range and mean, grown from points and relaxed.

Only the standard library is used; the same arguments give the same packing.
"""

import math
import random


def sizes(count, least, mean, most):
    """Diameters: a lognormal above the least, by quantiles, whose least, mean and largest values are those given.

    Bardenhagen 2000 gives these three; the kind of distribution is assumed.
    """
    normal = [inverse_normal((i + 0.5) / count) for i in range(count)]
    low, high = 1e-3, 5.0
    for _ in range(100):
        width = 0.5 * (low + high)
        grown = [math.exp(width * z) for z in normal]
        middle = sum(grown) / count
        wider = (grown[-1] - middle) * (mean - least) < (most - mean) * (middle - grown[0])
        low, high = (width, high) if wider else (low, width)
    scale = (mean - least) / (middle - grown[0])
    return [least + scale * (g - grown[0]) for g in grown]


def inverse_normal(p):
    """The argument at which the normal distribution is p, by bisection."""
    low, high = -10.0, 10.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if 0.5 * math.erfc(-middle / math.sqrt(2.0)) < p else (low, middle)
    return 0.5 * (low + high)


def pack(radii, width, height, gap, seed, grow=60, rounds=4000):
    """Centres of discs with these radii in a box that is periodic in y, at least `gap` apart, centres within its width.

    Discs grow in steps to their size. After each step those that overlap are pushed apart, heavier ones less, until none
    do. Raises ValueError if that does not come to an end.
    """
    rng = random.Random(seed)
    x = [(rng.uniform(0.0, width), rng.uniform(0.0, height)) for _ in radii]
    x = [list(c) for c in x]
    full = [r + 0.5 * gap for r in radii]
    for step in range(1, grow + 1):
        share = (step / grow) ** 0.5
        last = step == grow
        # A little more than asked for, so that a relaxation that comes to rest leaves the gap itself.
        grown = [share * r * 1.0005 for r in full]
        for _ in range(rounds if last else 60):
            if relax(x, grown, width, height) <= (0.0004 * min(full) if last else 0.02 * min(full)):
                break
        else:
            if last:
                raise ValueError("the discs do not fit: take fewer, smaller ones, or another seed")
    return [tuple(c) for c in x]


def relax(x, radii, width, height):
    """Pushes overlapping discs apart once; the largest overlap before."""
    worst, push = 0.0, [[0.0, 0.0] for _ in x]
    for i, j in neighbours(x, radii, height):
        dx = x[j][0] - x[i][0]
        dy = (x[j][1] - x[i][1] + 0.5 * height) % height - 0.5 * height
        distance = math.hypot(dx, dy)
        overlap = radii[i] + radii[j] - distance
        if overlap <= 0.0:
            continue
        worst = max(worst, overlap)
        nx, ny = (dx / distance, dy / distance) if distance > 0.0 else (1.0, 0.0)
        share = radii[j] ** 2 / (radii[i] ** 2 + radii[j] ** 2)
        for k, part in ((i, -share), (j, 1.0 - share)):
            push[k][0] += 0.7 * part * overlap * nx
            push[k][1] += 0.7 * part * overlap * ny
    for centre, (px, py) in zip(x, push):
        centre[0] = min(max(centre[0] + px, 0.0), width)
        centre[1] = (centre[1] + py) % height
    return worst


def neighbours(x, radii, height):
    """Pairs of discs that can overlap, in an order that the positions alone decide."""
    largest = max(radii)
    ordered = sorted(range(len(x)), key=lambda k: (x[k][0], k))
    for place, i in enumerate(ordered):
        for j in ordered[place + 1 :]:
            if x[j][0] - x[i][0] > radii[i] + largest:
                break
            apart = abs((x[j][1] - x[i][1] + 0.5 * height) % height - 0.5 * height)
            if apart < radii[i] + radii[j] and x[j][0] - x[i][0] < radii[i] + radii[j]:
                yield (i, j) if i < j else (j, i)
