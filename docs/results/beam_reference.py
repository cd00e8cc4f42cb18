#!/usr/bin/env python3
"""A simply supported beam hit at midspan by a ball through Hertz's law (scenes/singer2022/beam_*): modal sums of Euler's and
Timoshenko's beam, and of plane elasticity, which both approximate. No packages needed.

    python3 docs/results/beam_reference.py [--dt SECONDS] [--curves DIR]

`--curves` writes BEAM_THEORY.csv with the force on the ball and the deflection over time, as a history of Tandem has them.

Modes are those with sin(n pi x/L), n odd. Each is an oscillator of its own frequency and static compliance at midspan; it is
propagated exactly over a step in which the force is constant (its mean, found by iteration).

Plane elasticity: strip in plane stress between two planes of antisymmetry (u_y = 0, no normal stress), the force a point load on
its top, the deflection that of the loaded point. Frequency: the flexural branch of the equation of Rayleigh and Lamb,
tanh(b c)/tanh(a c) = (k^2 + b^2)^2/(4 k^2 a b) with a^2 = k^2 - w^2/c_p^2, b^2 = k^2 - w^2/c_s^2, c = h/2. Compliance of a load q cos(kx)
on one side: (1/(E k)) (2 sinh^2 z/(sinh 2z + 2z) + 2 cosh^2 z/(sinh 2z - 2z)), z = k c. It grows with the logarithm of the number of
modes, as a point load on a half-plane sinks in without end: the modes stop where the load is no longer a point.
"""

import argparse
import math
import pathlib

E, NU, RHO, DEPTH, H = 2.1582e11, 0.289, 7960.0, 0.01, 0.01
G = E / (2 * (1 + NU))


def euler(k):
    """Angular frequency in 1/s and compliance in m/N per N/m of a load of wave number k (1/m), per depth."""
    inertia = H**3 / 12
    return k * k * math.sqrt(E * inertia / (RHO * H)), 1 / (E * inertia * k**4)


def timoshenko(k, kappa=5 / 6):
    """The same with shear and rotary inertia, lower branch."""
    inertia = H**3 / 12
    a = RHO**2 * inertia / (kappa * G)
    b = -(RHO * H + k * k * RHO * inertia * (1 + E / (kappa * G)))
    c = k**4 * E * inertia
    w = math.sqrt((-b - math.sqrt(b * b - 4 * a * c)) / (2 * a))
    # As the reference tables of the scenes have it: the mass of every mode is that of the beam.
    return w, 1 / (RHO * H * w * w)


def plane(k):
    """The same of plane elasticity, at the loaded side."""
    c, c_s, c_p = H / 2, math.sqrt(G / RHO), math.sqrt(E / (1 - NU * NU) / RHO)
    z = k * c
    both = 2.0
    if z < 15:
        both = 2 * math.sinh(z) ** 2 / (math.sinh(2 * z) + 2 * z) + 2 * math.cosh(z) ** 2 / (math.sinh(2 * z) - 2 * z)
    if k * H < 0.3:  # where the equation loses its digits, Timoshenko's beam with the plane's coefficient agrees to 1e-5
        return timoshenko(k, (5 + 5 * NU) / (6 + 5 * NU))[0], both / (E * k)

    def gap(w):
        a, b = math.sqrt(k * k - (w / c_p) ** 2), math.sqrt(k * k - (w / c_s) ** 2)
        return math.tanh(b * c) * 4 * k * k * a * b - (k * k + b * b) ** 2 * math.tanh(a * c)

    grid = [c_s * k * (1e-6 + 0.9999 * (i / 400) ** 2) for i in range(401)]
    low, high = next((a, b) for a, b in zip(grid[1:], grid[2:]) if (gap(a) > 0) != (gap(b) > 0))
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (gap(middle) > 0) == (gap(low) > 0) else (low, middle)
    return low, both / (E * k)


def impact(theory, length, radius, modes, dt, end, speed=0.01):
    """Contacts as (begin, end, peak, time of the peak), the largest deflection with its time, the ball's last velocity, and
    (time, force, deflection) of every step."""
    mass = RHO * 4 / 3 * math.pi * radius**3
    hertz = 4 / 3 * E / (2 * (1 - NU * NU)) * math.sqrt(radius)
    table = [theory((2 * n + 1) * math.pi / length) for n in range(modes)]
    give = [2 / (length * DEPTH) * compliance for _, compliance in table]
    turn = [(math.cos(w * dt), math.sin(w * dt)) for w, _ in table]
    at_once = sum(g * (1 - c) for g, (c, _) in zip(give, turn))
    q, p = [0.0] * modes, [0.0] * modes
    x, v, force = 0.0, speed, 0.0
    contacts, deepest, touching, curve = [], (0.0, 0.0), False, []
    for step in range(1, round(end / dt) + 1):
        free = [c * a + s * b for (c, s), a, b in zip(turn, q, p)]
        under, before = sum(free), force
        for _ in range(6):
            mean = 0.5 * (before + force)
            ahead = x + v * dt - 0.5 * mean / mass * dt * dt
            overlap = ahead - under - mean * at_once
            force = hertz * overlap**1.5 if overlap > 0 else 0.0
        mean = 0.5 * (before + force)
        p = [c * b - s * (a - mean * g) for (c, s), a, b, g in zip(turn, q, p, give)]
        q = [f + mean * g * (1 - c) for f, g, (c, _) in zip(free, give, turn)]
        x, v, time = ahead, v - mean / mass * dt, step * dt
        deepest = max(deepest, (sum(q), time))
        curve.append((time, force, sum(q)))
        if force > 0:
            if not touching:
                contacts.append([time, time, 0.0, 0.0])
            contacts[-1][1] = time
            if force > contacts[-1][2]:
                contacts[-1][2:] = [force, time]
        touching = force > 0
    return [c for c in contacts if c[2] > 0.02], deepest, v, curve


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--dt", type=float, default=1e-7, help="step in s")
    parser.add_argument("--curves", type=pathlib.Path, help="directory for the curves")
    chosen = parser.parse_args()
    dt = chosen.dt
    print("| beam | theory | modes | contacts (us) | peaks (N) at (us) | deepest (um) at (us) | ball's last speed (m/s) |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for beam, length, radius, end in (("beam_single", 0.1535, 0.01, 1e-3), ("beam_multiple", 0.3070, 0.02, 4.5e-3)):
        for theory in (euler, timoshenko, plane):
            for modes in (20, 40, 120) if theory is plane else (20, 40):
                contacts, (depth, when), v, curve = impact(theory, length, radius, modes, dt, end)
                spans = ", ".join(f"{1e6 * a:.0f} to {1e6 * b:.0f}" for a, b, _, _ in contacts)
                peaks = ", ".join(f"{f:.3f} at {1e6 * t:.0f}" for _, _, f, t in contacts)
                row = (beam, theory.__name__, f"{modes}", spans, peaks, f"{1e6 * depth:.4f} at {1e6 * when:.0f}", f"{-v:.5f}")
                print("| " + " | ".join(row) + " |", flush=True)
            if chosen.curves:
                kept = curve[:: max(1, round(1e-6 / dt))]
                lines = ["time [s],force [N],midspan [m]"] + [f"{t:.9e},{f:.9e},{w:.9e}" for t, f, w in kept]
                (chosen.curves / f"{beam}_{theory.__name__}.csv").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
