"""Rigid discs against the material points: a bodies' side for Tandem in one file.

    tandem run scenes/jiang2020/collision_hard.toml --dem "python3 python/examples/disc_dem.py"

Law `linear` of PROTOCOL.md section 7 without dashpots: k_n, k_t, mu. Bodies are discs, free or fixed, that do not touch
one another; anything else is refused.
"""

import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # runs without having been installed

from tandem_solver import BODY, DEM, LINEAR, Answer, BodyState, Ledger, Limits, Measurement  # noqa: E402
from tandem_solver import NotFinite, Readiness, Refusal, check_fields, serve_dem  # noqa: E402



class Disc:
    """Positions at t_n, velocities at t_{n-1/2}; after `contact`, `kicked` has those at t_{n+1/2}."""

    def __init__(self, index, config):
        key = f"dem.body.{index}"
        check_fields(key, config, BODY)
        if config["shape"] != "disc" or config["motion"] not in ("free", "fixed"):
            raise Refusal(key, "only the shape `disc` and the motions `free` and `fixed` are known here")
        self.name, self.a, self.free = config["name"], config["sphero_radius"], config["motion"] == "free"
        (self.x, self.y), (self.vx, self.vy) = config["position"], config["velocity"]
        self.angle, self.spin = config["angle"], config["spin"]
        inertia = config["inertia"]
        self.mass = inertia["mass"] if "mass" in inertia else inertia["density"] * math.pi * self.a**2
        self.inertia = 0.5 * self.mass * self.a**2
        if not (self.a > 0.0 and 0.0 < self.mass < math.inf):
            raise Refusal(key, f"radius {self.a} m and mass {self.mass} kg/m must be positive and finite")
        # Inverse mass and inertia: 0 for a body that forces do not move.
        self.w, self.wi = (1.0 / self.mass, 1.0 / self.inertia) if self.free else (0.0, 0.0)
        self.kicked = (self.vx, self.vy, self.spin)
        self.moved = (0.0, 0.0, 0.0)  # shift and turn over the last step
        self.published = (self.x, self.y, self.angle)

    def clear(self):
        self.fx = self.fy = self.torque = self.rate = self.mobility = 0.0
        self.contacts = 0

    def speed(self):
        vx, vy, spin = self.kicked
        return math.hypot(vx, vy) + abs(spin) * self.a

    def travelled(self):
        x, y, angle = self.published
        return math.hypot(self.x - x, self.y - y) + abs(self.angle - angle) * self.a


