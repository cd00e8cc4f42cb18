"""Points joined by springs against the bodies: a continuum's side for Tandem in one file, without a grid.

    tandem run scenes/jiang2020/collision_hard.toml --variant quick --mpm "python3 python/examples/springs_mpm.py" \\
        --set mpm.material.0.model.linear_elastic.shear_modulus=3e6

A square lattice with springs k = 2 G along its sides and G along its diagonals is an elastic solid with lambda = G, so
only materials with K = 5/3 G are taken. What belongs to a grid (shape, transfer and so on) is not used, and said so.
"""

import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # runs without having been installed

from tandem_solver import Fault, GroupState, Ledger, Limits, Measurement, NotFinite  # noqa: E402
from tandem_solver import Readiness, Refusal, serve_mpm  # noqa: E402

# What a lattice of springs has no use for: the only value of each that is accepted.
PLAIN = {
    "forcing": {"body_force": None, "traction": [], "hold": [], "stage": []},
    "grid_contact": None,
    "contact_force": "point",
    "leaving": "stop",
    "plane": "strain",
    "probe": [],
    "walls": dict.fromkeys(("left", "right", "bottom", "top"), "open"),
    "layers": False,
    "interface": "points",
}


def distance(outline, x, y):
    """Distance of a point from an outline, 0 within a polygon."""
    best, inside, n = math.inf, False, len(outline)
    for (ax, ay), (bx, by) in zip(outline, outline[1:] + outline[:1]):
        ex, ey = bx - ax, by - ay
        length = ex * ex + ey * ey
        s = min(1.0, max(0.0, ((x - ax) * ex + (y - ay) * ey) / length)) if length > 0.0 else 0.0
        best = min(best, math.hypot(x - ax - s * ex, y - ay - s * ey))
        if (ay > y) != (by > y):
            inside ^= x < ax + (y - ay) / ey * ex
    return 0.0 if inside and n > 2 else best


def lattice(fill, spacing, cell):
    """Distance of the points in m, and their positions by row and column; none where it is no square lattice."""
    h, places = spacing.get("distance") or cell / math.sqrt(spacing.get("per_cell", 1.0)), {}
    if "rectangle" in fill:
        (left, bottom), (right, top) = fill["rectangle"]["lower"], fill["rectangle"]["upper"]
        columns, rows = spacing.get("counts") or (round((right - left) / h), round((top - bottom) / h))
        h = (right - left) / columns
        if abs((top - bottom) / rows - h) <= 1e-9 * h:
            boxes = [(row, column) for row in range(rows) for column in range(columns)]
            places = {(r, c): (left + (c + 0.5) * h, bottom + (r + 0.5) * h) for r, c in boxes}
    elif "disc" in fill and "counts" not in spacing:
        (x, y), radius = fill["disc"]["center"], fill["disc"]["radius"]
        n = math.ceil(radius / h)
        boxes = [(row, column) for row in range(-n, n) for column in range(-n, n)]
        within = [(r, c) for r, c in boxes if math.hypot((c + 0.5) * h, (r + 0.5) * h) <= radius]
        places = {(r, c): (x + (c + 0.5) * h, y + (r + 0.5) * h) for r, c in within}
    elif "points" in fill and "counts" not in spacing:  # nobody's neighbours
        places = {(2 * i, 2 * i): tuple(at) for i, at in enumerate(fill["points"]["positions"])}
    return h, places


