"""The pendulum that a rigid block is while it turns about its corner: python3 topple_reference.py
writes topple_16.csv, topple_18.csv and topple_20.csv.

Chen 2023 section 4.2.1: a block of 0.1 m x 0.4 m on a slope of theta, g = 10 m/s^2. With d the distance of its centre from the
corner and I its moment of inertia about it, phi the angle of the centre beyond the vertical through the corner,

    I phi'' = m g d sin(phi),    phi(0) = theta - atan(0.1/0.4),    phi'(0) = 0.

The paper's eq. 20 is the motion of a pendulum that was never at rest, with an exponent that has a dimension (docs/physics.md).
The time is that of the scene, which lets the block go at 0.3 s. Runge-Kutta of fourth order, steps of 0.1 ms; until the centre
is 60 degrees beyond the vertical.
"""

from math import atan2, degrees, hypot, radians, sin

WIDTH, HEIGHT, G = 0.1, 0.4, 10.0
D = hypot(WIDTH, HEIGHT) / 2
RATE_SQ = G * D / (D**2 + (WIDTH**2 + HEIGHT**2) / 12)
RELEASE, DT, EVERY, SLOPES = 0.3, 1e-4, 50, (16, 18, 20)


def step(phi, spin):
    def rate(p, s):
        return s, RATE_SQ * sin(p)

    k1 = rate(phi, spin)
    k2 = rate(phi + DT / 2 * k1[0], spin + DT / 2 * k1[1])
    k3 = rate(phi + DT / 2 * k2[0], spin + DT / 2 * k2[1])
    k4 = rate(phi + DT * k3[0], spin + DT * k3[1])
    return (
        phi + DT / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0]),
        spin + DT / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1]),
    )


def main():
    for slope in SLOPES:
        phi, spin = radians(slope) - atan2(WIDTH, HEIGHT), 0.0
        with open(f"topple_{slope}.csv", "w") as file:
            print("time,angle", file=file)
            for n in range(7001):
                if n % EVERY == 0:
                    print(f"{RELEASE + n * DT:.4f},{degrees(phi):.6f}", file=file)
                if degrees(phi) > 60:
                    break
                phi, spin = step(phi, spin)


main()
