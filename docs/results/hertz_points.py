"""What half width two discs show that touch by points, in linear elasticity: what scenes/chen2023/hertz_discs.toml is held against.

    python3 docs/results/hertz_points.py

Two equal discs are half planes with the gap of circles. Points a distance s apart, the first two s/2 from the axis, press on strips as
wide as s; each pair yields besides by c per force: 1/k of its spring, less 1/M of the half layers of material outside of the points,
which a point at its depth of s/2 does not feel (M = E (1 - nu)/((1 + nu)(1 - 2 nu))). For loads from a = R/20 to R/10 by Hertz this
prints the mean over the load's growth of three half widths over Hertz': by the number of loaded points, by the energy of the springs,
and by the second moment of the pressure.
"""

from math import log, pi, sqrt

R, E, NU = 0.01, 9.4e10, 0.07
RS = R / 2
ES = E / (2 * (1 - NU**2))
M = E * (1 - NU) / ((1 + NU) * (1 - 2 * NU))


def solve(a, b):
    """x of a x = b, by Gauss with pivots."""
    n = len(b)
    rows = [list(row) + [right] for row, right in zip(a, b)]
    for i in range(n):
        pivot = max(range(i, n), key=lambda r: abs(rows[r][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for r in range(i + 1, n):
            share = rows[r][i] / rows[i][i]
            rows[r] = [x - share * y for x, y in zip(rows[r], rows[i])]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (rows[i][n] - sum(rows[i][j] * x[j] for j in range(i + 1, n))) / rows[i][i]
    return x


def half_widths(s, c):
    """(by Hertz, by number, by energy, by second moment) for growing loads."""
    places = [(i + 0.5) * s for i in range(int(0.0024 / s) + 2)]
    gap = [2 * (R - sqrt(R * R - x * x)) for x in places]

    def mean_log(x):  # of ln|x - t| over the strip
        part = lambda y: y * log(abs(y)) - y if y else 0.0
        return (part(x + s / 2) - part(x - s / 2)) / s

    # Approach of both surfaces at x by a unit force at y and at -y.
    give = [[-2 / (pi * ES) * (mean_log(x - y) + mean_log(x + y)) for y in places] for x in places]
    last, found = 0.0, []
    for m in range(1, len(places)):
        system = [[give[i][j] + (c if i == j else 0.0) for j in range(m)] + [-1.0] for i in range(m)]
        # The load at which the next pair touches.
        touch = solve(system + [give[m][:m] + [-1.0]], [-g for g in gap[: m + 1]])
        load = 2 * sum(touch[:m])
        for part in range(1, 11):
            force = last + (load - last) * part / 10
            f = solve(system + [[2.0] * m + [0.0]], [-g for g in gap[:m]] + [force])[:m]
            a = sqrt(4 * RS * force / (pi * ES))
            by_energy = 8 * s * force**2 / (3 * pi**2 * sum(x * x for x in f))
            moment = 2 * sqrt(sum(x * y * y for x, y in zip(f, places)) / sum(f))
            found.append((a, m * s, by_energy, moment))
        last = load
        if found[-1][0] > R / 10:
            return found


def main():
    print("point distance, k: half width over Hertz' by number, energy, second moment")
    for s, name in ((5e-4, "R/20"), (2.5e-4, "R/40"), (1.25e-4, "R/80"), (6.25e-5, "R/160")):
        for k in (0.5, 1.0, 2.0):
            rows = half_widths(s, 1 / (k * M) - 1 / M)
            means = [0.0] * 3
            total = 0.0
            for (a, *_), (b, *widths) in zip(rows, rows[1:]):  # weighted by the growth of Hertz' a, as the load's ramp does
                inside = max(0.0, min(b, R / 10) - max(a, R / 20))
                total += inside
                means = [mean + inside * width / b for mean, width in zip(means, widths)]
            print(f"{name:6}  {k} M: ", *(f"{mean / total:.4f}" for mean in means))


main()
