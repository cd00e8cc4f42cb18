"""`python3 -m tandem_frames RUN [--out FOLDER]`: the frames of a run as VTKHDF."""

import argparse
import sys
from pathlib import Path

from .frames import FrameError
from .vtkhdf import write


def main():
    parser = argparse.ArgumentParser(prog="tandem_frames", description="Write the frames of a run as VTKHDF.")
    parser.add_argument("run", help="run directory with frames (output.frames)")
    parser.add_argument("--out", help="folder for the files; RUN/vtkhdf by default")
    arguments = parser.parse_args()
    try:
        for path in write(arguments.run, arguments.out or Path(arguments.run) / "vtkhdf"):
            print(path)
    except (FrameError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
