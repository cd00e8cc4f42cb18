#!/usr/bin/env python3
"""Runs scenes with single values changed, and writes what comes out to tables/variations.csv. values.py makes the pages' tables of it.

    docs/results/variations.py [--only TABLE]... [--tandem PROGRAM]     # two hours of CPU time in all
"""

import argparse
import csv
import itertools
import json
import pathlib
import shutil
import statistics
import subprocess
import sys
from random import Random

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
SCRATCH = ROOT / "target" / "results" / "variations"
KEPT = HERE / "tables" / "variations.csv"
HEAD = ["table", "changed", "column", "value", "build"]


class Run:
    """What a run has left."""

    def __init__(self, directory):
        self.rows, self.course = (self.table(directory / f"{name}.csv") for name in ("history", "course"))
        self.summary = json.loads((directory / "summary.json").read_text())
        self.checks = {check["name"]: check["value"] for check in self.summary["checks"]}

    @staticmethod
    def table(path):
        with open(path, encoding="utf-8") as file:
            return [{name.split(" [")[0]: float(value or "nan") for name, value in row.items()} for row in csv.DictReader(file)]

    def first(self, holds):
        """The first row of which something holds, if there is one."""
        return next((row for row in self.rows if holds(row)), None)

    def when(self, holds):
        row = self.first(holds)
        return row and row["time"]

    def at(self, time):
        """The row of a time."""
        return self.first(lambda row: row["time"] >= time - 1e-9)

    def largest(self, value):
        """The row in which something is largest."""
        return max(self.rows, key=value)

    def mean(self, column, along, start, end):
        """Mean of a column where another one goes from one value to another."""
        if self.rows[-1][along] < end - 1e-9:
            return None
        values = [row[column] for row in self.rows if start <= row[along] < end]
        return sum(values) / len(values)

    def slope(self, column, along, start, end):
        """Mean slope of a column over another one that goes from one value to another."""
        ends = [self.first(lambda row, bound=bound: row[along] >= bound - 1e-6) for bound in (start, end)]
        if None in ends:
            return None
        return (ends[1][column] - ends[0][column]) / (ends[1][along] - ends[0][along])


def drucker_prager(friction, dilation, model="drucker_prager"):
    return (f"mpm.material.0.model={{{model}={{bulk_modulus=5e5,shear_modulus=3.2e5,friction_angle={friction},dilation_angle={dilation},"
            "cohesion=0.0,tensile_strength=0.0}}")


def bodies(floor, adhesion=30, floor_adhesion=60):
    """Laws of the blocks on one another and on the floor, with another friction on the floor."""
    law = "normal_stiffness=6e4,tangential_stiffness=3e3,damping_ratio=0.3"
    return [f"body_contact.granular={{{law},friction=0.6,adhesion={adhesion}}}",
            f"contact_pair.0.law.granular={{{law},friction={floor},adhesion={floor_adhesion}}}"]


def gate(speed, slips=False):
    surface = ['dem.body.4.surface="gate"',
               'contact_pair.1={between=["gate","sand"],law.linear={normal_stiffness=6e4,tangential_stiffness=3e3,friction=0.0}}']
    return [f"dem.body.4.velocity=[0.0,{speed}]", *(surface if slips else [])]




def lost(column, until):
    """A column of what the transfer has taken, and its value at a time."""
    at = lambda run: 100 * run.at(until)["lost"]
    written = f'output.column.{column}={{name="lost",unit="1",value="energy.transfer_relative"}}'
    return written, {f"lost by {until} s": ("{:.1f} %", at)}


LOST, LOST_EARLY = lost(11, 0.2)
EARLY = ["variant=no_gate", "time.end=0.45", "time.min_step=1e-8", LOST]
ARRIVAL = {
    "hit, s": ("{:.3f}", lambda run: run.when(lambda row: row["contacts"] >= 1)),
    "90 degrees, s": ("{:.3f}", lambda run: run.when(lambda row: row["turned_2"] >= 90)),
}
REST = {
    "rest of block 2, cm": ("{:.1f}", lambda run: 100 * run.rows[-1]["left_edge_2"]),
    "rest of block 1, cm": ("{:.1f}", lambda run: 100 * run.rows[-1]["left_edge_1"]),
}
BLOCKS = "jiang2020/blocks"

SILO, ZERO = "jiang2020/silo", ["mpm.transfer=apic", drucker_prager(35, 0.0)]


def beverloo(column, start="t_a", end="t_b"):
    """A column whose mean from `start` to `end` is the flow over Beverloo's law with 0.58."""
    force = "(body.wall_left.fy + body.wall_right.fy + body.plate_left.fy + body.plate_right.fy)"
    value = f"12*{force}*(t - 0.5*({start} + {end}))/({end} - {start})^2/g / (0.58*rho*sqrt(g)*(D - 2.2*r_p)^1.5)"
    return f'output.column.{column}={{name="flow{column}",unit="1",value="{value}"}}'


