"""A scene: a TOML file or a dict, a variant, and values of keys. Nothing here knows a key: the program checks them."""

import atexit
import json
import math
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from .program import SCENES, SceneError, ask


class Scene:
    """A scene to run.

    `source` is the path of a TOML file, the name of a scene of the catalogue (`"jiang2020/collision_hard"`), or a dict with
    the keys of docs/scene-format.md. A dict's files, such as references of checks, are named by absolute paths.
    """

    def __init__(self, source, variant=None, values=None):
        self.variant = variant
        self.values = dict(values or {})
        if isinstance(source, Mapping):
            folder = Path(tempfile.mkdtemp(prefix="tandem-"))
            atexit.register(shutil.rmtree, folder, ignore_errors=True)
            self.path = folder / "scene.toml"
            self.path.write_text(as_toml(source), encoding="utf-8")
        else:
            self.path = Path(source)
            of_catalogue = SCENES / f"{source}.toml"
            if not self.path.exists() and of_catalogue.is_file():
                self.path = of_catalogue

    def having(self, values=None, variant=None):
        """This scene with other values of keys, such as `{"mpm.cell": 0.002}`, or as another variant."""
        return Scene(self.path, variant or self.variant, {**self.values, **(values or {})})

    def words(self):
        """The scene as words of a command line."""
        variant = ["--variant", self.variant] if self.variant else []
        return [self.path, *variant, *(word for pair in self.values.items() for word in ("--set", f"{pair[0]}={value(pair[1])}"))]

    def check(self):
        """What `tandem check` warns of, a line each; raises `SceneError` with the faults that it finds."""
        said = ask(["check", *self.words()])
        return [line for line in said.splitlines() if line.startswith("warning: ")]

    def __repr__(self):
        return f"<Scene {' '.join(map(str, self.words()))}>"


def as_toml(values):
    """A dict as a TOML document: a line for each of its keys, what is within them inline."""
    return "".join(f"{key_of(key)} = {value(inner)}\n" for key, inner in values.items())


def value(thing):
    """A value as TOML writes it in a line. Numbers of numpy are numbers."""
    if hasattr(thing, "tolist"):
        thing = thing.tolist()
    if isinstance(thing, bool):
        return "true" if thing else "false"
    if isinstance(thing, (str, Path)):
        # A JSON string is one of TOML, but for this character.
        return json.dumps(str(thing), ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(thing, int):
        return str(thing)
    if isinstance(thing, float):
        return repr(thing) if math.isfinite(thing) else str(thing)
    if isinstance(thing, Mapping):
        return "{" + ", ".join(f"{key_of(key)} = {value(inner)}" for key, inner in thing.items()) + "}"
    if isinstance(thing, (list, tuple)):
        return "[" + ", ".join(map(value, thing)) + "]"
    raise SceneError(f"a scene has no value such as {thing!r}")


def key_of(key):
    return value(str(key))
