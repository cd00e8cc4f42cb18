"""The frames of a run directory as numpy arrays.

Tandem writes VTK's XML files of unstructured grids with arrays appended as they are in memory, in blocks that zlib has
packed (https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html). This reads what Tandem writes, not all that
VTK allows.
"""

import xml.etree.ElementTree as xml
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

_APPENDED = b'<AppendedData encoding="raw">'
_TYPES = {"Float64": "<f8", "Float32": "<f4", "Int64": "<i8", "UInt8": "<u1"}


class FrameError(Exception):
    """A run directory has no frames, or one of them cannot be read."""


@dataclass
class Mesh:
    """Cells of one kind, each of points of its own.

    `points` has shape (points, 3), m. The points of cell k are those from `offsets[k]` up to `offsets[k + 1]`. `types` are VTK's
    numbers of the cells: 1 a vertex, 3 a line, 7 a polygon. Arrays of points and cells have a row for each. `names` are those of
    the bodies: the name of a polygon's body is `names[of_cells["body"][k]]`.
    """

    points: np.ndarray
    offsets: np.ndarray
    types: np.ndarray
    of_points: dict = field(default_factory=dict)
    of_cells: dict = field(default_factory=dict)
    names: list = field(default_factory=list)

    def pyvista(self):
        """The mesh as a `pyvista.UnstructuredGrid`, with the same arrays; `names` are in its `user_dict`."""
        import pyvista

        counts = np.diff(self.offsets)
        cells = np.insert(np.arange(len(self.points)), self.offsets[:-1], counts)
        mesh = pyvista.UnstructuredGrid(cells, self.types, self.points)
        # Of a mesh without cells it takes no arrays.
        for data, arrays in ((mesh.point_data, self.of_points), (mesh.cell_data, self.of_cells)):
            data.update({name: array for name, array in arrays.items() if len(array)})
        if self.names:
            mesh.user_dict["names"] = self.names
        return mesh


@dataclass
class Frame:
    """What is where at `time` (s): a mesh for each of `"points"`, `"bodies"`, `"contacts"` that the run has."""

    time: float
    meshes: dict


class Frames(Sequence):
    """The frames of a run, at `times` (s). Each is read when it is asked for, and not kept."""

    def __init__(self, files):
        self._files = list(files.values())
        self.times = list(files)

    def __len__(self):
        return len(self.times)

    def __getitem__(self, at):
        if isinstance(at, slice):
            return Frames(dict(zip(self.times[at], self._files[at])))
        return Frame(self.times[at], {name: read(file) for name, file in self._files[at].items()})


def frames(run):
    """The frames of a run directory."""
    folder = Path(run) / "frames"
    try:
        root = xml.parse(folder / "frames.pvd").getroot()
    except FileNotFoundError:
        raise FrameError(f"{folder} has no frames.pvd: only a run with `output.frames` has frames") from None
    except xml.ParseError as error:
        raise FrameError(f"{folder / 'frames.pvd'}: {error}") from None
    files = {}
    for entry in root.iter("DataSet"):
        time, name, file = float(entry.get("timestep")), entry.get("name"), entry.get("file")
        if Path(file).name != file:
            raise FrameError(f"{folder / 'frames.pvd'} names {file!r}, which is no file beside it")
        files.setdefault(time, {})[name] = folder / file
    return Frames(files)


def read(file):
    """The mesh of one file."""
    try:
        return _mesh(Path(file).read_bytes())
    except (OSError, KeyError, TypeError, ValueError, zlib.error, xml.ParseError) as error:
        raise FrameError(f"{file}: {error}") from error


def _mesh(data):
    begin = data.find(_APPENDED)
    if begin < 0:
        raise ValueError("no compressed arrays in it")
    end = data.rindex(b"</AppendedData>")
    root = xml.fromstring(data[:begin] + b"</VTKFile>")
    packed = memoryview(data)[begin + len(_APPENDED) + 1 : end]

    def arrays(section):
        elements = root.find(f"UnstructuredGrid/{section}")
        return {element.get("Name"): _array(element, packed) for element in elements or ()}

    cells, names = arrays("Piece/Cells"), arrays("FieldData").get("names")
    return Mesh(
        points=arrays("Piece/Points")["Points"],
        offsets=np.concatenate(([0], cells["offsets"])),
        types=cells["types"],
        of_points=arrays("Piece/PointData"),
        of_cells=arrays("Piece/CellData"),
        names=names.tobytes().decode().split("\n") if names is not None else [],
    )


def _array(element, packed):
    """An array: how many blocks, bytes of a block, bytes of a shorter last one, packed bytes of each; then the blocks."""
    at = int(element.get("offset"))
    blocks = int(np.frombuffer(packed, "<u8", 1, at)[0])
    sizes = np.frombuffer(packed, "<u8", blocks, at + 24)
    at += 24 + 8 * blocks
    whole = bytearray()
    for size in map(int, sizes):
        whole += zlib.decompress(packed[at : at + size])
        at += size
    array = np.frombuffer(bytes(whole), _TYPES[element.get("type")])
    components = int(element.get("NumberOfComponents"))
    return array.reshape(-1, components) if components > 1 else array
