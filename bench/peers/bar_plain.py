"""The bar with the loop of bar_plain.c, which `install` compiles."""

import ctypes
import os
import sys

import bar_common
import numpy as np

threads = int(sys.argv[1])
library = ctypes.CDLL(os.environ["PLAIN"])
real, long = ctypes.c_double, ctypes.c_long
b = bar_common.bar()
position, velocity, volume = bar_common.points(b)
count = len(position)
h = b["length"] / b["cells"]
room = 4
columns, rows = b["cells"] + 2 * room + 1, round(b["height"] / h) + 2 * room + 1
points = np.zeros((count, 12))


def reset():
    points[:, 0:2] = position + room * h
    points[:, 2:4] = velocity
    points[:, 4:8], points[:, 8:12] = (matrices.reshape(count, 4) for matrices in bar_common.gradients(b))


def advance(steps):
    numbers = [real(value) for value in (h, b["step"], b["density"] * volume, volume, 0.5 * b["young"])]
    place = points.ctypes.data_as(ctypes.c_void_p)
    library.advance(place, long(count), long(columns), long(rows), *numbers, long(steps), ctypes.c_int(threads))


def warm():
    reset()
    advance(1)
    reset()


bar_common.run("plain loop", threads, advance, lambda: points[:, 2].copy(), warm)