FLOW = beverloo(9)
LOST_SAND, LOST_LATE = lost(10, 0.4)
OPENINGS = {2: (0.2, 1.0), 3: (0.15, 0.55), 4: (0.1, 0.4), 5: (0.1, 0.3), 6: (0.1, 0.25)}  # in cm; when the flow is measured


def flow(opening=4):
    start, end = OPENINGS[opening]
    return {"ours / Beverloo": ("{:.2f}", lambda run: run.mean("flow9", "time", start, end))}


def flat(opening, *more):
    """A flat bottom at y = 0 and as much sand above it."""
    ends = [f"dem.body.{n}.shape.segment.ends=[[0.0,0.0],[{x},0.0]]" for n, x in ((2, -0.045), (3, 0.045))]
    places = [f"dem.body.{n}.position=[{x},0.0]" for n, x in ((2, -opening / 2 - 0.005), (3, opening / 2 + 0.005))]
    walls = [f"dem.body.{n}.shape.segment.ends=[[{x},0.0],[{x},0.13]]" for n, x in ((0, -0.065), (1, 0.065))]
    fill = "mpm.points.0.fill.polygon.vertices=[[-0.059,0.006],[0.059,0.006],[0.059,0.0982],[-0.059,0.0982]]"
    return [*more, *ZERO, *ends, *places, *walls, fill]


MU = ("mpm.material.0.model={mu_i={bulk_modulus=5e5,shear_modulus=3.2e5,static_friction=0.32,limit_friction=0.6,inertial_number=0.4,"
      "grain_diameter=2e-3,grain_density=2500.0}}")
AFLIP = "mpm.transfer={aflip={pic_rate=20.0}}"
WINDOWS = ((0.08, 0.24), (0.1, 0.37))


def disordered():
    """Four points a cell for Bagnold's layer, each off by up to 0.4 of their distance."""
    random, distance = Random(1), 1e-3
    off = lambda n: (n + 0.5 + random.uniform(-0.4, 0.4)) * distance
    for group, first in enumerate((0, 20)):
        places = [[off(i), off(first + j)] for j in range(20) for i in range(8)]
        yield f"mpm.points.{group}.fill={{points={{positions={places!r}}}}}"
        yield f"mpm.points.{group}.spacing={{distance={distance}}}"


MATRIX = "jiang2020/granular_matrix"
FORCES = {
    f"{centimetres} cm": ("{:.1f}", lambda run, end=centimetres / 100: 1e-3 * run.slope("work_of_the_bar", "settlement", end - 0.01, end))
    for centimetres in (2, 4, 6, 8, 10, 11)
}
CRITICAL = [f"mpm.material.0.model.drucker_prager.{value}" for value in ("separates=true", "critical_state={volume=1.05}")]
SOFT = ["contact_pair.0.law.linear.normal_stiffness=6e6", "contact_pair.0.law.linear.tangential_stiffness=3e5"]

BEAM = {
    "peak, N": ("{:.3f}", lambda run: run.checks["peak force"]),
    "at, us": ("{:.0f}", lambda run: 1e6 * run.checks["time of the peak"]),
    "midspan, um": ("{:.4f}", lambda run: 1e6 * run.checks["largest deflection at midspan"]),
    "lowest at, us": ("{:.0f}", lambda run: 1e6 * run.checks["time of the largest deflection"]),
    "rebound, m/s": ("{:.5f}", lambda run: run.checks["speed of the rebound"]),
    "energy residual": ("{:.1e}", lambda run: run.checks["no energy is created"]),
}
PAPER = ["variant=paper_cell"]
COLUMN = 'within=[[%s,0.0],[%s,0.01]],points="beam",hold_y=true'


def shifted(share):
    """The bottom of the beam this share of a cell above a node, midspan a node."""
    lower, cell = -0.0127916666666666667, 0.0025583333333333335
    return [*PAPER, f"mpm.domain=[[0.0,{lower - share * cell!r}],[0.1535,{lower - share * cell + 15 * cell!r}]]"]


def markers(spacing, *more):
    return ["variant=chains", f"mpm.chain.0.spacing={spacing}", *more]


BETWEEN = ["mpm.cell=0.0012685950413223141", "mpm.domain=[[0.0,-0.0050743801652892564],[0.1535,0.015223140495867769]]"]
TOUCH = 2e-4  # m above the floor
CLUSTERS = {
    "sand at the blocks, s": ("{:.3f}", lambda run: run.when(lambda row: row["contacts"] >= 1)),
    "block 2 touches the floor, s": ("{:.3f}", lambda run: run.when(lambda row: row["foot_2"] <= TOUCH)),
    "block 1, s": ("{:.3f}", lambda run: run.when(lambda row: row["foot_1"] <= TOUCH)),
    "block 2 turned by 90 degrees, s": ("{:.3f}", lambda run: run.when(lambda row: row["turned_2"] >= 90)),
}

