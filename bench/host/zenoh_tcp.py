#!/usr/bin/env python3
"""What a step of two solvers would cost over zenoh, beside TCP from the same language: states of N points one way, their forces
back, as tcp.rs sends them, on the loopback interface. No part of Tandem.

    pip install eclipse-zenoh && python3 bench/host/zenoh_tcp.py

Two processes, joined by zenoh's TCP link without a router; each message is sent at once (`express`) and none is dropped. Prints the
median and the 90th percentile of the wall time of a step in microseconds.
"""

import json
import socket
import statistics
import subprocess
import sys
import time

import zenoh

HEADER, STATE, FORCE = 48, 32, 24  # bytes of a message, of a point's state and of its force
SIZES = [1, 10, 100, 1_000, 10_000, 100_000]
STEPS = 5_000  # most of one size
TCP, ZENOH = 7501, 7502


class OverTcp:
    def __init__(self, listens):
        if listens:
            with socket.create_server(("127.0.0.1", TCP)) as server:
                self.end = server.accept()[0]
        else:
            self.end = patiently(lambda: socket.create_connection(("127.0.0.1", TCP)))
        self.end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, message):
        self.end.sendall(message)

    def receive(self, size):
        message, got = memoryview(bytearray(size)), 0
        while got < size:
            got += self.end.recv_into(message[got:])


class OverZenoh:
    def __init__(self, listens):
        config = zenoh.Config()
        config.insert_json5("mode", '"peer"')
        config.insert_json5("scouting/multicast/enabled", "false")
        for own, does in (("listen", listens), ("connect", not listens)):
            config.insert_json5(f"{own}/endpoints", json.dumps([f"tcp/127.0.0.1:{ZENOH}"] if does else []))
        self.session = zenoh.open(config)
        own, other = ("forces", "states") if listens else ("states", "forces")
        self.inbox = self.session.declare_subscriber(own, zenoh.handlers.FifoChannel(16))
        self.outbox = self.session.declare_publisher(
            other, express=True, congestion_control=zenoh.CongestionControl.BLOCK, priority=zenoh.Priority.REAL_TIME)
        while not self.outbox.matching_status.matching:
            time.sleep(0.01)

    def send(self, message):
        self.outbox.put(message)

    def receive(self, size):
        assert len(self.inbox.recv().payload.to_bytes()) == size


def patiently(connect):
    for _ in range(1000):
        try:
            return connect()
        except OSError:
            time.sleep(0.01)
    raise SystemExit("nobody listens")


def steps(link, points):
    """Both sides do as many steps of a size: the number is fixed before."""
    return max(20, min(STEPS, 2_000_000 // points))


def bodies(kind):
    link = kind(False)
    for points in SIZES:
        forces = bytes(HEADER + FORCE * points)
        for _ in range(steps(link, points)):
            link.receive(HEADER + STATE * points)
            link.send(forces)
    time.sleep(1)  # until the last are read


def continuum(kind):
    link = kind(True)
    for points in SIZES:
        states, took = bytes(HEADER + STATE * points), []
        for _ in range(steps(link, points)):
            began = time.perf_counter()
            link.send(states)
            link.receive(HEADER + FORCE * points)
            took.append(1e6 * (time.perf_counter() - began))
        tenths = statistics.quantiles(took, n=10)
        print(f"{kind.__name__:>9} {points:>7} points {statistics.median(took):>9.1f} us {tenths[-1]:>9.1f} us, {len(took)} steps", flush=True)


KINDS = {kind.__name__: kind for kind in (OverTcp, OverZenoh)}
if len(sys.argv) > 1:
    bodies(KINDS[sys.argv[1]])
else:
    for name, kind in KINDS.items():
        other = subprocess.Popen([sys.executable, __file__, name])
        continuum(kind)
        other.wait()
