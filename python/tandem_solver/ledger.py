"""What the driver keeps for a bodies' side: the forces of a step, the ledger of section 9, and how far surfaces have moved."""

import math
from typing import NamedTuple

from . import wire
from .control import NotFinite


class Point(NamedTuple):
    """An identified point: what the set says of it, and its state (position at t_n, velocity at t_{n-1/2})."""

    id: int
    radius: float
    mass: float
    group: int
    next: int
    x: float
    y: float
    vx: float
    vy: float
    spin: float


class Motion(NamedTuple):
    """A body: its centre of mass (m) and angle (rad) at t_n, velocities at t_{n-1/2}, mass (kg/m), moment of inertia (kg m)."""

    x: float
    y: float
    angle: float
    vx: float
    vy: float
    spin: float
    mass: float
    inertia: float

    def finite(self):
        return all(map(math.isfinite, self))


class Load:
    """What the points do to a body: force (N/m), torque (N), how many press, and the bounds of L-2."""

    __slots__ = ("fx", "fy", "torque", "contacts", "rate", "mobility", "x", "y", "w", "wi")

    def __init__(self, motion, yielding):
        self.fx = self.fy = self.torque = self.rate = self.mobility = 0.0
        self.contacts, self.x, self.y = 0, motion.x, motion.y
        # Inverse mass and inertia: 0 for a body that forces do not move.
        self.w, self.wi = max(yielding[:2]) / motion.mass, yielding[2] / motion.inertia


class Forces:
    """The forces of a step. A solver adds each contact of a point with a body, once."""

    def __init__(self, points, motions, yielding):
        # Force, couple, stiffness, tangential stiffness of each point.
        self.points, self.on_points = points, [[0.0] * 5 for _ in points]
        self.on_bodies = [Load(motion, yields) for motion, yields in zip(motions, yielding)]
        # Energy in springs at t_n, what sliding and dashpots dissipated over the last step (J/m); largest damping ratio.
        self.stored = self.slid = self.damped = self.damping = 0.0

    def add(self, slot, body, at, force, stiffness, normal=None, tangential=0.0, stored=None):
        """Force (N/m) of body `body` on the point `slot`, which acts at the place `at`; the body gets the negative (F-7).

        `stiffness` (N/m) counts from an overlap of -r_p/2 on, where the force is still (0, 0) (F-6). With the unit normal
        and the tangential stiffness the bound of L-2 is exact, without the normal it is one for any. Where a point has a
        tangential stiffness the moment of the force about it counts too (F-7). The energy in the springs is that of a linear
        one, unless `stored` (J/m) says another.
        """
        (fx, fy), point, load = force, self.on_points[slot], self.on_bodies[body]
        point[0] += fx
        point[1] += fy
        point[3] += stiffness
        point[4] += tangential
        if point[4] > 0.0:
            of = self.points[slot]
            point[2] += (at[0] - of.x) * fy - (at[1] - of.y) * fx
        rx, ry = at[0] - load.x, at[1] - load.y
        if stored is None:
            stored = (fx * fx + fy * fy) / (2.0 * stiffness) if fx or fy else 0.0
        if fx or fy or stored:  # a dashpot may hold a spring without a force
            load.fx -= fx
            load.fy -= fy
            load.torque -= rx * fy - ry * fx
            load.contacts += 1
            self.stored += stored
        nx, ny = normal or (0.0, 0.0)
        mobility = load.w + load.wi * ((rx * ny - ry * nx) ** 2 if normal else rx * rx + ry * ry)
        load.mobility += mobility if stiffness else 0.0
        load.rate += stiffness * mobility + tangential * (load.w + load.wi * (rx * nx + ry * ny) ** 2)


def _yielding(motion):
    """1 along x, along y and for the angle where forces move a body, 0 where they do not."""
    if isinstance(motion, dict) and "guided" in motion:
        return tuple(0.0 if motion["guided"][hold] else 1.0 for hold in ("hold_x", "hold_y", "hold_angle"))
    return (0.0,) * 3 if motion in ("fixed", "driven") else (1.0,) * 3


def _push(motion, step):
    """External force (N/m) along x and y, and torque (N): their means over the kick."""
    push = motion.get("pushed") if isinstance(motion, dict) else None
    if push is None:
        return (0.0,) * 3
    start, stop = max(step.time - 0.5 * step.dt_before, 0.0), step.time + 0.5 * step.dt
    ramp, until = push["ramp"], math.inf if push["until"] is None else push["until"]
    if start >= ramp and stop <= until:
        share = 1.0
    elif start >= until or stop <= start:
        share = 0.0
    else:  # it grows up to the knee, then it is full up to the end
        end = min(stop, until)
        knee = max(min(end, ramp), start)
        grown = (knee - start) * 0.5 * (start + knee) / ramp if knee > start else 0.0
        share = (grown + (end - knee)) / (stop - start)
    return tuple(share * part for part in (*push["force"], push["torque"]))


