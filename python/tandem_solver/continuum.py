"""The continuum's side of a session (PROTOCOL.md sections 5 to 7); `session.py` has what both sides have in common.

A continuum solver is an object with

    identity                        name and version
    capabilities                    what it can do and what it takes, for Hello (section 12); may be left out
    configure(config) -> Readiness  the object of section 10, defaults filled in, or raises Refusal(key, message)
    select(envelopes) -> infos      (body, x, y, reach) of all outlines; who is identified from now on (clause I-7):
                                    (id, radius, mass, group, 0), ids rising; the origin of travel
    travel()                        upper bound of any point's displacement since the last selection, m
    states()                        (x, y, vx, vy) of those who are identified, as they were selected
    step(step, forces) -> Limits    to t_{n+1}; `forces()` is called once and gives (fx, fy, stiffness) of each slot
    measurement() -> Measurement    of the last step with `step.measure`
    points()                        of all points, ids rising: (id, x, y, vx, vy, xx, yy, zz, xy, volume, mass, group),
                                    stresses in Pa, volume in m^2, mass in kg/m; with the capability `plastic_strain`
                                    (clause R-5) that strain is one number more

and `save` and `restore` as in `session.py`, if it has the capability; who is identified, and the travel, are its own to save.
"""

import math

from . import wire
from .channel import wait
from .config import GROUP, MPM, check_fields
from .session import Seat, allows, serve


