"""The exchange between two solvers that compute next to nothing: preCICE over sockets, Tandem over shared memory.

What is timed is a step, which preCICE calls a time window: each side hands over its numbers of all points once, 4 and 3 a
point. Tandem's ImpState and ImpForce have 5 each. Tandem's side is `cargo bench -p interface --bench exchange`.
"""

import json
import os
import pathlib
import shutil
import subprocess

POINTS = [0, 1000, 10000]
# Time windows that are timed, after 256 that are not.
WINDOWS = 4000
DATA = {"Position": ("mpm", "vector"), "Velocity": ("mpm", "vector"), "Force": ("dem", "vector"), "Stiffness": ("dem", "scalar")}


def configuration(scheme, windows):
    """preCICE's, as lean as it can be: no profile, no mapping, constant data within a window."""
    other = {"mpm": "dem", "dem": "mpm"}
    data = "".join(f'<data:{kind} name="{name}" waveform-degree="0"/>\n' for name, (_, kind) in DATA.items())
    uses = "".join(f'<use-data name="{name}"/>' for name in DATA)
    sides = {}
    for side in other:
        meshes = '<provide-mesh name="points"/>' if side == "mpm" else '<receive-mesh name="points" from="mpm" api-access="true"/>'
        words = {True: "write", False: "read"}
        does = "".join(f'<{words[by == side]}-data name="{name}" mesh="points"/>' for name, (by, _) in DATA.items())
        sides[side] = f'<participant name="{side}">{meshes}{does}</participant>\n'
    exchanges = "".join(f'<exchange data="{name}" mesh="points" from="{by}" to="{other[by]}" substeps="false"/>\n'
                        for name, (by, _) in DATA.items())
    return (f'<?xml version="1.0"?>\n<precice-configuration>\n<profiling mode="off"/>\n'
            f'<log><sink type="stream" output="stderr" filter="%Severity% >= warning" enabled="true"/></log>\n{data}'
            f'<mesh name="points" dimensions="2">{uses}</mesh>\n{sides["mpm"]}{sides["dem"]}'
            f'<m2n:sockets acceptor="mpm" connector="dem" exchange-directory="."/>\n<coupling-scheme:{scheme}-explicit>\n'
            f'<participants first="mpm" second="dem"/><max-time-windows value="{windows}"/><time-window-size value="1.0"/>\n'
            f'{exchanges}</coupling-scheme:{scheme}-explicit>\n</precice-configuration>\n')


def precice(program, scratch, scheme, points, cores):
    """Two processes; time as the points' side sees it, CPU time of both, and how many numbers arrived wrong."""
    if not program.exists():
        return {"failed": "libprecice is not installed (bench/peers/install says how)"}
    # It refuses an empty mesh.
    count = max(points, 1)
    directory = scratch / "precice"
    shutil.rmtree(directory, ignore_errors=True)
    directory.mkdir()
    (directory / "precice.xml").write_text(configuration(scheme, WINDOWS + 256))
    behind = {"serial": 0, "parallel": 1}[scheme]
    sides = []
    for side in ("dem", "mpm"):
        command = list(map(str, [program, "precice.xml", side, count, WINDOWS, behind]))
        sides.append(subprocess.Popen(command, cwd=directory, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                      preexec_fn=lambda: os.sched_setaffinity(0, cores)))
    try:
        said = [side.communicate(timeout=120) for side in sides]
    except subprocess.TimeoutExpired:
        for side in sides:
            side.kill()
        return {"failed": "preCICE did not end within two minutes"}
    lines = [json.loads(out.splitlines()[-1]) if out.startswith("{") else None for out, _ in said]
    if None in lines:
        return {"failed": (said[lines.index(None)][1].strip().splitlines() or ["it said nothing"])[-1]}
    dem, mpm = lines
    return {"items": points, "steps": WINDOWS, "wall": mpm["wall"], "cpu": dem["cpu"] + mpm["cpu"],
            "wrong": dem["wrong"] + mpm["wrong"], "numbers": (dem["numbers"] + mpm["numbers"]) / WINDOWS}


def tandem(program, scratch, window, points, cores):
    """The mean of a step over the samples of the bench; its parties are threads, so the CPU time is not told apart."""
    if program is None:
        return {"failed": "cargo bench -p interface --bench exchange --no-run"}
    home = scratch / "criterion"
    function = f"processes, window {window}"
    environment = dict(os.environ, CRITERION_HOME=str(home))
    done = subprocess.run([str(program), "--bench", "--noplot", "--exact", f"exchange/{function}/{points}"], capture_output=True,
                          text=True, env=environment, preexec_fn=lambda: os.sched_setaffinity(0, cores))
    found = list(home.glob(f"exchange/{function}/{points}/new/sample.json"))
    if done.returncode or not found:
        return {"failed": (done.stderr.strip().splitlines() or ["no sample of criterion"])[-1]}
    sample = json.loads(found[0].read_text())
    found[0].unlink()
    return {"items": points, "steps": int(sum(sample["iters"])), "wall": sum(sample["times"]) / 1e9}


def bench(release):
    """The newest build of the bench."""
    found = [path for path in pathlib.Path(release).glob("deps/exchange-*") if not path.suffix and os.access(path, os.X_OK)]
    return max(found, key=lambda path: path.stat().st_mtime, default=None)
