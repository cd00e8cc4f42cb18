"""A server of HyperQueue with two workers, for tests and measurements: prints its directory for HQ_SERVER_DIR, and loses
a worker for each line that it reads. At the end of its input it ends.

    python3 tests/harness/two_workers.py CORES

The workers are threads of this process, so one cannot be killed. Its connection is shut instead: the server sees what it
sees of a worker whose machine is lost, and the worker ends what it runs.
"""

import os
import socket
import sys

from hyperqueue import LocalCluster
from hyperqueue.cluster import WorkerConfig


def connections():
    """Descriptors of this process that are connected over TCP."""
    found = {}
    for name in os.listdir("/proc/self/fd"):
        try:
            if not os.readlink(f"/proc/self/fd/{name}").startswith("socket:"):
                continue
            end = socket.socket(fileno=os.dup(int(name)))
            if end.family not in (socket.AF_INET, socket.AF_INET6):
                continue
            end.getpeername()
        except OSError:
            continue
        found[int(name)] = end
    return found


def start_worker():
    """Starts one and returns its connection."""
    before = connections()
    cluster.start_worker(WorkerConfig(cores=int(sys.argv[1])))
    while True:
        new = {fd: end for fd, end in connections().items() if fd not in before}
        if new:
            return new[min(new)]


cluster = LocalCluster()
workers = [start_worker() for _ in range(2)]
print(cluster.cluster.server_dir, file=sys.stderr, flush=True)
for _ in sys.stdin:
    workers.pop().shutdown(socket.SHUT_RDWR)
os._exit(0)
