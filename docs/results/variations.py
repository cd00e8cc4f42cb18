#!/usr/bin/env python3
"""Runs scenes with single values changed, writes what comes out to tables/variations.csv, and the tables of the pages from that.

    docs/results/variations.py [--only TABLE]... [--tandem PROGRAM]     # runs; an hour of CPU time in all
    docs/results/variations.py --pages [--check]                        # only the pages, from the table as it is

A page has `<!-- variations: TABLE -->` above its table. `--check` changes nothing and fails if a page differs.
"""

import argparse
import csv
import pathlib
import re
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
SCRATCH = ROOT / "target" / "results" / "variations"
KEPT = HERE / "tables" / "variations.csv"


class Run:
    """What a run has left."""

    def __init__(self, directory):
        with open(directory / "history.csv", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.rows = [{name.split(" [")[0]: float(value or "nan") for name, value in row.items()} for row in rows]

    def first(self, column, bound):
        """When a column first reaches a bound."""
        return next((row["time"] for row in self.rows if row[column] >= bound), None)

    def at(self, time, column):
        return next((row[column] for row in self.rows if row["time"] >= time - 1e-9), None)

    def mean(self, column, along, start, end):
        """Mean of a column where another one is between two values."""
        values = [row[column] for row in self.rows if start <= row[along] < end]
        return sum(values) / len(values) if values else None


def drucker_prager(friction, dilation, model="drucker_prager"):
    return (f"mpm.material.0.model={{{model}={{bulk_modulus=5e5,shear_modulus=3.2e5,friction_angle={friction},dilation_angle={dilation},"
            "cohesion=0.0,tensile_strength=0.0}}")


def bodies(friction=0.6, floor=0.3, adhesion=30, floor_adhesion=60, damping=0.3, stiffness=6e4):
    """Laws of the blocks on one another and on the floor."""
    law = f"normal_stiffness={stiffness},tangential_stiffness={stiffness / 20},damping_ratio={damping}"
    return [f"body_contact.granular={{{law},friction={friction},adhesion={adhesion}}}",
            f"contact_pair.0.law.granular={{{law},friction={floor},adhesion={floor_adhesion}}}"]


def gate(speed, slips=False):
    surface = ['dem.body.4.surface="gate"',
               'contact_pair.1={between=["gate","sand"],law.linear={normal_stiffness=6e4,tangential_stiffness=3e3,friction=0.0}}']
    return [f"dem.body.4.velocity=[0.0,{speed}]", *(surface if slips else [])]


LOST = ['output.column.11={name="lost",unit="1",value="energy.transfer_relative"}']
EARLY = ["variant=no_gate", "time.end=0.45", "time.min_step=1e-8", *LOST]
ARRIVAL = {
    "hit, s": lambda run: f"{run.first('contacts', 1):.3f}",
    "90 degrees, s": lambda run: f"{run.first('turned_2', 90):.3f}",
}
REST = {
    "rest of block 2, cm": lambda run: f"{100 * run.rows[-1]['left_edge_2']:.1f}",
    "rest of block 1, cm": lambda run: f"{100 * run.rows[-1]['left_edge_1']:.1f}",
}
BLOCKS = "jiang2020/blocks"

# The silo's flow over Beverloo's law, as its check has it.
SILO, ZERO = "jiang2020/silo", ["mpm.transfer=apic", drucker_prager(35, 0.0)]
LOST_SAND = ['output.column.10={name="lost",unit="1",value="energy.transfer_relative"}']
FLOW = ('output.column.9={name="flow",unit="1",value="12*(body.wall_left.fy + body.wall_right.fy + body.plate_left.fy + body.plate_right.fy)'
        '*(t - 0.5*(t_a + t_b))/(t_b - t_a)^2/g / (0.58*rho*sqrt(g)*(D - 2.2*r_p)^1.5)"}')


def flow(start=0.1, end=0.4):
    return {"ours / Beverloo": lambda run: f"{run.mean('flow', 'time', start, end):.2f}"}


def flat(opening, *more):
    """A flat bottom at y = 0 and as much sand above it."""
    ends = [f"dem.body.{n}.shape.segment.ends=[[0.0,0.0],[{x},0.0]]" for n, x in ((2, -0.045), (3, 0.045))]
    places = [f"dem.body.{n}.position=[{x},0.0]" for n, x in ((2, -opening / 2 - 0.005), (3, opening / 2 + 0.005))]
    walls = [f"dem.body.{n}.shape.segment.ends=[[{x},0.0],[{x},0.13]]" for n, x in ((0, -0.065), (1, 0.065))]
    fill = "mpm.points.0.fill.polygon.vertices=[[-0.059,0.006],[0.059,0.006],[0.059,0.0982],[-0.059,0.0982]]"
    return [*more, *ZERO, *ends, *places, *walls, fill]


# By table: the scene; the values of all rows; the columns; the rows with the values that they change, and columns of their own.
TABLES = {
    "gate": (BLOCKS, ["time.end=0.5"], ARRIVAL, {
        "none": ["variant=no_gate"],
        "4 m/s, frictionless": gate(4, True),
        "2 m/s, frictionless": gate(2, True),
        "2 m/s, friction 0.2 as on every body: **the scene**": [],
        "1 m/s, frictionless": gate(1, True),
        "1 m/s, friction 0.2": gate(1),
    }),
    "arrival": (BLOCKS, EARLY, ARRIVAL | {"lost by 0.2 s": lambda run: f"{100 * run.at(0.2, 'lost'):.1f} %"}, {
        "FLIP": ["mpm.transfer=flip", "mpm.leaving=remove"],
        "APIC, composed step": [],
        "`time.max_step` 5 us": ["time.max_step=5e-6"],
        "2 us": ["time.max_step=2e-6"],
        "XPIC of order 2": ["mpm.transfer.xpic.order=2"],
        "cell of 2.5 mm": ["mpm.cell=0.0025"],
        "5 mm": ["mpm.cell=0.005"],
        "7 mm": ["mpm.cell=0.007"],
        "Mohr-Coulomb": [drucker_prager(22.0, 0.0, "mohr_coulomb")],
        "friction of the sand 26, 30 degrees: 26": [drucker_prager(26.0, 0.0)],
        "30": [drucker_prager(30.0, 0.0)],
        "slip on the floor": ["mpm.walls.bottom=slip"],
        "cubic B-splines": ["mpm.shape=cubic_bspline"],
        "`usl`": ["mpm.stress_update=usl"],
        "sand ten times as stiff": [drucker_prager(22.0, 0.0).replace("5e5", "5e6").replace("3.2e5", "3.2e6")],
    }),
    "rest": (BLOCKS, [], ARRIVAL | REST, {
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
    "psi_zero": (SILO, [*ZERO, FLOW], {}, {
        "2 cm": (["variant=d2cm"], flow(0.2, 1.0)),
        "3 cm": (["variant=d3cm"], flow(0.15, 0.55)),
        "4 cm": ([], flow()),
        "5 cm": (["variant=d5cm"], flow(0.1, 0.3)),
        "6 cm": (["variant=d6cm"], flow(0.1, 0.25)),
    }),
    "silo": (SILO, [FLOW], {}, {
        "psi = 2 degrees": (["mpm.transfer=apic", drucker_prager(35, 2.0)], flow()),
        "5 degrees": (["mpm.transfer=apic", drucker_prager(35, 5.0)], flow()),
        "10 degrees": (["mpm.transfer=apic", drucker_prager(35, 10.0)], flow()),
        "wall friction 0.5 (0.2)": ([*ZERO, "contact.linear.friction=0.5"], flow()),
        "contact damping ratio 0.3 (0)": ([*ZERO, "contact.linear.damping_ratio=0.3"], flow()),
        "flat bottom (45 degrees), 3 cm": (flat(0.03, "variant=d3cm"), flow(0.15, 0.55)),
        "4 cm": (flat(0.04), flow()),
        "6 cm": (flat(0.06, "variant=d6cm"), flow(0.1, 0.25)),
        "cell of 1.75 mm (3.5)": ([*ZERO, "mpm.cell=0.00175"], flow()),
    }),
    "silo_step": (SILO, [FLOW, *LOST_SAND, drucker_prager(35, 0.0), "time.min_step=1e-8"],
                  flow() | {"lost by 0.4 s": lambda run: f"{100 * run.at(0.4, 'lost'):.1f} %"}, {
        "APIC, the composed step": ["mpm.transfer=apic"],
        "APIC, `--set time.max_step=2e-5`": ["mpm.transfer=apic", "time.max_step=2e-5"],
        "APIC, `5e-6`": ["mpm.transfer=apic", "time.max_step=5e-6"],
        "APIC, `2e-6`": ["mpm.transfer=apic", "time.max_step=2e-6"],
        "APIC, psi = 25, `2e-6`": ["mpm.transfer=apic", "time.max_step=2e-6", drucker_prager(35, 25.0)],
        "FLIP, `2e-5`": ["mpm.transfer=flip", "time.max_step=2e-5"],
    }),
    "pile": ("chen2023/pile", [], {
        f"{start} to {end} R": lambda run, start=start, end=end: f"{run.mean('resistance', 'depth', start, end):.2f}" if run.rows[-1]["depth"] > end - 0.1 else ""
        for start, end in ((3, 4), (4, 6), (6, 9))
    }, {
        "nothing": [],
        "friction of the pile 0 (0.3)": ["contact.linear.friction=0"],
        "0.625, that of the soil": ["contact.linear.friction=0.625"],
        "K0 = 1 (0.43)": ["constants.K0=1"],
        "soil twice as deep": ["mpm.domain=[[0.0,-4.8],[8.0,6.4]]", "mpm.points.0.fill.rectangle.lower=[0.0,-4.8]", "mpm.points.0.spacing.counts=[90,108]"],
        "damping 20 1/s": ["mpm.stage.0={from=0.0,damping=20.0}"],
        "half the cell, until 4 R": ["time.end=16", "check.0.from=12", "mpm.cell=0.044444444444444446", "mpm.points.0.spacing.counts=[180,108]",
                                     "mpm.traction.0.within=[[0.0,4.76],[8.0,4.8]]", "mpm.traction.0.force=[0.0,-2.4e6]"],
        "contact four times as stiff, until 4 R": ["time.end=16", "check.0.from=12", "contact.linear.normal_stiffness=2e8", "contact.linear.tangential_stiffness=1e8"],
    }),
}


def table_of(name, program):
    """Rows of a table, from runs."""
    scene, common, columns, rows = TABLES[name]
    for number, (label, changed) in enumerate(rows.items()):
        changed, own = changed if isinstance(changed, tuple) else (changed, {})
        out = SCRATCH / name / str(number)
        shutil.rmtree(out, ignore_errors=True)
        words = [word for value in common + changed for word in (["--variant", value[8:]] if value.startswith("variant=") else ["--set", value])]
        done = subprocess.run([program, "run", ROOT / "scenes" / f"{scene}.toml", *words, "--in-process", "--out", out], capture_output=True, text=True)
        if done.returncode not in (0, 1):
            sys.exit(f"{name}, {label}: {done.stderr}")
        run = Run(out)
        yield from ([name, label, column, of(run)] for column, of in (columns | own).items())
        print(f"{name}: {label}", flush=True)


def markdown(kept, name):
    """A page's table."""
    cells = [row for row in kept if row["table"] == name]
    columns, labels = ([*dict.fromkeys(row[key] for row in cells)] for key in ("column", "changed"))
    found = {(row["changed"], row["column"]): row["value"] for row in cells}
    line = lambda words: "| " + " | ".join(words) + " |\n"
    head = line(["changed", *columns]) + line(["---"] * (1 + len(columns)))
    return head + "".join(line([label, *(found.get((label, column), "") for column in columns)]) for label in labels)


def pages(check):
    with open(KEPT, encoding="utf-8") as file:
        kept = list(csv.DictReader(line for line in file if not line.startswith("#")))
    for page in sorted(HERE.glob("*.md")):
        text = page.read_text()
        new = re.sub(r"(<!-- variations: (\w+) -->\n\n?)((?:\|.*\n)*)", lambda match: match[1] + markdown(kept, match[2]), text)
        if new != text:
            if check:
                sys.exit(f"{page.name} differs: run docs/results/variations.py --pages")
            page.write_text(new)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", action="append", choices=TABLES, default=[])
    parser.add_argument("--tandem", type=pathlib.Path, default=ROOT / "target" / "release" / "tandem")
    parser.add_argument("--pages", action="store_true")
    parser.add_argument("--check", action="store_true")
    arguments = parser.parse_args()
    if not arguments.pages:
        build = subprocess.run(["git", "log", "-1", "--format=%h, %as"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
        old = []
        if arguments.only and KEPT.exists():
            with open(KEPT, encoding="utf-8") as file:
                old = [row for row in csv.reader(file) if not row[0].startswith("#")][1:]
        rows = []
        for name in TABLES:
            made = not arguments.only or name in arguments.only
            rows += table_of(name, arguments.tandem.resolve()) if made else [row for row in old if row[0] == name]
        with open(KEPT, "w", encoding="utf-8", newline="") as file:
            file.write(f"# tandem {build}\n")
            csv.writer(file, lineterminator="\n").writerows([["table", "changed", "column", "value"], *rows])
    pages(arguments.check)


if __name__ == "__main__":
    main()
