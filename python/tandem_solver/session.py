"""Drives a solver through a session, in the only order there is (PROTOCOL.md sections 2 and 5): what both sides have in
common, and the bodies' side. The continuum's is in `continuum.py`.

A rigid-body solver is an object with

    identity                        name and version
    configure(config) -> Readiness  the object of section 10, its fields checked, or raises Refusal(key, message)
    envelopes()                     (body, x, y, reach) of all outlines at t_n
    contact(step, points, forces)   adds the contacts of the points (ledger.Point) at t_n to the forces (ledger.Forces);
                                    raises Fault
    advance(step)                   moves the bodies to t_{n+1}; not called in the opening step

The driver keeps the ledger, measures how far surfaces move, and makes the limits. It asks for more where there is more:

    bodies()                        a ledger.Motion of each body, velocities at t_{n-1/2}: needed where forces move one
    capabilities                    what it can do and what it takes, for Hello (section 12)

`contact` may return Limits with what the driver does not know, such as those of springs between bodies. Where bodies do more
to each other than the driver's ledger sees, `measurement()` gives the solver's own Measurement of the last step with
`step.measure`.

If its capabilities have `save` (clauses K-3, K-4), so that a run can go on from a checkpoint,

    save() -> state                 before a step: lists, dictionaries (their keys texts), numbers and texts, as JSON has them
    restore(state)                  such a state, in a solver of the same configuration that has done no step; raises
                                    Refusal("restore", message)

What is restored goes on to the same bits: a number survives as it is, a tuple comes back as a list.
"""

import ctypes
import json
import os
import signal
import sys
import time
import traceback
from dataclasses import dataclass

from . import blake3, control, wire
from .config import BODY, DEM, check_fields
from .channel import Aborted, CouplerGone, Run, SessionError, wait
from .contact import Shape
from .ledger import BodyLedger, Point

# Longest wait in s for the coupler while a session is set up or closed (clause S-11).
SETUP = 120.0
# Most bytes of a piece of a saved state (clause K-3).
PIECE = 1 << 20


@dataclass(frozen=True)
class Step:
    """One step from t_n to t_{n+1} (section 5); times in s."""

    index: int
    time: float
    dt_before: float
    dt: float
    measure: bool

    @property
    def opening(self):
        """Clause T-3: nothing may move, no trace may stay."""
        return self.dt_before == 0.0 and self.dt == 0.0

    @property
    def kick(self):
        return 0.5 * (self.dt_before + self.dt)

    @property
    def centring(self):
        whole = self.dt_before + self.dt
        return self.dt_before / whole if whole > 0.0 else 0.0


@dataclass
class Measurement:
    """Section 9: the ledger and one BodyState for each body, or one GroupState for each group of points."""

    ledger: wire.Ledger
    items: list


class _Stopwatch:
    def __init__(self):
        self.spent, self.last = {"compute": 0, "exchange": 0, "wait": 0}, time.perf_counter_ns()

    def lap(self, activity):
        now = time.perf_counter_ns()
        self.spent[activity] += now - self.last
        self.last = now