class _Mpm(Seat):
    """The continuum's side: the steps of a grant, and the line to the bodies."""

    PARTY, OTHER, RESULTS = "mpm", "dem", "mpm/groups"

    def check(self, config):
        check_fields("mpm", config, MPM)
        for i, group in enumerate(config["points"]):
            check_fields(f"mpm.points.{i}", group, GROUP)

    def measurement(self):
        return self.solver.measurement()

    def open(self, config):
        self.points_out = self.run.sender("mpm/points")
        if self.coupled:
            self.set_out = self.run.sender("imp/set")
            self.states_out = self.run.sender("imp/states")
            self.forces_in = self.run.receiver("imp/forces", wire.ImpForce)
            self.envelopes_in = self.run.receiver("imp/envelopes", wire.EnvelopeVertex)
            radii = [group["contact_radius"] for group in config["points"] if group["contact_radius"] is not None]
            # Clause I-6. Any point may become identified: the kinematic limit counts them all.
            self.allowed_travel = config["skin"] - 0.5 * max(radii, default=0.0)
            self.radius_min = min(radii, default=0.0)
            self.fastest = max((math.hypot(*point[3:5]) for point in self.solver.points()), default=0.0)
            self.bodies_travel, self.halt_after = 0.0, False

    def carried(self):
        return {"fastest": self.fastest, "travel": self.bodies_travel} if self.coupled else {}

    def recall(self, carried):
        if self.coupled:
            self.fastest, self.bodies_travel = float(carried["fastest"]), float(carried["travel"])

    def frame(self, grant):
        if grant.flags & wire.FRAME:
            self.send_points("R-5")

    def drain(self):
        """All points that are left (clause D-1)."""
        self.send_points("D-1")

    def send_points(self, clause):
        """The whole cloud as it is before the next step."""
        points = self.solver.points()
        if not wire.finite(points) or any(min(point[9:11]) < 0.0 for point in points):
            raise self.broken("mpm", clause, "a point's state is not finite, or its volume or mass negative")
        if any(min(point[12:], default=0.0) < 0.0 for point in points):
            raise self.broken("mpm", clause, "the plastic strain of a point is negative")
        data = b"".join(map(wire.pack_point, points))
        self.points_out.send(wire.StepHeader(step=self.step), len(points), data)

    def window(self, grant):
        halted, limits = False, None
        for step, left in self.steps(grant):
            if limits is not None and not allows(grant, limits):
                halted = True
                if self.coupled:
                    self.say(grant, wire.HALT_BEFORE)
                break
            limits = self.coupled_step(grant, step) if self.coupled else self.solver.step(step, lambda: [])
            self.checked("mpm", "L-1", limits)
            self.step += 1
            if self.coupled and self.halt_after and left > 0:
                halted = True
                break
        return self.made(grant, halted, limits)

    def header(self, grant, flags):
        return wire.StepHeader(epoch=grant.epoch, step=self.step, flags=flags, set=self.generation)

    def say(self, grant, flags):
        """A message without states."""
        self.watch.lap("compute")
        self.states_out.send(self.header(grant, flags), 0, b"")
        self.other.wake()
        self.watch.lap("exchange")

    def coupled_step(self, grant, step):
        new_set = self.generation == 0 or self.solver.travel() + self.bodies_travel > self.allowed_travel
        if new_set:
            self.rebuild(grant)
        before, states = self.solver.travel(), self.solver.states()
        self.watch.lap("compute")
        if len(states) != len(self.set) or not wire.finite(states):
            raise self.broken("mpm", "I-3", f"{len(states)} states of {len(self.set)} points, or one is not finite")
        data = b"".join(wire.ImpState.FLAT.pack(*state) for state in states)
        self.states_out.send(self.header(grant, wire.NEW_SET if new_set else 0), len(states), data)
        self.other.wake()
        self.watch.lap("exchange")
        taken = []

        def forces():
            if taken:
                raise self.broken("mpm", "F-1", "the forces were taken twice")
            taken.append(self.forces(grant))
            return taken[0]

        limits = self.solver.step(step, forces)
        self.watch.lap("compute")
        if not taken:
            raise self.broken("mpm", "F-1", "the contact forces were not taken")
        if step.dt > 0.0:
            self.fastest = (self.solver.travel() - before) / step.dt
        limits.speed, limits.radius_min = max(limits.speed, self.fastest), self.radius_min
        return limits

    def rebuild(self, grant):
        """Chooses the set anew from the bodies' present envelopes and announces it."""
        self.say(grant, wire.WANT_ENVELOPES)
        header, count, data = self.awaited(self.envelopes_in, "envelopes")
        if (header.step, header.epoch, header.count) != (self.step, grant.epoch, count):
            raise self.broken("dem", "E-2", f"{count} envelopes of step {header.step}, {header.count} announced")
        envelopes = list(wire.EnvelopeVertex.FLAT.iter_unpack(data))
        if not wire.finite(envelopes) or any(vertex[3] < 0.0 for vertex in envelopes):
            raise self.broken("dem", "E-3", "an envelope is not finite, or its reach negative")
        self.set = self.solver.select(envelopes)
        self.generation, self.bodies_travel = self.generation + 1, 0.0
        rising = all(a[0] < b[0] for a, b in zip(self.set, self.set[1:]))
        if not (rising and wire.finite(self.set) and all(info[1] > 0.0 and info[2] > 0.0 for info in self.set)):
            raise self.broken("mpm", "I-2", "ids must rise, radius and mass must be positive and finite")
        self.watch.lap("compute")
        data = b"".join(wire.ImpInfo.FLAT.pack(*info) for info in self.set)
        self.set_out.send(self.header(grant, wire.NEW_SET), len(self.set), data)
        self.watch.lap("exchange")

    def awaited(self, receiver, what):
        late = f"dem: no {what} of step {self.step}"
        self.watch.lap("compute")
        found = wait(receiver.receive, self.other_woken, self.alarm, self.deadline, late, self.run.held)
        self.watch.lap("wait")
        return found

    def forces(self, grant):
        """The bodies' answer to the states of this step."""
        header, count, data = self.awaited(self.forces_in, "forces")
        if (header.step, header.epoch) != (self.step, grant.epoch):
            raise self.broken("dem", "F-2", f"forces of step {header.step} epoch {header.epoch}")
        if (header.set, header.count, count) != (self.generation, len(self.set), len(self.set)):
            raise self.broken("dem", "F-3", f"{count} forces for set {header.set}, {header.count} announced; expected {len(self.set)}")
        self.checked("dem", "F-4", header)
        forces = list(wire.ImpForce.FLAT.iter_unpack(data))
        if not wire.finite(forces):
            raise self.broken("dem", "F-4", "a force is not finite")
        for slot, (fx, fy, couple, stiffness, tangential) in enumerate(forces):
            bare = (stiffness == 0.0 and (fx, fy) != (0.0, 0.0)) or (tangential == 0.0 and couple != 0.0)
            if stiffness < 0.0 or tangential < 0.0 or bare:
                raise self.broken("dem", "F-5", f"slot {slot}: a force without a stiffness")
        self.bodies_travel, self.halt_after = header.travel, header.flags & wire.HALT_AFTER != 0
        self.watch.lap("exchange")
        return forces


def serve_mpm(solver, arguments=None):
    """Joins the run that the arguments (`--join ID`) name, serves until it is closed; returns the exit status (X-2)."""
    return serve(_Mpm, solver, arguments)