class BodyLedger:
    """Follows bodies from what passes through the driver: their motions before and after each step, and the forces."""

    def __init__(self, config, motions):
        self.gravity, self.motions = config["gravity"], motions
        self.names = [body["name"] for body in config["body"]]
        self.kinds = [body["motion"] for body in config["body"]]
        self.yielding = [_yielding(kind) for kind in self.kinds]
        # Of each body, when its envelope was last asked for: place and angle; how far its surface reaches.
        self.published, self.extents = motions, [0.0] * len(motions)
        # So far: friction, dashpots, driven bodies (J/m); applied impulse (N s/m) with its moment (N s), that of the points.
        self.totals, self.measured = [0.0] * 9, None

    def forces(self, points):
        return Forces(points, self.motions, self.yielding)

    def publish(self, vertices):
        self.published, self.extents = self.motions, [0.0] * len(self.motions)
        for body, x, y, reach in vertices:
            here = self.motions[body]
            self.extents[body] = max(self.extents[body], math.hypot(x - here.x, y - here.y) + reach)

    def limits(self, limits, forces):
        """The solver's limits, with what follows from the motion and the forces."""
        for load in forces.on_bodies:
            limits.contact_omega_sq = max(limits.contact_omega_sq, load.rate)
            limits.mobility = max(limits.mobility, load.mobility)
        speeds = (math.hypot(m.vx, m.vy) + abs(m.spin) * extent for m, extent in zip(self.motions, self.extents))
        limits.speed = max(limits.speed, max(speeds, default=0.0))
        limits.damping = max(limits.damping, forces.damping)
        return limits

    def travel(self):
        """Largest displacement of a surface since the envelopes were asked for, m (F-9)."""
        bodies = zip(self.motions, self.published, self.extents)
        ways = (math.hypot(m.x - p.x, m.y - p.y) + abs(m.angle - p.angle) * extent for m, p, extent in bodies)
        return max(ways, default=0.0)

    def moved(self, step, motions, forces):
        """The bodies have made the step and are now as `motions` say."""
        for index, motion in enumerate(motions):
            if not motion.finite():
                raise NotFinite("velocity", f"body {index} ({self.names[index]})")
        totals = list(self.totals)
        totals[0] += forces.slid
        totals[1] += forces.damped
        before_kick = totals[2]
        rows = list(zip(self.motions, motions, forces.on_bodies, self.yielding, self.kinds))
        for before, after, load, yields, kind in rows:
            self._add_impulses(totals, step, before, after, load, yields, kind)
        if step.measure:
            # Half of a kick belongs to the time before t_n.
            share = 0.5 * step.dt_before / step.kick if step.kick > 0.0 else 0.0
            self.measured = self._measure(step, totals, before_kick + share * (totals[2] - before_kick), forces, rows)
        if not step.opening:
            self.totals, self.motions = totals, motions

    def _add_impulses(self, totals, step, before, after, load, yields, kind):
        """Of what acts from outside: weight, pushes, and what guides and holds the body; and of the points."""
        push, weight = _push(kind, step), before.mass if any(yields) else 0.0
        inner = (load.fx + weight * self.gravity[0], load.fy + weight * self.gravity[1], load.torque)
        velocities = ((before.vx, after.vx), (before.vy, after.vy), (before.spin, after.spin))
        for axis, ((v0, v1), free) in enumerate(zip(velocities, yields)):
            guide = -(inner[axis] + push[axis]) * (1.0 - free)
            totals[2] += step.kick * (push[axis] + guide) * 0.5 * (v0 + v1)
            fall = weight * self.gravity[axis] if axis < 2 else 0.0
            # Along x and y, then about the centre: of all, and of the points.
            for k, force in ((3, fall + push[axis] + guide), (6, (load.fx, load.fy, load.torque)[axis])):
                totals[k + axis] += step.kick * force
                totals[k + 2] += step.kick * force * (-before.y, before.x, 0.0)[axis]

    def _measure(self, step, totals, driven, forces, rows):
        w = step.centring
        ledger = wire.Ledger(contact=forces.stored, friction_work=totals[0], viscous_work=totals[1], driven_work=driven)
        ledger.applied_impulse[:], ledger.contact_impulse[:] = totals[3:5], totals[6:8]
        ledger.applied_moment, ledger.contact_moment = totals[5], totals[8]
        bodies = []
        for before, after, load, yields, _ in rows:
            mean = [(1.0 - w) * p + w * q for p, q in zip(before[3:6], after[3:6])]
            if any(yields):
                square = [(1.0 - w) * p * p + w * q * q for p, q in zip(before[3:6], after[3:6])]
                ledger.kinetic += 0.5 * before.mass * (square[0] + square[1])
                ledger.kinetic_rotation += 0.5 * before.inertia * square[2]
                ledger.gravity -= before.mass * (self.gravity[0] * before.x + self.gravity[1] * before.y)
                ledger.momentum[0] += before.mass * after.vx
                ledger.momentum[1] += before.mass * after.vy
                turning = before.mass * (before.x * after.vy - before.y * after.vx)
                ledger.angular_momentum += turning + before.inertia * after.spin
            ledger.contact_force[0] += load.fx
            ledger.contact_force[1] += load.fy
            ledger.contacts += load.contacts > 0
            state = wire.BodyState(position=before[:2], velocity=tuple(mean[:2]), angle=before.angle, spin=mean[2])
            state.mass, state.inertia = before.mass, before.inertia
            state.point_force, state.point_torque, state.contacts = (load.fx, load.fy), load.torque, load.contacts
            bodies.append(state)
        return ledger, bodies

    def save(self):
        return {"totals": self.totals, "published": self.published, "extents": self.extents}

    def restore(self, state, motions):
        self.totals, self.extents, self.motions = state["totals"], state["extents"], motions
        self.published = [Motion(*motion) for motion in state["published"]]