class Seat:
    """A solver's end of its lines; a side adds its own lines (`open`), its steps (`window`) and its end (`drain`)."""

    PARTY: str
    OTHER: str
    # The channel of its measurement.
    RESULTS: str

    def __init__(self, run, solver):
        self.run, self.solver, self.watch, self.step = run, solver, _Stopwatch(), 0
        self.generation, self.set, self.deadline, self.ready, self.granted = 0, [], SETUP, False, False
        byte, me = ctypes.c_uint8, self.PARTY
        self.orders, self.grants = run.receiver(f"{me}/orders", byte), run.receiver(f"{me}/grants", wire.Grant)
        self.notices = run.sender(f"{me}/notices", 65536)
        self.reports = run.sender(f"{me}/reports")
        self.woken, self.coupler = run.wake("coupler", me), run.wake(me, "coupler")
        self.saves = "save" in getattr(solver, "capabilities", ())
        self.restore_in = run.receiver(f"{me}/restore", byte) if self.saves else None
        self.notify(_hello(me, solver))

    # The line to the coupler.

    def notify(self, data):
        self.notices.send(wire.StepHeader(step=self.step), len(data), data)
        self.coupler.wake()

    def broken(self, who, clause, message):
        return SessionError(f"{who} broke {clause} at step {self.step}: {message}")

    def checked(self, who, clause, record):
        field = record.fault()
        if field is not None:
            raise self.broken(who, clause, f"`{field}` of {record.NAME} is not finite, or negative where it may not be")

    def order(self):
        found = self.orders.receive()
        if found is None:
            return None
        try:
            order = control.decode_order(found[2])
        except control.DecodeError as error:
            raise self.broken("coupler", "S-1", str(error)) from None
        if isinstance(order, control.Abort):
            raise Aborted(order.reason)
        return order

    def alive(self):
        if not self.run.coupler_lives():
            raise CouplerGone(f"the coupler is gone at step {self.step}")

    def alarm(self):
        order = self.order()
        if order is not None:
            raise self.broken("coupler", "S-3", f"{order} out of turn")
        self.alive()

    def await_order(self, kind, clause):
        late = f"coupler: no {kind.__name__} at step {self.step}"
        order = wait(self.order, self.woken, self.alive, SETUP, late, self.run.held)
        if not isinstance(order, kind):
            raise self.broken("coupler", clause, f"{order}, not {kind.__name__}")
        return order

    def next(self):
        """The next grant, or None on Drain."""

        def look():
            grant = self.grants.receive()
            return grant if grant is not None else self.order()

        # The coupler waits for a solver that waits for another one.
        patience = (self.deadline if self.granted else SETUP) + 2.0
        found = wait(look, self.woken, self.alive, patience, f"coupler: no grant of step {self.step}",
                     self.run.held)
        self.watch.lap("wait")
        if isinstance(found, control.Drain):
            return None
        if not isinstance(found, tuple):
            raise self.broken("coupler", "S-3", f"{found} out of turn")
        if found[1] != 1:
            raise self.broken("coupler", "G-1", f"{found[1]} grants in one message")
        grant = wire.Grant.from_buffer_copy(found[2])
        self.checked("coupler", "G-2", grant)
        if grant.first != self.step or grant.steps == 0:
            raise self.broken("coupler", "G-3", f"steps {grant.first} + {grant.steps} granted")
        self.granted = True
        return grant

    def serve(self):
        configure = self.await_order(control.Configure, "S-4")
        try:
            config = json.loads(configure.config)
        except ValueError as error:
            raise self.broken("coupler", "S-5", str(error)) from None
        self.deadline, self.coupled = configure.deadline, configure.coupled
        state = self.awaited_state() if configure.restore else None
        self.check(config)
        readiness = self.solver.configure(config)
        self.results = self.run.sender(self.RESULTS)
        if self.coupled:
            self.other_woken = self.run.wake(self.OTHER, self.PARTY)
            self.other = self.run.wake(self.PARTY, self.OTHER)
        self.open(config)
        if self.saves:
            self.saved = self.run.sender(f"{self.PARTY}/saved")
        if state is not None:
            self.take_state(state)
        self.notify(control.ready(configure.scene_hash, readiness))
        self.ready = True
        while (grant := self.next()) is not None:
            self.frame(grant)
            if grant.flags & wire.CHECKPOINT and self.saves:
                self.send_state()
            report = self.window(grant)
            report.items = readiness.items
            if report.measured:
                measurement = self.measurement()
                report.ledger = measurement.ledger
                for item in measurement.items:
                    self.checked(self.PARTY, "R-3", item)
                data = b"".join(map(bytes, measurement.items))
                self.results.send(wire.StepHeader(step=grant.first), len(measurement.items), data)
            self.report(report)
        self.drain()
        self.notify(control.bye())
        self.await_order(control.Close, "S-3")

    # Saved states (clauses K-3, K-4).

    def carried(self):
        """What of the side itself, besides the set, has to survive."""
        return {}

    def send_state(self):
        """The state before the next step, in pieces, and the hash of them all."""
        state = {"of": self.solver.identity, "step": self.step, "generation": self.generation, "set": self.set,
                 "side": self.carried(), "solver": self.solver.save()}
        data = json.dumps(state).encode()
        self.watch.lap("compute")
        pieces = [(0, data[at : at + PIECE]) for at in range(0, len(data), PIECE)]
        for flags, piece in [*pieces, (wire.LAST, blake3.digest(data))]:
            self.saved.send(wire.StepHeader(step=self.step, flags=flags), len(piece), piece)
            self.coupler.wake()
        self.watch.lap("exchange")

    def awaited_state(self):
        """The bytes of the state to go on from."""
        if not self.saves:
            raise self.broken("coupler", "K-4", "a state to restore, and no capability `save`")
        data = b""
        while True:
            late = "coupler: no state to restore"
            header, count, piece = wait(self.restore_in.receive, self.woken, self.alarm, SETUP, late, self.run.held)
            if header.count != count:
                raise self.broken("coupler", "K-4", f"{header.count} bytes announced, {count} there")
            if header.flags & wire.LAST:
                break
            data += piece
        if piece != blake3.digest(data):
            raise self.broken("coupler", "K-4", f"the hash at the end is not that of the {len(data)} bytes before it")
        return data

    def take_state(self, data):
        """Goes on where the state was saved."""
        try:
            state = json.loads(data)
            if state["of"] != self.solver.identity:
                raise control.Refusal("restore", f"a state of `{state['of']}`, this is `{self.solver.identity}`")
            self.step, self.generation = int(state["step"]), int(state["generation"])
            self.set = [tuple(info) for info in state["set"]]
            self.solver.restore(state["solver"])
            self.recall(state["side"])
        except (ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
            raise control.Refusal("restore", f"no state of `{self.solver.identity}`: {error!r}") from None

    def recall(self, carried):
        """Takes over what [`carried`] gave."""

    def frame(self, grant):
        """Sends what a frame asks for, before the window (clauses R-5, R-6)."""

    def report(self, report):
        self.watch.lap("compute")
        spent = self.watch.spent
        report.compute_ns, report.exchange_ns, report.wait_ns = spent["compute"], spent["exchange"], spent["wait"]
        report.cpu_ns = time.process_time_ns()
        self.checked(self.PARTY, "R-2", report)
        self.reports.send(wire.StepHeader(epoch=report.epoch, step=report.next), 1, bytes(report))
        self.coupler.wake()
        self.watch.lap("exchange")

    def steps(self, grant):
        """The steps of a grant, one after the other, and how many follow in it."""
        for k in range(grant.steps):
            done = grant.steps_in_epoch + k
            dt_before = grant.dt_before_epoch if done == 0 else grant.dt
            measure = grant.flags & wire.MEASURE != 0 and k == 0
            yield Step(self.step, grant.epoch_start + done * grant.dt, dt_before, grant.dt, measure), grant.steps - k - 1

    def made(self, grant, halted, limits):
        """The report on a grant."""
        measured = grant.flags & wire.MEASURE != 0
        report = wire.Report(epoch=grant.epoch, next=self.step, halted=halted, measured=measured, limits=limits)
        report.imps, report.rebuilds = len(self.set), self.generation
        return report

    def fail(self, fault, message):
        """Last words (clause S-10)."""
        self.say_last(control.failed(self.step, fault, message))

    def say_last(self, notice):
        """Before Ready the coupler may be waiting for the other solver: until it has read this, the process that has
        said it has to be there, or only its end is seen (clause S-8)."""
        try:
            self.notify(notice)
            if not self.ready:
                wait(self.order, self.woken, self.alive, SETUP, "coupler: no Abort", self.run.held)
        except SessionError:
            pass  # Abort is what was waited for, or nobody hears


def _hello(party, solver):
    return control.hello(party, solver.identity, os.getpid(), getattr(solver, "capabilities", ()))


def allows(grant, limits):
    """Clause L-3."""
    return (
        limits.omega_sq + limits.contact_omega_sq <= grant.budget_omega_sq
        and limits.speed <= grant.budget_speed
        and limits.damping <= grant.budget_damping
    )


class _Dem(Seat):
    """The bodies' side: the steps of a grant, and the line to the continuum."""

    PARTY, OTHER, RESULTS = "dem", "mpm", "dem/bodies"

    def check(self, config):
        check_fields("dem", config, DEM)
        for i, body in enumerate(config["body"]):
            check_fields(f"dem.body.{i}", body, BODY)

    def open(self, config):
        held = all(body["motion"] == "fixed" for body in config["body"])
        if not hasattr(self.solver, "bodies"):
            if not held:
                raise control.Refusal("dem.body", "a solver that says no `bodies()` of its own takes only fixed ones")
            shapes = [Shape(i, body) for i, body in enumerate(config["body"])]
            self.held = [shape.start for shape in shapes]
        self.ledger = BodyLedger(config, self.motions())
        self.ledger.publish(self.solver.envelopes())
        if self.coupled:
            self.set_in = self.run.receiver("imp/set", wire.ImpInfo)
            self.states_in = self.run.receiver("imp/states", wire.ImpState)
            self.forces_out = self.run.sender("imp/forces")
            self.envelopes_out = self.run.sender("imp/envelopes")

    def motions(self):
        return list(self.solver.bodies()) if hasattr(self.solver, "bodies") else self.held

    def carried(self):
        return self.ledger.save()

    def recall(self, carried):
        self.ledger.restore(carried, self.motions())

    def drain(self):
        """Nothing: the end state of the bodies is the measurement of the closing step (clause D-1)."""

    def measurement(self):
        return self.solver.measurement() if hasattr(self.solver, "measurement") else Measurement(*self.ledger.measured)

    def window(self, grant):
        halted, limits = False, None
        for step, left in self.steps(grant):
            points = self.points(grant, step) if self.coupled else []
            if points is None:
                halted = True
                break
            forces = self.ledger.forces(points)
            limits = self.solver.contact(step, points, forces) or wire.Limits()
            self.check_forces(forces.on_points)
            # The bodies move before the answer: what they have done is measured.
            if not step.opening:
                self.solver.advance(step)
            self.ledger.moved(step, self.motions(), forces)
            limits = self.ledger.limits(limits, forces)
            self.watch.lap("compute")
            self.checked("dem", "L-1", limits)
            allowed = allows(grant, limits)
            if self.coupled:
                self.answer(grant, step, forces.on_points, 0 if allowed else wire.HALT_AFTER)
            self.step += 1
            if not allowed and left > 0:
                halted = True
                break
        if limits is None:
            raise self.broken("mpm", "H-1", "a halt before the first step of a window")
        return self.made(grant, halted, limits)

    def points(self, grant, step):
        """The points with their states of this step, or None if mpm halts before it."""
        while True:
            self.watch.lap("compute")
            late = f"mpm: no states of step {step.index}"
            header, count, data = wait(self.states_in.receive, self.other_woken, self.alarm, self.deadline, late,
                                       self.run.held)
            self.watch.lap("wait")
            if (header.step, header.epoch) != (step.index, grant.epoch):
                raise self.broken("mpm", "I-1", f"states of step {header.step} epoch {header.epoch}")
            if header.flags & wire.HALT_BEFORE:
                return None
            if not header.flags & wire.WANT_ENVELOPES:
                break
            vertices = self.solver.envelopes()
            if not wire.finite(vertices) or any(vertex[3] < 0.0 for vertex in vertices):
                raise self.broken("dem", "E-3", f"envelopes {vertices}")
            self.ledger.publish(vertices)
            data = b"".join(wire.EnvelopeVertex.FLAT.pack(*vertex) for vertex in vertices)
            self.envelopes_out.send(wire.StepHeader(epoch=grant.epoch, step=step.index), len(vertices), data)
            self.other.wake()
            self.watch.lap("exchange")
        if header.flags & wire.NEW_SET:
            self.take_set(header)
        if (header.set, header.count, count) != (self.generation, len(self.set), len(self.set)):
            expected = f"{len(self.set)} of set {self.generation}"
            raise self.broken("mpm", "I-3", f"{count} states of set {header.set}, {header.count} announced; expected {expected}")
        states = list(wire.ImpState.FLAT.iter_unpack(data))
        if not wire.finite(states):
            slot = next(i for i, state in enumerate(states) if not wire.finite([state]))
            raise self.broken("mpm", "I-3", f"state {slot} is not finite: {states[slot]}")
        self.watch.lap("exchange")
        return [Point(*info, *state) for info, state in zip(self.set, states)]

    def take_set(self, states):
        found = self.set_in.receive()
        if found is None:
            raise self.broken("mpm", "I-2", "no set before the states that announce it")
        header, count, data = found
        if header.set != states.set or header.set != self.generation + 1 or header.count != count:
            raise self.broken("mpm", "I-2", f"set {header.set} for states of set {states.set} after {self.generation}")
        infos = list(wire.ImpInfo.FLAT.iter_unpack(data))
        if not wire.finite(infos) or any(radius <= 0.0 or mass <= 0.0 for _, radius, mass, _, _ in infos):
            raise self.broken("mpm", "I-2", "radius and mass must be positive and finite")
        if any(a[0] >= b[0] for a, b in zip(infos, infos[1:])):
            raise self.broken("mpm", "I-2", "ids must rise")
        self.generation, self.set = header.set, infos

    def check_forces(self, forces):
        if len(forces) != len(self.set):
            raise self.broken("dem", "F-3", f"{len(forces)} forces for {len(self.set)} IMPs")
        if not wire.finite(forces) or any(min(force[3:]) < 0.0 for force in forces):
            slot = next(i for i, force in enumerate(forces) if not wire.finite([force]) or min(force[3:]) < 0.0)
            message = f"force {slot} is not finite, or its stiffness negative: {forces[slot]}"
            raise self.broken("dem", "F-4", message)

    def answer(self, grant, step, forces, halt):
        header = wire.StepHeader(epoch=grant.epoch, step=step.index, flags=halt, travel=self.ledger.travel())
        header.set = self.generation
        self.checked("dem", "F-4", header)
        self.forces_out.send(header, len(forces), b"".join(wire.ImpForce.FLAT.pack(*force) for force in forces))
        self.other.wake()
        self.watch.lap("exchange")


def serve_dem(solver, arguments=None):
    """Joins the run that the arguments (`--join ID`) name, serves until it is closed; returns the exit status (X-2)."""
    return serve(_Dem, solver, arguments)


def _say_on_the_wrong_side(run_id, expected, hello):
    """Clause O-1: says Hello where the coupler listens for another party, and waits for the end of the session."""
    run = Run(run_id, expected)
    notices, coupler = run.sender(f"{expected}/notices", 65536), run.wake(expected, "coupler")
    notices.send(wire.StepHeader(), len(hello), hello)
    coupler.wake()
    end = time.monotonic() + 2.0
    while run.coupler_lives() and time.monotonic() < end:
        time.sleep(0.01)


def serve(side, solver, arguments):
    """As [`serve_dem`], for any side."""
    arguments = sys.argv[1:] if arguments is None else arguments
    if len(arguments) != 2 or arguments[0] != "--join":
        print("error: a solver is started by `tandem run`, or by hand with `--join RUN`", file=sys.stderr)
        return 2
    # Clause X-5: Ctrl-C is the coupler's.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    session = None
    expected = os.environ.get("TANDEM_PARTY", side.PARTY)
    try:
        if expected != side.PARTY:
            _say_on_the_wrong_side(arguments[1], expected, _hello(side.PARTY, solver))
            return 3
        session = side(Run(arguments[1], side.PARTY), solver)
        session.serve()
        return 0
    except control.Refusal as refusal:
        session.say_last(control.refused(refusal))
    except (Aborted, CouplerGone):
        pass
    except control.Fault as fault:
        session.fail(fault, str(fault))
    except Exception as error:  # whatever it is, the coupler shall know before this process ends
        if isinstance(error, SessionError) and session is None:
            print(f"error: {error}", file=sys.stderr)
        elif session is None:
            hint = "who computes bodies belongs to --dem, a continuum to --mpm"
            print(f"error: the {side.PARTY} cannot join the run: {error} ({hint})", file=sys.stderr)
        else:
            told = isinstance(error, SessionError)
            session.fail(None, str(error) if told else f"{type(error).__name__}: {error}")
            if not told:
                traceback.print_exc()
    return 3