class Discs:
    identity = "disc_dem 0.1"
    capabilities = ("save", "shape:disc", "motion:free", "motion:fixed", "law:linear", "feature:friction")

    def configure(self, config):
        check_fields("dem", config, DEM)
        if "linear" not in config["contact"]:
            raise Refusal("contact", "only `linear` is known here")
        law = config["contact"]["linear"]
        check_fields("contact.linear", law, LINEAR)
        self.k_n, self.mu = law["normal_stiffness"], law["friction"]
        self.k_t = law["tangential_stiffness"] if self.mu > 0.0 else 0.0
        if law["damping_ratio"] != 0.0:
            raise Refusal("contact.linear.damping_ratio", "there are no dashpots here: 0 is accepted")
        if self.mu > 0.0 and self.k_t <= 0.0:
            raise Refusal("contact.linear.tangential_stiffness", "friction needs a positive one")
        if config["body_contact"] is not None or config["contact_pair"]:
            raise Refusal("body_contact", "bodies do not touch one another here: null, and no contact_pair")
        self.gravity = config["gravity"]
        self.bodies = [Disc(i, body) for i, body in enumerate(config["body"])]
        self.infos, self.springs, self.previous = [], {}, {}
        self.friction_work, self.applied, self.impulse = 0.0, [0.0, 0.0], [0.0, 0.0]
        lightest = min((b.mass for b in self.bodies if b.free), default=0.0)
        return Readiness(items=len(self.bodies), mass_min=lightest, stiffness_max=self.k_n)

    def envelopes(self):
        for b in self.bodies:
            b.published = (b.x, b.y, b.angle)
        return [(i, b.x, b.y, b.a) for i, b in enumerate(self.bodies)]

    def imp_set(self, infos):
        self.infos = infos  # springs and previous positions go by the points' ids (clause I-10)

    def contact(self, step, states):
        """Forces at t_n, and the kick of the bodies by the very same numbers, negated."""
        self.energy, self.loss, springs, forces = 0.0, 0.0, {}, []
        for b in self.bodies:
            b.clear()
        for (point, r_p, *_), state in zip(self.infos, states):
            touching = [self.press(b, (point, i), r_p, state, springs) for i, b in enumerate(self.bodies)]
            forces.append(tuple(map(sum, zip(*touching))))
        for i, b in enumerate(self.bodies):
            gx, gy = self.gravity if b.free else (0.0, 0.0)
            vx, vy = b.vx + (b.fx * b.w + gx) * step.kick, b.vy + (b.fy * b.w + gy) * step.kick
            b.kicked = (vx, vy, b.spin + b.torque * b.wi * step.kick)
            if not math.isfinite(b.speed()):
                raise NotFinite("velocity", f"body {i} ({b.name})")
        if step.measure:
            self.measure(step)
        if not step.opening:
            self.springs, self.previous = springs, {info[0]: s[:2] for info, s in zip(self.infos, states)}
            self.friction_work += self.loss
            self.applied, self.impulse = self.impulses(step)
        most = [(b.rate, b.speed(), b.mobility, b.travelled()) for b in self.bodies]
        rate, speed, mobility, travelled = map(max, zip(*most)) if most else (0.0, 0.0, 0.0, 0.0)
        limits = Limits(contact_omega_sq=rate, speed=speed, mobility=mobility)
        return Answer(forces, limits, travelled + speed * step.dt)

    def press(self, b, key, r_p, state, springs):
        """Force of body `b` on a point, and its stiffness (0 out of reach); books the negative on the body."""
        dx, dy = state[0] - b.x, state[1] - b.y
        distance = math.hypot(dx, dy)
        overlap = b.a + r_p - distance
        if overlap <= -0.5 * r_p:  # clause F-6
            return (0.0, 0.0, 0.0)
        nx, ny = (dx / distance, dy / distance) if distance > 0.0 else (0.0, 1.0)
        tx, ty = -ny, nx
        arm = r_p - 0.5 * overlap
        rx, ry = dx - arm * nx, dy - arm * ny  # from the centre to the contact point
        r_n, r_t = rx * ny - ry * nx, rx * ty - ry * tx
        mobility = b.w + b.wi * r_n * r_n
        b.mobility += mobility
        b.rate += self.k_n * mobility + self.k_t * (b.w + b.wi * r_t * r_t)
        before, moved = self.springs.get(key, 0.0), 0.0
        was = self.previous.get(key[0])
        if was is not None and self.k_t > 0.0:
            # What the point has moved over the last step less what the body's material at the contact point has.
            shift_x, shift_y, turn = b.moved
            sin, versine = math.sin(turn), 2.0 * math.sin(0.5 * turn) ** 2
            ux = state[0] - was[0] - (shift_x + versine * rx - sin * ry)
            uy = state[1] - was[1] - (shift_y + sin * rx + versine * ry)
            moved = ux * tx + uy * ty
        if overlap <= 0.0:
            self.loss += 0.5 * self.k_t * before * (moved + before)  # what was left in the spring
            return (0.0, 0.0, self.k_n)
        normal, tangential = self.k_n * overlap, 0.0
        self.energy += 0.5 * self.k_n * overlap * overlap
        if self.k_t > 0.0:
            longest = self.mu * normal / self.k_t
            springs[key] = now = max(-longest, min(longest, before + moved))
            tangential = -self.k_t * now
            self.energy += 0.5 * self.k_t * now * now
            self.loss += 0.5 * self.k_t * (now + before) * (moved - (now - before))
        fx, fy = normal * nx + tangential * tx, normal * ny + tangential * ty
        b.fx, b.fy, b.torque = b.fx - fx, b.fy - fy, b.torque - (r_n * normal + r_t * tangential)
        b.contacts += 1
        return (fx, fy, self.k_n)

    def advance(self, step):
        for b in self.bodies if not step.opening else ():
            b.vx, b.vy, b.spin = b.kicked
            b.moved = (b.vx * step.dt, b.vy * step.dt, b.spin * step.dt)
            b.x, b.y, b.angle = b.x + b.moved[0], b.y + b.moved[1], b.angle + b.moved[2]

    def impulses(self, step):
        """From outside, and of the points on all bodies, through this step's kick (section 9)."""
        weight, held = sum(b.mass for b in self.bodies if b.free), [b for b in self.bodies if not b.free]
        reaction = (sum(b.fx for b in held), sum(b.fy for b in held))
        force = (sum(b.fx for b in self.bodies), sum(b.fy for b in self.bodies))
        applied = [s + step.kick * (weight * g - f) for s, g, f in zip(self.applied, self.gravity, reaction)]
        return applied, [s + step.kick * f for s, f in zip(self.impulse, force)]

    def measure(self, step):
        w = step.centring

        def mean(before, after):
            return (1.0 - w) * before + w * after

        ledger, bodies = Ledger(contact=self.energy, friction_work=self.friction_work + self.loss), []
        ledger.applied_impulse[:], ledger.contact_impulse[:] = self.impulses(step)
        for b in self.bodies:
            vx, vy, spin = b.kicked
            if b.free:
                ledger.kinetic += 0.5 * b.mass * mean(b.vx**2 + b.vy**2, vx**2 + vy**2)
                ledger.kinetic_rotation += 0.5 * b.inertia * mean(b.spin**2, spin**2)
                ledger.gravity -= b.mass * (self.gravity[0] * b.x + self.gravity[1] * b.y)
                ledger.momentum[0] += b.mass * vx
                ledger.momentum[1] += b.mass * vy
            ledger.contact_force[0] += b.fx
            ledger.contact_force[1] += b.fy
            ledger.contacts += b.contacts > 0
            state = BodyState(position=(b.x, b.y), velocity=(mean(b.vx, vx), mean(b.vy, vy)), angle=b.angle)
            state.spin, state.mass, state.inertia = mean(b.spin, spin), b.mass, b.inertia
            state.point_force, state.point_torque, state.contacts = (b.fx, b.fy), b.torque, b.contacts
            bodies.append(state)
        self.measured = Measurement(ledger, bodies)

    def measurement(self):
        return self.measured

    def save(self):
        """What the next step reads before it writes it; the rest is of the configuration or of one step."""
        bodies = [(b.x, b.y, b.vx, b.vy, b.angle, b.spin, b.moved, b.published) for b in self.bodies]
        books = (self.friction_work, self.applied, self.impulse)
        return {"bodies": bodies, "springs": [*self.springs.items()], "previous": [*self.previous.items()], "books": books}

    def restore(self, state):
        if len(state["bodies"]) != len(self.bodies):
            raise Refusal("restore", f"a state of {len(state['bodies'])} discs, here are {len(self.bodies)}")
        for b, (b.x, b.y, b.vx, b.vy, b.angle, b.spin, b.moved, b.published) in zip(self.bodies, state["bodies"]):
            b.kicked = (b.vx, b.vy, b.spin)
        self.springs = {tuple(key): spring for key, spring in state["springs"]}
        self.previous = {point: tuple(position) for point, position in state["previous"]}
        self.friction_work, self.applied, self.impulse = state["books"]


if __name__ == "__main__":
    sys.exit(serve_dem(Discs()))