class Springs:
    """Positions `x` at t_n, velocities `v` at t_{n-1/2}, by point; ids are their places in these lists."""

    identity = "springs_mpm 0.1"
    capabilities = ("material:linear_elastic", "fill:disc", "fill:rectangle", "fill:points", "wall:open", "plane:strain")
    capabilities += ("contact_force:point", "feature:no_grid", "save")

    def configure(self, config):
        for key, accepted in PLAIN.items():
            if config[key] != accepted:
                raise Refusal(f"mpm.{key}", f"there is no grid here: {accepted} is accepted")
        self.domain, self.gravity, self.skin = config["domain"], config["gravity"], config["skin"]
        self.x, self.v, self.mass, self.volume, self.radius, self.group, self.springs = [], [], [], [], [], [], []
        if not config["cell"] > 0.0:
            raise Refusal("mpm.cell", f"{config['cell']} m: expected a positive length")
        self.courant_time = math.inf
        for index, group in enumerate(config["points"]):
            if group["material"] >= len(config["material"]):
                raise Refusal(f"mpm.points.{index}.material", f"there is no material {group['material']}")
            self.fill(index, group, config["material"][group["material"]], config["cell"])
        self.count = len(config["points"])
        stiffness = [0.0] * len(self.x)
        for i, j, _, k in self.springs:
            stiffness[i] += k
            stiffness[j] += k
        # Gershgorin: a row of K has 2 k of each spring.
        self.omega_sq = max(2.0 * k / m for k, m in zip(stiffness, self.mass))
        self.selected, self.travelled, self.impulse, self.fallen = [], 0.0, [0.0] * 4, 0.0
        notes = [
            "no grid: cell is for spacing only; shape, transfer and stress_update are not used; one thread",
            "points do not turn: friction acts at their centres, so angular momentum changes by its couples",
        ]
        return Readiness(items=len(self.x), mass_min=min(self.mass), courant_time=self.courant_time, notes=notes)

    def fill(self, index, group, material, cell):
        key = f"mpm.points.{index}"
        model = material["model"].get("linear_elastic")
        if model is None or abs(model["bulk_modulus"] / model["shear_modulus"] - 5.0 / 3.0) > 1e-9:
            raise Refusal(f"{key}.material", "springs are `linear_elastic` with bulk_modulus = 5/3 shear_modulus")
        wave = math.sqrt(3.0 * model["shear_modulus"] / material["density"])  # K + 4/3 G = 3 G
        self.courant_time = min(self.courant_time, cell / wave)
        if group["lattice"] != "grid":
            raise Refusal(f"{key}.lattice", "only \"grid\" is known here")
        if any(group["fields"].values()):
            raise Refusal(key, "initial fields are not known here")
        h, places = lattice(group["fill"], group["spacing"], cell)
        if not places:
            raise Refusal(f"{key}.fill", "only `disc`, `points` and `rectangle`, with points as far apart along x as along y")
        first, added = len(self.x), len(places)
        at = {place: first + i for i, place in enumerate(places)}
        self.x += places.values()
        self.v += [tuple(group["velocity"])] * added
        self.mass += [material["density"] * h * h] * added
        self.volume += [h * h] * added
        self.radius += [group["contact_radius"] or 0.5 * h] * added
        self.group += [index] * added
        for (row, column), i in at.items():
            for to, length, k in (((0, 1), h, 2.0), ((1, 0), h, 2.0), ((1, 1), None, 1.0), ((1, -1), None, 1.0)):
                j = at.get((row + to[0], column + to[1]))
                if j is not None:
                    self.springs.append((i, j, length or math.sqrt(2.0) * h, k * model["shear_modulus"]))

    def select(self, envelopes):
        bodies = {}
        for body, x, y, reach in envelopes:
            bodies.setdefault(body, ([], reach))[0].append((x, y))
        self.travelled = 0.0
        near = [
            any(distance(outline, *x) <= reach + r + self.skin for outline, reach in bodies.values())
            for x, r in zip(self.x, self.radius)
        ]
        self.selected = [i for i, is_near in enumerate(near) if is_near]
        return [(i, self.radius[i], self.mass[i], self.group[i], 0) for i in self.selected]

    def travel(self):
        return self.travelled

    def states(self):
        return [(*self.x[i], *self.v[i], 0.0) for i in self.selected]

    def step(self, step, forces):
        force, elastic = [[0.0, 0.0] for _ in self.x], 0.0
        for i, j, length, k in self.springs:
            dx, dy = self.x[j][0] - self.x[i][0], self.x[j][1] - self.x[i][1]
            now = math.hypot(dx, dy)
            pull = k * (now - length) / now
            elastic += 0.5 * k * (now - length) ** 2
            force[i][0] += pull * dx
            force[i][1] += pull * dy
            force[j][0] -= pull * dx
            force[j][1] -= pull * dy
        taken = list(zip(self.selected, forces()))
        rate = 0.0
        for i, (fx, fy, _, stiffness, tangential) in taken:
            force[i][0] += fx
            force[i][1] += fy
            rate = max(rate, max(stiffness, tangential) / self.mass[i])
        (gx, gy), kick = self.gravity, step.kick
        kicked = [
            (vx + (fx / m + gx) * kick, vy + (fy / m + gy) * kick)
            for (vx, vy), (fx, fy), m in zip(self.v, force, self.mass)
        ]
        push = [sum(f[axis] for _, f in taken) for axis in range(2)]
        # The moments about the origin of the bodies' forces, and of the weights.
        push.append(sum(self.x[i][0] * f[1] - self.x[i][1] * f[0] for i, f in taken))
        push.append(sum(m * (x * gy - y * gx) for (x, y), m in zip(self.x, self.mass)))
        impulse = [before + kick * f for before, f in zip(self.impulse, push)]
        fallen = self.fallen + kick
        if step.measure:
            self.measure(step.centring, kicked, elastic, taken, push, impulse, fallen)
        fastest = max(math.hypot(*v) for v in kicked)
        if not math.isfinite(fastest):
            point = next(i for i, v in enumerate(kicked) if not math.isfinite(math.hypot(*v)))
            raise NotFinite("velocity", f"point {point}")
        if not step.opening:
            self.v, self.impulse, self.fallen = kicked, impulse, fallen
            self.x = [(x + vx * step.dt, y + vy * step.dt) for (x, y), (vx, vy) in zip(self.x, kicked)]
            self.travelled += fastest * step.dt
            lower, upper = self.domain
            for i, x in enumerate(self.x):
                if not all(low <= c <= high for low, c, high in zip(lower, x, upper)):
                    raise Fault(f"point {i} left the domain at {x} m")
        mobility = max((1.0 / self.mass[i] for i in self.selected), default=0.0)
        return Limits(omega_sq=self.omega_sq, contact_omega_sq=rate, speed=fastest, mobility=mobility)

    def measure(self, w, kicked, elastic, taken, push, impulse, fallen):
        ledger, groups = Ledger(elastic=elastic, contact_force=tuple(push[:2]), contact_impulse=tuple(impulse[:2])), []
        ledger.contact_moment, ledger.applied_moment = impulse[2:]
        ledger.contacts = sum((fx, fy) != (0.0, 0.0) for _, (fx, fy, *_) in taken)
        for g in range(self.count):
            state = GroupState(lower=(math.inf,) * 2, upper=(-math.inf,) * 2)
            for i in (i for i, group in enumerate(self.group) if group == g):
                m, x, before, after = self.mass[i], self.x[i], self.v[i], kicked[i]
                state.mass += m
                ledger.angular_momentum += m * (x[0] * after[1] - x[1] * after[0])
                for axis in range(2):
                    state.position[axis] += m * x[axis]
                    state.velocity[axis] += m * ((1.0 - w) * before[axis] + w * after[axis])
                    state.kinetic += 0.5 * m * ((1.0 - w) * before[axis] ** 2 + w * after[axis] ** 2)
                    state.lower[axis] = min(state.lower[axis], x[axis])
                    state.upper[axis] = max(state.upper[axis], x[axis])
                    ledger.momentum[axis] += m * after[axis]
                    ledger.gravity -= m * self.gravity[axis] * x[axis]
                    ledger.applied_impulse[axis] += m * self.gravity[axis] * fallen
            for axis in range(2):
                state.position[axis] /= state.mass
                state.velocity[axis] /= state.mass
            pressed = [(i, f) for i, f in taken if self.group[i] == g and f[:2] != (0.0, 0.0)]
            state.contacts = len(pressed)
            for axis in range(2) if pressed else ():
                places = [self.x[i][axis] for i, _ in pressed]
                state.contact_force[axis] = sum(f[axis] for _, f in pressed)
                state.loaded_lower[axis], state.loaded_upper[axis] = min(places), max(places)
            ledger.kinetic += state.kinetic
            groups.append(state)
        self.measured = Measurement(ledger, groups)

    def measurement(self):
        return self.measured

    def save(self):
        """What the next step reads before it writes it; the springs are of the configuration."""
        return [self.x, self.v, self.selected, self.travelled, self.impulse, self.fallen]

    def restore(self, state):
        x, v, self.selected, self.travelled, self.impulse, self.fallen = state
        if not len(x) == len(v) == len(self.x) or not all(0 <= i < len(x) for i in self.selected):
            raise Refusal("restore", f"a state of {len(x)} points, here are {len(self.x)}")
        self.x, self.v = [tuple(at) for at in x], [tuple(velocity) for velocity in v]

    def points(self):
        """With the stress of the springs that meet at a point: half the sum of pull times span, over its volume. Out of
        the plane lambda = G has a quarter of xx + yy."""
        virial = [[0.0, 0.0, 0.0] for _ in self.x]
        for i, j, length, k in self.springs:
            dx, dy = self.x[j][0] - self.x[i][0], self.x[j][1] - self.x[i][1]
            now = math.hypot(dx, dy)
            half = 0.5 * k * (now - length) / now
            for end in (i, j):
                for c, span in enumerate((dx * dx, dy * dy, dx * dy)):
                    virial[end][c] += half * span
        rows = zip(self.x, self.v, virial, self.volume, self.mass, self.group)
        return [
            (i, *x, *v, xx / volume, yy / volume, (xx + yy) / (4.0 * volume), xy / volume, volume, m, group)
            for i, (x, v, (xx, yy, xy), volume, m, group) in enumerate(rows)
        ]


if __name__ == "__main__":
    sys.exit(serve_mpm(Springs()))