TOPPLE = "chen2023/topple"


def curve(file, column):
    """A column of a table beside the scenes over time, linear between rows."""
    with open(ROOT / "scenes" / file, encoding="utf-8") as text:
        first, *_ = rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(text)]
    time = "time" if "time" in first else "t"

    def value(t):
        for low, high in zip(rows, rows[1:]):
            if low[time] <= t <= high[time]:
                return low[column] + (high[column] - low[column]) * (t - low[time]) / (high[time] - low[time])
        return None

    return value


def crossing(run, column, bound):
    """When a column reaches a value, linear between rows."""
    for low, high in zip(run.rows, run.rows[1:]):
        if low[column] < bound <= high[column]:
            return low["time"] + (high["time"] - low["time"]) * (bound - low[column]) / (high[column] - low[column])
    return None


def pendulum(slope):
    """Columns of a block that topples beside the pendulum from that slope, counted from rest; until that is 45 degrees beyond the vertical."""
    angle = curve(f"chen2023/topple_{slope}.csv", "angle")
    there = next(0.3 + n * 1e-4 for n in range(10000) if angle(0.3 + n * 1e-4) >= 45)
    off = lambda row: row["angle"] - angle(row["time"])
    falls = lambda run: [row for row in run.rows if 0.3 <= row["time"] <= there]
    return {
        "pendulum at 45 degrees, s": ("{:.3f}", lambda run: there - 0.3),
        "ours, s": ("{:.4f}", lambda run: crossing(run, "angle", 45) - 0.3),
        "off": ("{:+.2f} %", lambda run: 100 * ((crossing(run, "angle", 45) - 0.3) / (there - 0.3) - 1)),
        "largest distance until then, degrees": ("{:+.2f}", lambda run: max(map(off, falls(run)), key=abs)),
    }


TURNED = curve("chen2023/blocks_gjk_reference.csv", "turned_2")


def distance(row):
    return abs(row["turned_2"] - TURNED(row["time"])) if row["time"] <= 0.4 + 1e-9 else 0.0


def taken(run, time):
    """What the transfer has taken of the energy at the start, in percent."""
    row = next(row for row in run.course if row["time"] >= time - 1e-9)
    return 100 * row["transfer"] / run.course[0]["total"]


def spring(damping, tangential=3e4):
    """A block's contact with its slope."""
    return f"contact.linear={{normal_stiffness=6e4,tangential_stiffness={tangential},friction=0.7,{damping}}}"


def by_extent(run):
    """Half width of the loaded points over that of Hertz, mean over the time of the scene's check."""
    rows = [row for row in run.rows if row["time"] >= 0.54 * run.rows[-1]["time"]]
    return sum(row["half_width"] / row["hertz"] for row in rows) / len(rows)


FRONT = (1.22, 1.44, 1.89, 2.33, 2.78, 3.22, 3.67)
SHARES = (0.25, 0.5, 0.75)


def share(column, of=None):
    """A column of `shear` at the shares of shear."""
    row = lambda run, at: run.first(lambda row: row["shear"] >= at - 1e-9)
    return lambda run: ", ".join(f"{row(run, at)[column]:.1f}" if of is None else f"{100 * row(run, at)[column] / row(run, at)[of]:.0f} %" for at in SHARES)


# Tables of 30 runs with steps of 0.9 to 1 of the composed one: the scene, values of all runs, and columns, of which the page has mean and deviation.
TURN = {
    "90 degrees, s": ("{:.3f}", lambda run: run.when(lambda row: row["turned_2"] >= 90)),
    **{f"turned at {t} s": ("{:.1f}", lambda run, t=t: run.at(t)["turned_2"]) for t in (0.38, 0.39)},
}
SAMPLES = {
    "blocks_30": (BLOCKS, [], REST | TURN),
    "gjk_30": ("chen2023/blocks_gjk", ["time.end=0.42"], TURN),
    "clusters_30": ("singer2022/blocks_clusters", [], CLUSTERS | REST),
}

