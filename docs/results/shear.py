#!/usr/bin/env python3
"""The profile of the mean vertical displacement of a run of scenes/bardenhagen2000/shear.toml (Bardenhagen 2000 figure 8).

    docs/results/shear.py RUN --out profile.csv [--at 0.25,0.5,0.75]

RUN has frames at least every 10 % of shear, so that no point goes half round the box from one to the next: the displacement is
unwrapped across the periodic walls from frame to frame. A point counts for the column of cells that it was in at the start. The
table has a row a column; for each share of shear the mean displacement over that of the wall is a column, and the uniform shear
another. The band is what two straight lines, one from each wall, leave beside the wall that moves where they meet. Only the standard library is used.
"""

import argparse
import array
import csv
import pathlib
import re
import struct
import xml.etree.ElementTree as tree
import zlib

SIDE, CELLS, DIAMETER = 1.2e-3, 150, 57e-6  # m, of the scene
SPEED = 100.0  # m/s of the wall
TYPES = {"Int64": "q", "Float64": "d", "Float32": "f"}


def read(file):
    """Ids and positions (x, y, z, x, ...) of the points of a VTK file that is packed by zlib."""
    data = file.read_bytes()
    start = data.index(b'<AppendedData encoding="raw">')
    packed = data.index(b"_", start) + 1
    header = data[:start] + b"</VTKFile>"
    found = {}
    for field in tree.fromstring(header).iter("DataArray"):
        if field.get("Name") not in ("id", "Points"):
            continue
        at = packed + int(field.get("offset"))
        (blocks,) = struct.unpack_from("<Q", data, at)
        sizes = struct.unpack_from(f"<{blocks}Q", data, at + 24)
        at += 24 + 8 * blocks
        values = array.array(TYPES[field.get("type")])
        for size in sizes:
            values.frombytes(zlib.decompress(data[at : at + size]))
            at += size
        found[field.get("Name")] = values
    return found["id"], found["Points"]


def frames(run):
    """Time in s and file of each frame."""
    text = (run / "frames" / "frames.pvd").read_text()
    listed = re.findall(r'<DataSet timestep="([^"]+)"[^>]*file="(points[^"]+)"', text)
    return [(float(time), run / "frames" / file) for time, file in listed]


def profiles(run, shares):
    """Of each share, mean displacement by column in m; the last frame that is not after it counts."""
    start, last, moved, taken = {}, {}, {}, {}
    wanted = sorted(shares)
    for time, file in frames(run):
        ids, x = read(file)
        for k, name in enumerate(ids):
            y = x[3 * k + 1]
            if name not in start:
                start[name], moved[name] = min(int(x[3 * k] / SIDE * CELLS), CELLS - 1), 0.0
            else:
                step = y - last[name]
                moved[name] += step - SIDE * round(step / SIDE)
            last[name] = y
        while wanted and time * SPEED / SIDE > wanted[0] - 1e-6:
            sums, counts = [0.0] * CELLS, [0] * CELLS
            for name, column in start.items():
                sums[column] += moved[name]
                counts[column] += 1
            taken[wanted.pop(0)] = [s / c if c else float("nan") for s, c in zip(sums, counts)]
    return taken


def band(profile, share):
    """Width of the band in mean diameters and the share of the wall's displacement that is within it: of two straight lines, from
    the wall at rest to a kink and from there to the wall that moves, those with the least squares."""
    wall = share * SIDE
    known = [((k + 0.5) / CELLS, u / wall) for k, u in enumerate(profile) if u == u]
    best = None
    for k in range(1, CELLS):
        kink = k / CELLS
        # u = height * hat(x) + rise(x), linear in the height of the kink.
        hats = [x / kink if x < kink else (1.0 - x) / (1.0 - kink) for x, _ in known]
        rest = [u - max(0.0, (x - kink) / (1.0 - kink)) for x, u in known]
        height = sum(h * r for h, r in zip(hats, rest)) / sum(h * h for h in hats)
        error = sum((r - height * h) ** 2 for h, r in zip(hats, rest))
        if best is None or error < best[0]:
            best = error, kink, height
    return (1.0 - best[1]) * SIDE / DIAMETER, 1.0 - best[2]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--at", default="0.25,0.5,0.75", help="shares of shear")
    arguments = parser.parse_args()
    shares = [float(share) for share in arguments.at.split(",")]
    taken = profiles(arguments.run, shares)
    with open(arguments.out, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["x [mm]", "uniform [1]", *(f"shear_{100 * share:.0f} [1]" for share in taken)])
        for k in range(CELLS):
            middle = (k + 0.5) / CELLS
            row = [taken[share][k] / (share * SIDE) for share in taken]
            writer.writerow([1e3 * middle * SIDE, middle, *row])
    for share, profile in taken.items():
        width, within = band(profile, share)
        print(f"{100 * share:.0f} %: band of {width:.1f} mean diameters, {100 * within:.0f} % of the displacement within it")


if __name__ == "__main__":
    main()
