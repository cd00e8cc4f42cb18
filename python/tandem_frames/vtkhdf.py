"""Writes the frames of a run as VTKHDF: one file with all times for points, bodies and contacts each.

The format is VTK's own (https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/index.html), of version 2.0: an
unstructured grid with a group `Steps` that says where in the arrays each time begins.
"""

from pathlib import Path

import h5py
import numpy as np

from .frames import FrameError, frames



# Rows of a dataset that are packed together: of numbers of times, and of numbers of points or cells.
_FEW, _MANY = 64, 4096


class _File:
    """A growing VTKHDF file of one part of the frames."""

    def __init__(self, path):
        self.file = h5py.File(path, "w")
        self.root = self.file.create_group("VTKHDF")
        self.root.attrs["Version"] = np.array([2, 0], "i8")
        self.root.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", 16))
        self.steps = self.root.create_group("Steps")
        self.times = []

    def _append(self, group, name, values):
        """Adds rows to a dataset, and says how many were there."""
        values = np.asarray(values)
        if name not in group:
            rest = values.shape[1:]
            rows = _FEW if group.name.startswith(self.steps.name) else _MANY
            group.create_dataset(
                name,
                (0, *rest),
                values.dtype,
                maxshape=(None, *rest),
                chunks=(rows, *rest),
                compression="gzip",
                shuffle=True,
            )
        data = group[name]
        count = len(data)
        data.resize(count + len(values), axis=0)
        data[count:] = values
        return count

    def add(self, time, mesh):
        root, steps = self.root, self.steps
        self._append(steps, "PartOffsets", [len(self.times)])
        self._append(steps, "NumberOfParts", [1])
        self._append(steps, "PointOffsets", [self._append(root, "Points", mesh.points)])
        connectivity = np.arange(len(mesh.points))
        begin = self._append(root, "Connectivity", connectivity)
        self._append(steps, "ConnectivityIdOffsets", [[begin]])
        # Cells begin where those before end; each time has an offset more than it has cells.
        self._append(steps, "CellOffsets", [[self._append(root, "Types", mesh.types)]])
        self._append(root, "Offsets", mesh.offsets)
        self._append(root, "NumberOfPoints", [len(mesh.points)])
        self._append(root, "NumberOfCells", [len(mesh.types)])
        self._append(root, "NumberOfConnectivityIds", [len(connectivity)])
        for kind, arrays in (("PointData", mesh.of_points), ("CellData", mesh.of_cells)):
            data = root.require_group(kind)
            offsets = steps.require_group(f"{kind}Offsets")
            for name, array in arrays.items():
                self._append(offsets, name, [self._append(data, name, array)])
        if mesh.names:
            # They are the same at all times, and written once: every time begins at the first of them.
            field = root.require_group("FieldData")
            if "names" not in field:
                field.create_dataset("names", data=mesh.names, dtype=h5py.string_dtype("ascii"))
            self._append(steps.require_group("FieldDataOffsets"), "names", [0])
            self._append(steps.require_group("FieldDataSizes"), "names", [[1, len(mesh.names)]])
        self.times.append(time)

    def close(self):
        self.steps.attrs["NSteps"] = len(self.times)
        self.steps["Values"] = np.array(self.times)
        self.file.close()


def write(run, out):
    """Writes `points.vtkhdf`, `bodies.vtkhdf` and `contacts.vtkhdf`, as far as the run has them, into the folder `out`; returns
    their paths."""
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    files, paths = {}, []
    try:
        for frame in frames(run):
            for name, mesh in frame.meshes.items():
                if name not in files:
                    paths.append(out / f"{name}.vtkhdf")
                    files[name] = _File(paths[-1])
                files[name].add(frame.time, mesh)
    finally:
        for file in files.values():
            file.close()
    if not paths:
        raise FrameError(f"{run} has no frames")
    return paths
