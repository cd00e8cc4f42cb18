"""The program `tandem`: where it is, and what its exit status means."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import sysconfig
import threading
from pathlib import Path

# The scenes of the catalogue, and their JSON Schema.
SCENES = Path(__file__).resolve().parent / "scenes"

BAD_INPUT = 2
# Time between two looks at a command in progress, s.
LOOK = 0.2


class TandemError(Exception):
    """The program cannot be found, or it ended without a result."""


class SceneError(TandemError):
    """The program refuses a scene or an option; the text is its own: file, line, key, value, what was expected."""


class RunError(TandemError):
    """A run was started and did not reach its end. `run` is what it left, `None` if nothing."""

    run = None


def program():
    """The path of the program: `$TANDEM`, else the one that was installed with this package, else one of `$PATH`."""
    named = os.environ.get("TANDEM")
    beside = Path(sysconfig.get_path("scripts")) / "tandem"
    found = named or (str(beside) if beside.is_file() else shutil.which("tandem"))
    if not found:
        raise TandemError("there is no program `tandem`: install it (docs/install.md), or name it in $TANDEM")
    return found


def start(words, **more):
    """Starts a command of the program in a process group of its own: Ctrl-C reaches it through us, and only once."""
    try:
        return subprocess.Popen([program(), *map(str, words)], text=True, start_new_session=True, **more)
    except OSError as error:
        raise TandemError(f"{program()}: {error}") from error


def ask(words):
    """Runs a short command: what it says on standard output. Raises `SceneError` with what it says on standard error."""
    process = start(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    said, complained = process.communicate()
    if process.returncode != 0:
        kind = SceneError if process.returncode == BAD_INPUT else TandemError
        raise kind(complained.strip() or f"`tandem {words[0]}` ended with status {process.returncode}")
    return said


@contextlib.contextmanager
def running(words, read):
    """A command in progress, whose standard error `read` gets. If the caller is interrupted, so is the command."""
    process = start(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    reader = threading.Thread(target=read, args=(process.stderr,), daemon=True)
    reader.start()
    try:
        yield process
    except BaseException:
        # In order: the program closes its solvers and writes what it has.
        process.send_signal(signal.SIGINT)
        process.wait()
        raise
    finally:
        reader.join()
        process.stderr.close()


def wait(process, look):
    """Waits for the end of a command, and calls `look` now and then."""
    while process.poll() is None:
        look()
        try:
            process.wait(LOOK)
        except subprocess.TimeoutExpired:
            pass


def bar(total, title):
    """A progress bar, as tqdm draws it in a terminal or a notebook; `None` elsewhere, or without tqdm."""
    if not (sys.stderr.isatty() or "ipykernel" in sys.modules):
        return None
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return None
    return tqdm(total=total, desc=title, bar_format="{desc} {percentage:3.0f}%|{bar}| {elapsed}<{remaining}", leave=False)