# By table: the scene, or the program that writes it; the values of all rows; the columns; the rows with the values that they change, and columns of their own.
TABLES = {
    "gate": (BLOCKS, ["time.end=0.5"], ARRIVAL, {
        "none": ["variant=no_gate"],
        "4 m/s, frictionless": gate(4, True),
        "2 m/s, frictionless": gate(2, True),
        "2 m/s, friction 0.2 as on every body: **the scene**": [],
        "1 m/s, frictionless": gate(1, True),
        "1 m/s, friction 0.2": gate(1),
    }),
    "arrival": (BLOCKS, EARLY, ARRIVAL | LOST_EARLY, {
        "FLIP": ["mpm.transfer=flip", "mpm.leaving=remove"],
        "APIC, composed step": [],
        "`time.max_step` 5 us": ["time.max_step=5e-6"],
        "2 us": ["time.max_step=2e-6"],
        "XPIC of order 2": ["mpm.transfer.xpic.order=2"],
        "cell of 2.5 mm": ["mpm.cell=0.0025"],
        "5 mm": ["mpm.cell=0.005"],
        "7 mm": ["mpm.cell=0.007"],
        "Mohr-Coulomb": [drucker_prager(22.0, 0.0, "mohr_coulomb")],
        "friction of the sand 26 degrees (22)": [drucker_prager(26.0, 0.0)],
        "30 degrees": [drucker_prager(30.0, 0.0)],
        "slip on the floor": ["mpm.walls.bottom=slip"],
        "cubic B-splines": ["mpm.shape=cubic_bspline"],
        "`usl`": ["mpm.stress_update=usl"],
        "sand ten times as stiff": [drucker_prager(22.0, 0.0).replace("5e5", "5e6").replace("3.2e5", "3.2e6")],
    }),
    "rest": (BLOCKS, [], REST, {
        "nothing: **the scene**": [],
        "friction of blocks on the floor 0.2, of Table 3 (0.3)": bodies(floor=0.2),
        "0.4": bodies(floor=0.4),
        "0.6, without adhesion": bodies(floor=0.6, adhesion=0, floor_adhesion=0),
        "friction of sand on blocks 0.5 (0.2)": ["contact.linear.friction=0.5"],
        "gate at 1.5 m/s (2)": gate(1.5),
        "3 m/s": gate(3),
        "density of the blocks 500 kg/m^3 (700)": ["dem.body.0.density=500", "dem.body.1.density=500"],
        "900": ["dem.body.0.density=900", "dem.body.1.density=900"],
        "edges rounded with 3 mm (1)": [word for n in range(3) for word in (
            f"dem.body.{n}.shape.rectangle={{width=0.014,height=0.012}}", f"dem.body.{n}.sphero_radius=0.003")],
        "2016 points (8000)": ["mpm.points.0.spacing.counts=[32,63]"],
    }),
    **{
        name: (SILO, [*changed, FLOW], {}, {f"{n} cm": ([f"variant=d{n}cm"], flow(n)) for n in OPENINGS})
        for name, changed in {"psi_zero": ZERO, "n9000": ["mpm.points.0.spacing.distance=1.1e-3"], "n10000": ["mpm.points.0.spacing.distance=1.0435e-3"]}.items()
    },
    "silo": (SILO, [FLOW], {}, {
        "psi = 2 degrees": (["mpm.transfer=apic", drucker_prager(35, 2.0)], flow()),
        "5 degrees": (["mpm.transfer=apic", drucker_prager(35, 5.0)], flow()),
        "10 degrees": (["mpm.transfer=apic", drucker_prager(35, 10.0)], flow()),
        "wall friction 0.5 (0.2)": ([*ZERO, "contact.linear.friction=0.5"], flow()),
        "contact damping ratio 0.3 (0)": ([*ZERO, "contact.linear.damping_ratio=0.3"], flow()),
        "flat bottom (45 degrees), 3 cm": (flat(0.03, "variant=d3cm"), flow(3)),
        "4 cm": (flat(0.04), flow()),
        "6 cm": (flat(0.06, "variant=d6cm"), flow(6)),
        "cell of 1.75 mm (3.5)": ([*ZERO, "mpm.cell=0.00175"], flow()),
    }),
    "silo_step": (SILO, [FLOW, LOST_SAND, drucker_prager(35, 0.0), "time.min_step=1e-8"], flow() | LOST_LATE, {
        "APIC, the composed step": ["mpm.transfer=apic"],
        "APIC, `--set time.max_step=2e-5`": ["mpm.transfer=apic", "time.max_step=2e-5"],
        "APIC, `5e-6`": ["mpm.transfer=apic", "time.max_step=5e-6"],
        "APIC, `2e-6`": ["mpm.transfer=apic", "time.max_step=2e-6"],
        "APIC, psi = 25, `2e-6`": ["mpm.transfer=apic", "time.max_step=2e-6", drucker_prager(35, 25.0)],
        "FLIP, `2e-5`": ["mpm.transfer=flip", "time.max_step=2e-5"],
    }),
    "silo_transfer": (SILO, ["variant=psi0", "mpm.points.0.spacing={per_cell=9}"], {
        "ours / Beverloo": ("{:.2f}", lambda run: run.checks["mass flow over Beverloo's law"]),
    }, {
        "APIC": [],
        "blend, PIC fraction 0.01": ["mpm.transfer={blend={pic_fraction=0.01}}"],
        "FLIP": ["mpm.transfer=flip"],
        "PIC": ["mpm.transfer=pic"],
    }),
    "critical": (SILO, [AFLIP, FLOW], flow() | {
        "least and largest step, us": ("{0[0]:.1f}, {0[1]:.1f}", lambda run: [1e6 * run.summary[name] for name in ("dt_min", "dt_max")]),
    }, {
        "`{ volume = 1.03 }`": [],
        "`{ shear_strain = 0.1 }`": [drucker_prager(35, 25.0).replace("}}", ",separates=true,critical_state={shear_strain=0.1}}}")],
    }),
    "mu": (SILO, ["time.end=0.4", "mpm.leaving=remove", beverloo(9, *WINDOWS[0]), beverloo(10, *WINDOWS[1])], {
        f"{start} to {end} s": ("{:.3f}", lambda run, n=n, start=start, end=end: run.mean(f"flow{9 + n}", "time", start, end))
        for n, (start, end) in enumerate(WINDOWS)
    }, {
        "mu(I), `aflip` 20/s, composed step": [MU, AFLIP],
        "15 us": [MU, AFLIP, "time.max_step=1.5e-5"],
        "3.6 us": [MU, AFLIP, "time.max_step=3.6e-6"],
        "mu(I), `flip`": [MU, "mpm.transfer=flip"],
        "psi = 0, `aflip` 20/s": [drucker_prager(35, 0.0), AFLIP],
        "psi = 0, `flip_pic` 20/s": [drucker_prager(35, 0.0), "mpm.transfer={flip_pic={pic_rate=20.0}}"],
    }),
    "bagnold": ("verification/bagnold", ["variant=long"], {
        "upper": ("{:.3f}", lambda run: run.checks["speed of the upper half"]),
        "lower": ("{:.3f}", lambda run: run.checks["speed of the lower half"]),
    }, {
        "9 points, `aflip` 50/s": ["mpm.transfer={aflip={pic_rate=50.0}}"],
        "4 points, `aflip` 50/s": ["mpm.transfer={aflip={pic_rate=50.0}}", *(f"mpm.points.{n}.spacing={{per_cell=4}}" for n in range(2))],
        "4 points, each off by up to 0.4 of the distance, until 4 s": ["constants.start=1.0", "constants.finish=4.0", "time.end=4.0", *disordered()],
    }),
    "matrix": (MATRIX, [], FORCES, {
        "26 % of fines (mass over grains; 3086 points)": ["variant=fines_low"],
        "35 % (4153)": [],
        "42 % (4989)": ["variant=fines_high"],
    }),
    "matrix_paper_cell": (f"{MATRIX}.py --cell 0.0035 --spacing 0.002 --container-stiffness 6e7", [], FORCES | {
        "to the walls, mm": ("{:.2f}", lambda run: 1e3 * run.checks["no fines pass through floor and walls"]),
        "ends at, cm": ("{:.1f}", lambda run: 100 * run.rows[-1]["settlement"]),
    }, {
        f"{fines}, {label}": [*([] if variant == "middle" else [f"variant=fines_{variant}"]), *changed]
        for label, changed in {"6e7 N/m, no dilation beyond 1.05": CRITICAL, "6e6 N/m, dilation without end": SOFT}.items()
        for variant, fines in {"low": "25.7 %", "middle": "35.7 %", "high": "44.3 %"}.items()
    }),
    "beam": ("singer2022/beam_single", [], BEAM, {
        "cell 1.28 mm (7.8 cells): the scene": [],
        "cell 5.1 mm (2 cells high): cell_5mm": ["variant=cell_5mm"],
        "cell 2.56 mm (3.9 cells): paper_cell": PAPER,
        "cell 0.64 mm": ["mpm.cell=0.00063958333333333335"],
        "half of the step: half_step": ["variant=half_step"],
        "midspan in the middle of a cell: between_nodes": ["variant=between_nodes"],
        "the ball between two points: between_points": ["variant=between_points"],
        "paper_cell, 16 rows of points": [*PAPER, "mpm.points.0.spacing={counts=[481,16]}", "mpm.probe.0.within=[[0.0766,0.0045],[0.0769,0.0055]]"],
        "paper_cell, 64 rows": [*PAPER, "mpm.points.0.spacing={counts=[481,64]}"],
        "paper_cell, bottom of the beam 1/4 cell above a node": shifted(0.25),
        "paper_cell, 1/2": shifted(0.5),
        "paper_cell, 3/4": shifted(0.75),
        "paper_cell, cubic B-splines": [*PAPER, "mpm.shape=cubic_bspline"],
        "paper_cell, uGIMP": [*PAPER, "mpm.shape=ugimp"],
        "paper_cell, hats, `usavg`": [*PAPER, "mpm.shape=linear", "mpm.stress_update=usavg"],
        "paper_cell, APIC": [*PAPER, "mpm.transfer=apic"],
        "60 segments along the beam, midspan a marker: chains": ["variant=chains"],
        "240 segments, midspan a marker: chains_240": ["variant=chains_240"],
        "59 segments, midspan in the middle of one: chains_odd": ["variant=chains_odd"],
        "239 segments, likewise": markers(0.000645),
        "60 segments, midspan in the middle of a cell": markers(0.00256, *BETWEEN),
        "59 segments, likewise": markers(0.00261, *BETWEEN),
        "chains, eta = 1 (0.1)": markers(0.00256, "mpm.chain.0.floor=1.0"),
        "chains, eta = 1e-4": markers(0.00256, "mpm.chain.0.floor=1e-4"),
        "chains, half of the step": markers(0.00256, "time.step_factor=0.5"),
        "two points beside the axis at either end held in y: held_points": ["variant=held_points"],
        "the whole column of 64 points at either end held in y": [
            "variant=held_points", f"mpm.hold=[{{name=\"left\",{COLUMN % ('0.0', '0.0003')}}},{{name=\"right\",{COLUMN % ('0.1532', '0.1535')}}}]"],
        "periodic beam of two spans, hit from above and below, cell 2.56 mm: antisymmetric": ["variant=antisymmetric"],
        "four fixed discs, linear law: discs": ["variant=discs"],
    }),
    "rings": ("chen2023/rings", ["variant=fine"], {
        "largest residual": ("{:.2f} %", lambda run: 100 * run.checks["energy is conserved, with the contact potential"]),
        "speed afterwards, m/s": ("{:.1f}", lambda run: run.checks["they fly off one another"]),
    }, {
        "`time.safety` 0.8 (`fine`)": [],
        "0.6": ["time.safety=0.6"],
        "0.4": ["time.safety=0.4"],
        "0.8, `usavg`": ["mpm.stress_update=usavg"],
        "0.8, cubic B-splines": ["mpm.shape=cubic_bspline"],
        "0.8, Hencky's law": ["mpm.material.0.model={linear_elastic={bulk_modulus=121.67e6,shear_modulus=26.07e6}}"],
    }),
    "clusters": ("singer2022/blocks_clusters", [], CLUSTERS | REST, {
        "nothing": [],
        "gate at 2.5 m/s (2)": gate(2.5),
        "gate at 3 m/s": gate(3),
        "FLIP (APIC)": ["mpm.transfer=flip", "mpm.leaving=remove"],
        "Hertz constants ten times as large": [
            "contact.hertz_mindlin.hertz_constant=7e7", "body_contact.hertz_mindlin.hertz_constant=7e7", "contact_pair.0.law.hertz_mindlin.hertz_constant=7e7"],
        "restitution of wood 0.2 (0.5)": ["body_contact.hertz_mindlin.restitution=0.2", "contact_pair.0.law.hertz_mindlin.restitution=0.2"],
        "adhesion of the discs 340 and 680 Pa: 30 and 60 Pa over the whole edge": [
            "body_contact.hertz_mindlin.adhesion=340", "contact_pair.0.law.hertz_mindlin.adhesion=680"],
        "by chains": ["variant=chains"],
    }),
    "topple": (TOPPLE, [], {}, {
        "16 degrees, `--variant slope_16`": (["variant=slope_16"], pendulum(16)),
        "18 degrees, `slope_18`": (["variant=slope_18"], pendulum(18)),
        "20 degrees": ([], pendulum(20)),
    }),
    "topple_16": (TOPPLE, [], {name: pendulum(16)[name] for name in ("off", "largest distance until then, degrees")}, {
        label: [f"variant={variant}"] for label, variant in {
            "nothing": "slope_16",
            "put on the slope at once (`sudden`): the whole base carries for the first 7 ms, and the block keeps 0.07 rad/s": "sudden",
            "points half a spacing inside (`inside`): it turns about a point 5 mm inside of the corner": "inside",
            "springs of 1e8 N/m instead of 1e9 (`soft_contact`): it turns before it stands on its outermost point": "soft_contact",
            "the block does not keep its spin (`no_spin`): a turning boundary is strained": "no_spin",
            "E ten times as large (`stiff`): does not lean": "stiff",
            "half the cell, 20 x 80 points (`finer`): leans more": "finer",
        }.items()
    }),
    "gjk": ("chen2023/blocks_gjk", [], {
        "largest distance, degrees": ("{:.1f}", lambda run: max(map(distance, run.rows))),
        **ARRIVAL,
    }, {
        label: [f"variant={variant}"] if variant else [] for label, variant in {
            "depth, at the point; rounded: **the scene**": "",
            "depth, traction: `--variant traction`": "traction",
            "area, at the point: `area`": "area",
            "area, traction: `area_traction`": "area_traction",
            "depth; sharp edges: `bare`": "bare",
            "area; sharp edges: `bare_area`": "bare_area",
        }.items()
    }),
    "sudden_load": ("verification/sudden_load", [], {
        "way after 1.5 s, mm": ("{:.2f}", lambda run: 1e3 * run.rows[-1]["x"]),
    }, {
        "no damping (a rigid block: 13.01)": [spring("damping_ratio=0.0")],
        "0.3 of a point (9.02)": [spring("damping_ratio=0.3")],
        "0.3 of a point, k_t = k_n/20 (36.74)": [spring("damping_ratio=0.3", 3e3)],
        "the same with APIC": [spring("damping_ratio=0.3", 3e3), "mpm.transfer=apic"],
        "0.5 of the block: the scene (4.37)": [],
        "1 of the block (3.04)": [spring("damping_ratio=1.0,damped_mass=1.25")],
    }),
    "dam": ("chen2023/dam_break", [], {
        "hit, s": ("{:.3f}", lambda run: run.when(lambda row: row["contacts"] >= 1)),
        "presses from behind, s": ("{:.2f}", lambda run: run.when(lambda row: row["time"] > 0.35 and row["force"] < -1)),
        "hardest, s": ("{:.2f}", lambda run: run.largest(lambda row: -row["force"])["time"]),
        "with, N/m": ("{:.0f}", lambda run: max(-row["force"] for row in run.rows)),
        "tip, largest, cm": ("{:.1f}", lambda run: 100 * max(row["tip"] for row in run.rows)),
        "tip at, s": ("{:.2f}", lambda run: run.largest(lambda row: row["tip"])["time"]),
        "tip at 0.55 s, cm": ("{:.1f}", lambda run: 100 * run.at(0.55)["tip"]),
        "lost by the hit": ("{:.0f} %", lambda run: taken(run, 0.23)),
        "lost by 1 s": ("{:.0f} %", lambda run: taken(run, 1.0)),
    }, {"the scene": []}),
    "dam_front": ("chen2023/dam_break", ["variant=no_plate"], {
        str(z): ("{:.2f}", lambda run, z=z: run.first(lambda row: row["Z"] >= z)["T"]) for z in FRONT
    }, {"ours": []}),
    "rings_energies": ("chen2023/rings", [], {
        "touch, ms": ("{:.2f}", lambda run: 1e3 * run.when(lambda row: row["force"] != 0)),
        "largest contact potential": ("{:.1f} %", lambda run: 100 * max(row["contact"] for row in run.rows) / run.rows[0]["kinetic"]),
        "smallest kinetic": ("{:.2f}", lambda run: min(row["kinetic"] for row in run.rows) / run.rows[0]["kinetic"]),
        "largest strain": ("{:.2f}", lambda run: max(row["strain"] for row in run.rows) / run.rows[0]["kinetic"]),
    }, {"the scene": []}),
    "roll": ("bardenhagen2000/roll", ["mpm.cell=0.03125"], {
        "R/16": ("{:.1f} %", lambda run: 100 * next(check["error"] for check in run.summary["checks"] if check["name"].startswith("x(t)"))),
    }, {"mu 0.3, 60 degrees": [], **{label: [f"variant={variant}"] for label, variant in {
        "mu 0.9, 60 degrees": "mu_0_9", "mu 0.5, 60 degrees": "mu_0_5", "mu 0.5, 30 degrees": "mu_0_5_at_30"}.items()}}),
    "shear": ("bardenhagen2000/shear", [], {
        "steps": ("{}", lambda run: run.summary["steps"]),
        "plastic work at 25, 50, 75 %, J/m": ("{}", share("plastic")),
        "of the driven work": ("{}", share("plastic", "driven")),
        "friction, J/m": ("{}", share("friction")),
        "largest residual": ("{:+.2f} %", lambda run: 100 * run.largest(lambda row: abs(row["residual"]))["residual"]),
    }, {"without slip": [], "with friction": ["variant=friction"]}),
    "gap": ("verification/two_bars", [], {
        "largest": ("{:+.1f}", lambda run: 100 * max(row["residual"] for row in run.rows)),
        "smallest": ("{:+.1f}", lambda run: 100 * min(row["residual"] for row in run.rows)),
    }, {
        f"{gap} of a cell, {name}": [
            f"mpm.shape={shape}", f"mpm.stress_update={update}", f"time.end={0.0075 + 0.025 * gap}",
            f"mpm.points.1.fill.rectangle={{lower=[{0.0025 * gap},0.0],upper=[{0.3 + 0.0025 * gap},0.01]}}",
        ] for name, shape, update in (
            ("uGIMP, `usf`", "ugimp", "usf"), *((f"quadratic, `{update}`", "quadratic_bspline", update) for update in ("usf", "usl", "usavg")))
        for gap in (0.5, 0.8, 1)
    }),
    "multiple": ("singer2022/beam_multiple", [], {
        "deepest, um": ("{:.3f}", lambda run: 1e6 * max(row["midspan"] for row in run.rows)),
        "ball leaves with, m/s": ("{:.5f}", lambda run: run.rows[-1]["v_ball"]),
    }, {"scene": [], **{variant: [f"variant={variant}"] for variant in ("paper_cell", "cell_5mm", "between_nodes", "chains")}}),
    "hertz": ("chen2023/hertz_discs", [], {
        "by the check": ("{:.3f}", lambda run: run.checks["half width against Hertz, from R/20 to R/10"]),
        "by extent": ("{:.3f}", by_extent),
    }, {label: [f"variant={label}"] if label != "scene" else [] for label in (
        "scene", "cell_20", "diagonal_40", "diagonal", "cell_40_one", "cell_20_one", "unequal", "unequal_40")}),
    "pile": ("chen2023/pile", [], {
        f"{start} to {end} R": ("{:.2f}", lambda run, start=start, end=end: run.mean("resistance", "depth", start, end))
        for start, end in ((3, 4), (4, 6), (6, 9))
    }, {
        "nothing": [],
        "friction of the pile 0 (0.3)": ["contact.linear.friction=0"],
        "0.625, that of the soil": ["contact.linear.friction=0.625"],
        "K0 = 1 (0.43)": ["constants.K0=1"],
        "soil twice as deep": ["mpm.domain=[[0.0,-4.8],[8.0,6.4]]", "mpm.points.0.fill.rectangle.lower=[0.0,-4.8]", "mpm.points.0.spacing.counts=[90,108]"],
        "damping 20 1/s": ["mpm.stage.0={from=0.0,damping=20.0}"],
        "contact four times as stiff, until 4 R": ["time.end=16", "check.0.from=12", "contact.linear.normal_stiffness=2e8", "contact.linear.tangential_stiffness=1e8"],
    }),
}


