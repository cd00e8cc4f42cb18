"""The pile of discs that all codes step on from the same places, and how a run of it is judged.

`pile.json` is made by `run`: the places of a pile that has settled in Tandem. All codes begin there at rest, without springs
of friction, so the pile settles anew by a little. What is judged is the height of its centre of mass after all steps, and
that it rests: both are the same for whoever has the same law.
"""

import json
import os
import resource
import sys
import time

import numpy as np


def pile():
    with open(os.environ["PILE"], encoding="utf-8") as file:
        return json.load(file)


def cpu():
    """CPU time in s of this process, all its threads."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def run(code, threads, advance, state):
    """Steps a code and prints what came out. `state()` gives places and velocities."""
    d = pile()
    radius = np.array([r for _, _, r in d["discs"]])
    mass = radius**2
    first, _ = state()
    advance(10)
    began, at = cpu(), time.perf_counter()
    advance(d["steps"])
    used, wall = cpu() - began, time.perf_counter() - at
    x, v = state()
    said = json.dumps(
        {
            "code": code,
            "threads": threads,
            "items": len(radius),
            "contacts": contacts(x, radius, d["width"]),
            "steps": d["steps"],
            "cpu": used,
            "wall": wall,
            # In thousandths of the mean radius: how far the centre of mass has sunk.
            "sunk": 1e3 * float(((first - x)[:, 1] * mass).sum() / mass.sum() / radius.mean()),
            "speed": float(np.sqrt((v**2).sum(axis=1).mean())),
        }
    )
    # In one piece, as ranks of MPI share the output.
    sys.stdout.write(said + "\n")
    sys.stdout.flush()


def contacts(x, radius, width):
    """Discs that touch one another or a wall."""
    order = np.argsort(x[:, 1])
    count = int((x[:, 1] < radius).sum() + (x[:, 0] < radius).sum() + (width - x[:, 0] < radius).sum())
    for place, i in enumerate(order):
        for j in order[place + 1 :]:
            if x[j, 1] - x[i, 1] > radius[i] + radius.max():
                break
            if np.hypot(*(x[i] - x[j])) < radius[i] + radius[j]:
                count += 1
    return count
