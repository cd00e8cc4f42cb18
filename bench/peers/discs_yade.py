# The pile with YADE: spheres whose centres stay in a plane, with the mass and the inertia of discs; linear springs, dashpots
# and friction with history (ViscElPhys). Run by `yade -n -x`.
import os
import sys

sys.path.insert(0, os.environ["PEERS"])  # YADE's __file__ is its own
import discs_common
import numpy as np
from yade import *
from yade import utils
from yade.wrapper import *

d = discs_common.pile()
law = dict(kn=2 * d["normal_stiffness"], ks=2 * d["tangential_stiffness"], cn=2 * d["dashpot"], cs=2 * d["dashpot"])
material = O.materials.append(ViscElMat(density=d["density"], frictionAngle=np.arctan(d["friction"]), **law))
# A wall has no spring of its own: one of both as stiff as the pair's, in series with infinitely stiff ones, would be twice.
discs = []
for x, y, r in d["discs"]:
    k = O.bodies.append(utils.sphere((x, y, 0), r, material=material))
    body = O.bodies[k]
    mass = d["density"] * np.pi * r * r
    body.state.mass = mass
    body.state.inertia = (0.5 * mass * r * r,) * 3
    body.state.blockedDOFs = "zXY"
    discs.append(k)
for axis, place, sense in [(1, 0.0, 1), (0, 0.0, 1), (0, d["width"], -1)]:
    O.bodies.append(utils.wall(place, axis, sense=sense, material=material))
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist=0.001),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
        [Ip2_ViscElMat_ViscElMat_ViscElPhys()],
        [Law2_ScGeom_ViscElPhys_Basic()],
    ),
    NewtonIntegrator(damping=0, gravity=(0, -d["gravity"], 0)),
]
O.dt = d["step"]


def state():
    places = [O.bodies[k].state for k in discs]
    return np.array([(s.pos[0], s.pos[1]) for s in places]), np.array([(s.vel[0], s.vel[1]) for s in places])


discs_common.run("YADE", int(os.environ["THREADS"]), lambda n: O.run(n, wait=True), state)
sys.stdout.flush()
os._exit(0)
