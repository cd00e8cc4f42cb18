"""`pytest --tandem-dem "python my.py"`: the conformance kit as tests, one for each clause of the protocol.

The kit runs once, when tests are collected. A clause that does not apply or is blocked is a skipped test with its
reason. docs/conformance.md says what the clauses are.
"""

import json
import os
import shutil
import subprocess
import sysconfig
import tempfile
from pathlib import Path

import pytest


def pytest_addoption(parser):
    group = parser.getgroup("tandem", "conformance with Tandem's protocol")
    group.addoption("--tandem-dem", metavar="COMMAND", help="test this solver for bodies")
    group.addoption("--tandem-mpm", metavar="COMMAND", help="test this continuum")
    group.addoption("--tandem-options", metavar="WORDS", default="", help="more words for `tandem conformance`, such as --require held")


def pytest_collection(session):
    """Judges before anything else is collected, so that a solver that does not start is told at once."""
    option = session.config.getoption
    chosen = [(side, option(f"--tandem-{side}")) for side in ("dem", "mpm") if option(f"--tandem-{side}")]
    session.config.stash[_JUDGED] = [(side, _judge(side, command, option("--tandem-options"))) for side, command in chosen]


@pytest.hookimpl(hookwrapper=True)
def pytest_collection_modifyitems(session, config, items):
    for side, (clauses, told) in config.stash.get(_JUDGED, []):
        kit = _Kit.from_parent(session, name=f"tandem-{side}", nodeid=f"tandem-{side}")
        items += [_Clause.from_parent(kit, name=f"{one['id']} {one['title']}", clause=one) for one in clauses]
        items.append(_Whole.from_parent(kit, name="the verdict", told=told))
    yield


_JUDGED = pytest.StashKey()


def _judge(side, command, options):
    """The verdicts of all clauses, and how the kit has ended: its exit status and its last words."""
    beside = Path(sysconfig.get_path("scripts")) / "tandem"
    program = os.environ.get("TANDEM") or (str(beside) if beside.is_file() else shutil.which("tandem"))
    if not program:
        raise pytest.UsageError("there is no program `tandem`: install it, or name it in $TANDEM")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "verdicts.json"
        words = [program, "conformance", f"--{side}", command, "--json", str(file), *options.split()]
        ended = subprocess.run(words, capture_output=True, text=True)
        if not file.is_file():
            raise pytest.UsageError(f"`tandem conformance` ended with status {ended.returncode}: {ended.stderr.strip()}")
        return json.loads(file.read_text(encoding="utf-8"))["clauses"], (ended.returncode, ended.stdout)


class _Kit(pytest.Collector):
    def collect(self):
        return []


class _Clause(pytest.Item):
    def __init__(self, clause, **more):
        super().__init__(**more)
        self.clause = clause

    def runtest(self):
        clause = self.clause
        if clause["verdict"] == "blocked":
            pytest.skip(f"blocked by {clause['by']}")
        if clause["verdict"] == "not_applicable":
            pytest.skip(clause["reason"])
        if clause["verdict"] == "fail":
            step = "" if clause["step"] is None else f"step {clause['step']}\n"
            story = "\n".join(clause.get("story", []))
            raise _Broken(f"{step}expected {clause['expected']}\ngot      {clause['got']}\n{story}".rstrip())

    def repr_failure(self, excinfo):
        if excinfo.errisinstance(_Broken):
            return f"{self.name} ({self.clause['level']})\n{excinfo.value}"
        return super().repr_failure(excinfo)

    def reportinfo(self):
        return "PROTOCOL.md", None, f"{self.clause['id']}: {self.clause['title']}"


class _Whole(pytest.Item):
    """What the clauses one by one do not tell: whether enough of them were judged, such as of `--require PROFILE`."""

    def __init__(self, told, **more):
        super().__init__(**more)
        self.told = told

    def runtest(self):
        status, said = self.told
        if status != 0:
            raise _Broken("\n".join(said.strip().splitlines()[-6:]))

    def repr_failure(self, excinfo):
        return str(excinfo.value)

    def reportinfo(self):
        return "PROTOCOL.md", None, "the verdict of `tandem conformance`"


class _Broken(Exception):
    """The solver does not keep a clause."""