def options(values):
    return [word for value in values for word in (["--variant", value[8:]] if value.startswith("variant=") else ["--set", value])]


def tandem(program, *words, fine=(0, 1)):
    done = subprocess.run([program, *words], capture_output=True, text=True)
    if done.returncode not in fine:
        sys.exit(f"{' '.join(map(str, words))}: {done.stderr}")


def scene_file(scene, out):
    """The file of a scene; a program writes it if there is none."""
    file = ROOT / "scenes" / f"{scene}.toml"
    if not file.exists():
        out.mkdir(parents=True, exist_ok=True)
        file = out / "scene.toml"
        program, *words = scene.split()
        file.write_text(subprocess.run([sys.executable, ROOT / "scenes" / program, *words], capture_output=True, text=True, check=True).stdout)
    return file


def table_of(name, program):
    """Rows of a table, from runs."""
    scene, common, columns, rows = TABLES[name]
    file = scene_file(scene, SCRATCH / name)
    for number, (label, changed) in enumerate(rows.items()):
        changed, own = changed if isinstance(changed, tuple) else (changed, {})
        out = SCRATCH / name / str(number)
        shutil.rmtree(out, ignore_errors=True)
        tandem(program, "run", file, *options(common + changed), "--in-process", "--out", out)
        run = Run(out)
        for column, (spelling, of) in (columns | own).items():
            value = of(run)
            yield [name, label, column, "not reached" if value is None else spelling.format(value)]
        print(f"{name}: {label}", flush=True)


