"""The bar of bar.json, and how a run of it is judged: the same for every code that is called from Python.

v = V cos(pi x / L) at the start; a free bar swings back in T = 2 L / c. What is measured is the mean velocity of the left
half less that of the right half, over its value at the start: cos(2 pi t / T). At T/4 it is 0 and at T/2 it is -1.
"""

import json
import math
import os
import resource
import sys
import time

import numpy as np


def bar():
    path = os.environ.get("BAR", os.path.join(os.path.dirname(os.path.abspath(__file__)), "bar.json"))
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def points(b):
    """Positions (n, 2) in m, velocities (n, 2) in m/s, volume in m^2 of a point."""
    side = math.isqrt(b["per_cell"])
    spacing = b["length"] / b["cells"] / side
    columns, rows = b["cells"] * side, round(b["height"] / spacing)
    x, y = np.meshgrid((np.arange(columns) + 0.5) * spacing, (np.arange(rows) + 0.5) * spacing, indexing="ij")
    position = np.stack([x.ravel(), y.ravel()], axis=1)
    velocity = np.zeros_like(position)
    velocity[:, 0] = b["speed"] * np.cos(math.pi * position[:, 0] / b["length"])
    return position, velocity, spacing * spacing


def gradients(b):
    """Gradients of the velocities (n, 2, 2) in 1/s, which are APIC's matrices at the start, and deformation gradients.

    With zeros in place of the first the first step would lose (pi h / L)^2 / 4 of the speed. A step of the scheme begins with
    the strain of the step before, which there is none of: the second take it back."""
    position, _, _ = points(b)
    gradient = np.zeros((len(position), 2, 2))
    gradient[:, 0, 0] = -b["speed"] * math.pi / b["length"] * np.sin(math.pi * position[:, 0] / b["length"])
    return gradient, np.linalg.inv(np.eye(2) + b["step"] * gradient)


def cpu():
    """CPU time in s of this process, all its threads."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def run(code, threads, advance, velocity_x, warm):
    """Steps a code through half a period and prints what came out. `advance(n)` does n steps, `velocity_x()` gives the
    points' velocities in the order of `points`; `warm()` compiles what there is to compile and leaves the state alone."""
    b = bar()
    position, start, _ = points(b)
    left = position[:, 0] < 0.5 * b["length"]

    def swing():
        v = velocity_x()
        return (v[left].mean() - v[~left].mean()) / (start[left, 0].mean() - start[~left, 0].mean())

    def timed(steps):
        began, at = cpu(), time.perf_counter()
        advance(steps)
        clocks.append(cpu() - began)
        wall.append(time.perf_counter() - at)
        return swing()

    warm()
    half = b["steps"] // 2
    clocks, wall, swings = [], [], []
    # These codes' velocities are half a step behind their places, so at a time they are the mean of two steps'.
    before = timed(half)
    swings.append(0.5 * (before + timed(1)))
    before = timed(half - 1)
    spent = sum(clocks), sum(wall)
    swings.append(0.5 * (before + timed(1)))
    json.dump(
        {
            "code": code,
            "threads": threads,
            "items": len(position),
            "steps": b["steps"],
            "cpu": spent[0],
            "wall": spent[1],
            "quarter": swings[0],
            "half": swings[1],
        },
        sys.stdout,
    )
    print()
