"""A block on a slope that is loaded at once: two models with Coulomb contact, beside scenes/verification/sudden_load.toml.

    python3 docs/results/sudden_load.py

The first model is a rigid block on N springs and dashpots along its foot, each capped by friction, which may slide, lift and rock.
The second is two masses, one on the slope and one above it, with the block's own stiffness across and along between them: a block
that is soft against its contact. Both start at rest with no overlap, as the scene does. The last lines say how the check of standing
was found: how far the rigid block goes on from 0.5 s, and how far it would slide under its weight for friction's work.
"""

import math

G, SLOPE, FRICTION = 9.81, math.radians(33.0), 0.7
SIDE, DENSITY, SPACING = 0.1, 2500.0, 0.005
MASS = DENSITY * SIDE * SIDE
POINTS = round(SIDE / SPACING)
POINT_MASS = DENSITY * SPACING**2
BULK, SHEAR = 6e6, 3.5e6


class Contact:
    """A spring in each direction with a dashpot; the dashpot never pulls, and the tangential force is at most mu times the normal."""

    def __init__(self, k_n, k_t, ratio, mass, many=1, friction=FRICTION):
        self.k = [many * k_n, many * k_t]
        self.c = [2 * ratio * math.sqrt(k * mass) * many for k in (k_n, k_t)]
        self.stretch = self.slid = 0.0
        self.friction = friction

    def force(self, overlap, velocity, dt):
        if overlap <= 0.0:
            self.slid += 0.5 * self.k[1] * self.stretch**2
            self.stretch = 0.0
            return 0.0, 0.0
        along, across = velocity
        normal = max(0.0, self.k[0] * overlap - self.c[0] * across)
        self.stretch += along * dt
        cap, spring = self.friction * normal, -self.k[1] * self.stretch
        if abs(spring) > cap:
            self.slid += cap * (abs(self.stretch) - cap / self.k[1])
            spring = math.copysign(cap, spring)
            self.stretch = -spring / self.k[1]
            return normal, spring
        return normal, max(-cap, min(cap, spring - self.c[1] * along))


def rigid(k_n, k_t, ratio, mass, end=1.5, early=0.25, friction=FRICTION):
    """Where the block is at an early time and at the end, in m along the slope, and the work of friction so far, in J/m."""
    pull = [G * math.sin(SLOPE), -G * math.cos(SLOPE)]
    arms = [(i + 0.5) * SPACING - 0.5 * SIDE for i in range(POINTS)]
    contacts = [Contact(k_n, k_t, ratio, mass, friction=friction) for _ in arms]
    inertia, half = MASS * SIDE**2 / 6, 0.5 * SIDE
    dt = 0.05 * math.sqrt(MASS / (POINTS * max(k_n, k_t)))
    x = y = turn = u = v = spin = 0.0
    told = []
    for step in range(int(end / dt)):
        fx = fy = moment = 0.0
        for arm, contact in zip(arms, contacts):
            normal, along = contact.force(-(y + turn * arm), (u + spin * half, v + spin * arm), dt)
            fx, fy, moment = fx + along, fy + normal, moment + normal * arm + along * half
        u, v, spin = u + dt * (pull[0] + fx / MASS), v + dt * (pull[1] + fy / MASS), spin + dt * moment / inertia
        x, y, turn = x + dt * u, y + dt * v, turn + dt * spin
        if not told and step * dt >= early:
            told = [x, sum(contact.slid for contact in contacts)]
    return [told, [x, sum(contact.slid for contact in contacts)]]


def two_masses(k_n, k_t, ratio, mass, end=1.5):
    """Likewise; halves of the block, linked by its stiffness across (waves of compression) and along (shear) over half its height."""
    pull = [G * math.sin(SLOPE), -G * math.cos(SLOPE)]
    contact = Contact(k_n, k_t, ratio, mass, POINTS)
    link = [2 * SHEAR, 2 * (BULK + 4 * SHEAR / 3)]
    m = 0.5 * MASS
    dt = 0.05 * math.sqrt(m / (max(link) + POINTS * max(k_n, k_t)))
    x, v = [[0.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [0.0, 0.0]]
    early = None
    for step in range(int(end / dt)):
        normal, along = contact.force(-x[0][1], v[0], dt)
        on_foot = (along, normal)
        for a in range(2):
            held = link[a] * (x[1][a] - x[0][a])
            v[0][a] += dt * (pull[a] + (on_foot[a] + held) / m)
            v[1][a] += dt * (pull[a] - held / m)
        for body in range(2):
            for a in range(2):
                x[body][a] += dt * v[body][a]
        if early is None and step * dt >= 0.25:
            early = 0.5 * (x[0][0] + x[1][0])
    return early, 0.5 * (x[0][0] + x[1][0])


CASES = (
    ("none", 6e4, 3e4, 0.0, POINT_MASS),
    ("0.3 of a point", 6e4, 3e4, 0.3, POINT_MASS),
    ("0.3 of a point, k_t = k_n/20", 6e4, 3e3, 0.3, POINT_MASS),
    ("0.5 of the block", 6e4, 3e4, 0.5, MASS / POINTS),
    ("0.5 of the block, k_t = k_n/20", 6e4, 3e3, 0.5, MASS / POINTS),
    ("1 of the block", 6e4, 3e4, 1.0, MASS / POINTS),
    ("none, 100 times as stiff", 6e6, 3e6, 0.0, POINT_MASS),
)

if __name__ == "__main__":
    print("| damping | rigid, 0.25 s | rigid, 1.5 s | two masses, 0.25 s | two masses, 1.5 s |")
    print("| --- | --- | --- | --- | --- |")
    for name, *case in CASES:
        figures = [*(x for x, _ in rigid(*case)), *two_masses(*case)]
        print(f"| {name} | " + " | ".join(f"{1000 * x:.2f} mm" for x in figures) + " |", flush=True)
    for friction in (0.7, 0.64):
        (x, slid), (end, all_slid) = rigid(*CASES[3][1:], end=0.6, early=0.5, friction=friction)
        way = (all_slid - slid) / (friction * MASS * G * math.cos(SLOPE))
        print(f"mu {friction}, 0.5 to 0.6 s: goes {1000 * (end - x):.2g} mm on, friction's work slides {1000 * way:.2g} mm")