def samples_of(name, program):
    """Rows of a table of samples: mean and deviation of each column, of the runs that come to their end."""
    scene, common, columns = SAMPLES[name]
    out = SCRATCH / name
    shutil.rmtree(out, ignore_errors=True)
    tandem(program, "study", ROOT / "scenes" / f"{scene}.toml", *options(common), "--in-process", "--jobs", "2", "--sample", "30",
           "--over", "time.step_factor=uniform(0.9,1)", "--value", "momentum is conserved", "--out", out, fine=(0, 1, 3))
    runs = [Run(run) for run in (out / "runs").iterdir() if (run / "summary.json").exists()]
    runs = [run for run in runs if run.summary["status"] in ("done", "check_failed")]
    for column, (spelling, of) in columns.items():
        values = [value for value in map(of, runs) if value is not None]
        yield [name, column, "mean", spelling.format(statistics.mean(values))]
        yield [name, column, "deviation", spelling.format(statistics.stdev(values))]
    print(name, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", action="append", choices=[*TABLES, *SAMPLES], default=[])
    parser.add_argument("--tandem", type=pathlib.Path, default=ROOT / "target" / "release" / "tandem")
    arguments = parser.parse_args()
    build = subprocess.run(["git", "log", "-1", "--format=%h, %as"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
    for name in arguments.only or [*TABLES, *SAMPLES]:
        rows = table_of if name in TABLES else samples_of
        made = [[*row, build] for row in rows(name, arguments.tandem.resolve())]
        with open(KEPT, encoding="utf-8") as text:
            kept = {name: list(rows) for name, rows in itertools.groupby(list(csv.reader(text))[1:], key=lambda row: row[0])}
        kept[name] = made
        with open(KEPT, "w", encoding="utf-8", newline="") as file:
            rows = (row for table in [*TABLES, *SAMPLES] for row in kept.get(table, []))
            csv.writer(file, lineterminator="\n").writerows([HEAD, *rows])
    subprocess.run([HERE / "values.py"], check=True)


if __name__ == "__main__":
    main()
