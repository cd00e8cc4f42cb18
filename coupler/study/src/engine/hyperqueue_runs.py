"""Makes the runs of a study as the tasks of one HyperQueue job: called by hyperqueue.rs with the file that says which."""

import json
import os
import sys

try:
    from hyperqueue import Job, LocalCluster
    from hyperqueue.client import Client
    from hyperqueue.cluster import WorkerConfig
    from hyperqueue.ffi.protocol import ResourceRequest
except ImportError as error:
    sys.exit(f"{error}: `python3 -m pip install hyperqueue` installs it")

with open(sys.argv[1]) as file:
    asked = json.load(file)
server = os.environ.get("HQ_SERVER_DIR")
if server:
    client = Client(server)
elif asked["memory"]:
    sys.exit("a worker of its own keeps no memory for runs: leave out --memory, or name a server in HQ_SERVER_DIR")
else:
    cluster = LocalCluster(worker_config=WorkerConfig(cores=asked["worker"]))
    client = cluster.client()
# A worker counts memory in MiB.
memory = {"mem": asked["memory"]} if asked["memory"] else {}
job = Job(name="tandem study", max_fails=None)
for run in asked["runs"]:
    job.program(
        run["command"],
        stdout=None,
        stderr=run["log"],
        resources=ResourceRequest(cpus=asked["cores"], resources=dict(memory)),
    )
submitted = client.submit(job)
client.connection.wait_for_jobs([submitted.id], lambda jobs: None)
