"""A run: started with a progress bar, and read from its directory (docs/run-directory.md)."""

import html
import json
import time
from pathlib import Path

import pandas

from tandem_frames import frames as frames_of

from .program import BAD_INPUT, RunError, SceneError, TandemError, ask, bar, running, wait

try:
    import tomllib
except ImportError:  # Python before 3.11
    import tomli as tomllib

CHECK_FAILED = 1


class ChecksFailed(AssertionError):
    """Checks of a run fail; the text has a line for each."""


def run(scene, out=None, *, report=False, threads=1, in_process=False, dem=None, mpm=None, options=(), progress=True):
    """Runs a scene to its end.

    `out` is the run directory, `runs/NAME` if it is not given; `dem` and `mpm` are commands of other solvers; `options` are
    more words for `tandem run`. Raises `SceneError` if the program refuses the input, and `RunError` if the run does not reach
    its end. A check that fails raises only in `Run.checks`.
    """
    words = ["run", *scene.words(), "--log", "json", "--threads", threads]
    words += ["--out", out] if out else []
    words += ["--report"] if report else []
    words += ["--in-process"] if in_process else []
    for side, command in (("--dem", dem), ("--mpm", mpm)):
        words += [side, command] if command else []
    log = _Log()
    with running([*words, *options], log.read) as process:
        _watch(process, log, progress)
    if process.returncode == BAD_INPUT:
        raise SceneError(log.words())
    done = Run(log.out) if log.out else None
    if process.returncode not in (0, CHECK_FAILED):
        error = RunError(f"the run ended with status {process.returncode}: {log.words()}")
        error.run = done
        raise error
    return done


class _Log:
    """What a run says on standard error: JSON lines of its log, and plain ones before it has one."""

    def __init__(self):
        self.out, self.plain, self.errors = None, [], []

    def read(self, lines):
        for line in iter(lines.readline, ""):
            try:
                event = json.loads(line)
                fields = event["fields"]
            except (ValueError, KeyError, TypeError):
                self.plain.append(line.rstrip())
                continue
            if "out" in fields:
                self.out = Path(fields["out"])
            if event.get("level") == "ERROR":
                self.errors.append(fields.get("message", line))

    def words(self):
        return "\n".join(self.plain + self.errors)


def _watch(process, log, progress):
    """Waits for the end, with a bar that shows the time that the run has reached."""
    begun, shown = time.time(), None

    def look():
        nonlocal shown, progress
        if shown is None and progress and log.out:
            total = _end(log.out)
            shown = total and bar(total, log.out.name)
            progress = shown is not None
        if shown is not None:
            shown.n = min(_reached(log.out, begun), shown.total)
            shown.refresh()

    try:
        wait(process, look)
    finally:
        if shown is not None:
            shown.close()


def _end(out):
    """The time at which the run ends by its scene."""
    try:
        return float(tomllib.loads((out / "scene.toml").read_text(encoding="utf-8"))["time"]["end"])
    except (OSError, KeyError, TypeError, ValueError):
        return None


def _reached(out, begun):
    """The time of the newest row of the history, if it is one of this run."""
    path = out / "history.csv"
    try:
        if path.stat().st_mtime < begun:
            return 0.0
        with path.open("rb") as file:
            file.seek(max(0, path.stat().st_size - 65536))
            return float(file.read().decode().strip().rpartition("\n")[2].partition(",")[0])
    except (OSError, ValueError):
        return 0.0


class Run:
    """The directory of a run. Everything is read when it is asked for."""

    def __init__(self, path):
        self.path = Path(path)

    @property
    def summary(self):
        """`summary.json`: status, steps, times, ledger, hash, checks."""
        try:
            return json.loads((self.path / "summary.json").read_text(encoding="utf-8"))
        except OSError as error:
            raise TandemError(f"{error.filename}: {error.strerror}: no run has ended here") from error

    @property
    def history(self):
        """The columns that the scene declares, a row for each output. Units are in `.attrs["units"]`."""
        return table(self.path / "history.csv")

    @property
    def course(self):
        """The energy ledger, and how many steps each limit has determined, at the rows of the history."""
        return table(self.path / "course.csv")

    @property
    def bodies(self):
        """The bodies at the last row of the history."""
        return table(self.path / "bodies.csv")

    @property
    def frames(self):
        """The frames of a run with `output.frames`: a sequence whose meshes are numpy arrays, and pyvista's by `.pyvista()`."""
        return frames_of(self.path)

    def checks(self, raising=True):
        """The checks of the scene as a table; raises `ChecksFailed` if one fails."""
        checks = pandas.DataFrame(self.summary["checks"])
        if raising and not checks.empty and not checks["pass"].all():
            failed = checks[~checks["pass"].astype(bool)]
            lines = [f"{row['name']}: {row['value']}, expected {row['expected']} ({row['source']})" for _, row in failed.iterrows()]
            raise ChecksFailed("\n".join(lines))
        return checks

    def report(self):
        """The page with the results; it is made if the run has none."""
        page = self.path / "report.html"
        if not page.is_file():
            ask(["report", self.path])
        return page

    def _repr_html_(self):
        """In a notebook, the page, in a frame of its own."""
        page = html.escape(self.report().read_text(encoding="utf-8"), quote=True)
        return f'<iframe srcdoc="{page}" style="width: 100%; height: 45em; border: 1px solid #ccc" title="{self.path.name}"></iframe>'

    def __repr__(self):
        return f"<Run {self.path}>"


def table(path):
    """A CSV file of Tandem, whose header has units: `force [N/m]` becomes the column `force`."""
    try:
        read = pandas.read_csv(path)
    except OSError as error:
        raise TandemError(f"{error.filename}: {error.strerror}") from error
    parts = [name.partition(" [") for name in read.columns]
    names = [name for name, _, _ in parts]
    if len(set(names)) == len(names):
        read.columns = names
        read.attrs["units"] = {name: unit.rstrip("]") for name, _, unit in parts if unit}
    return read
