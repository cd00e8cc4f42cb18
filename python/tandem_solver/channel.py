"""Channels of a run (PROTOCOL.md section 1) on iceoryx2's Python bindings, and its wake-ups."""

import ctypes
import fcntl
import itertools
import mmap
import os
import pathlib
import time

import iceoryx2 as iox2

from .wire import LAYOUT_HASH, StepHeader

# Clause B-3: how long at most to block before looking again, in s.
NAP = 0.01
# Longest time to look again and again before blocking, in s.
LONGEST_SPIN = 100e-6
# Bytes of the file of wake-ups: a line of 64 bytes for each ordered pair of parties.
WAKES_SIZE = 64 * 9
# Clause C-7: longest wait in s for room in a channel.
SEND_TIMEOUT = 10.0
# Longest time in s between two looks that counts as silence: who comes back later was stopped.
ROUND = 0.1


class SessionError(Exception):
    """The session is over for this solver; the coupler is told why."""


class Aborted(SessionError):
    """The coupler said Abort."""


class CouplerGone(SessionError):
    """Nobody holds the run's lock any more."""


class Run:
    """The directory and the names of a run (clauses O-2 to O-5, O-8)."""

    def __init__(self, run_id, party):
        if not (1 <= len(run_id) <= 16 and run_id.isascii() and run_id.isalnum()):
            raise SessionError(f"`{run_id}` is not the id of a run")
        root = os.path.join(os.environ.get("TANDEM_RUNTIME_DIR") or "/dev/shm", f"tandem-{run_id}")
        self.root, self.party = pathlib.Path(root), party
        over = f"there is no run `{run_id}` to join on this machine (it may be over)"
        try:
            # Open until the end: the lock is right even after the file was removed (clause O-4).
            self.lock = os.open(self.root / "lock", os.O_RDONLY)
            self._take_part()
        except (FileNotFoundError, BlockingIOError) as error:
            raise SessionError(over) from error
        except OSError as error:
            raise SessionError(f"cannot join the run `{run_id}`: {error}") from error
        config = iox2.config.default()
        config.global_cfg.prefix = iox2.FileName.new(f"tandem_{run_id}_")
        config.global_cfg.root_path = iox2.Path.new(root)
        config.global_cfg.service.cleanup_dead_nodes_on_open = False
        config.global_cfg.node.cleanup_dead_nodes_on_creation = False
        config.global_cfg.node.cleanup_dead_nodes_on_destruction = False
        builder = iox2.NodeBuilder.new().name(iox2.NodeName.new(party)).config(config)
        builder = builder.signal_handling_mode(iox2.SignalHandlingMode.Disabled)
        self.node = builder.create(iox2.ServiceType.Ipc)
        wakes = os.open(self.root / "wakes", os.O_RDWR | os.O_NOFOLLOW)
        try:
            self.wakes = mmap.mmap(wakes, WAKES_SIZE)
        finally:
            os.close(wakes)

    def _take_part(self):
        """Clause O-8: notes that this process takes part, before it makes anything in shared memory, until it ends."""
        for number in itertools.count():
            try:
                note = self.root / f"joined-{os.getpid()}.{number}"
                self.joined = os.open(note, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600)
                break
            except FileExistsError:
                continue
        fcntl.flock(self.joined, fcntl.LOCK_EX | fcntl.LOCK_NB)
        # In this order: who removes the run takes this file away first and then looks for notes.
        os.stat(self.root / "lock")

    def coupler_lives(self):
        """Clause O-4: the coupler holds the lock for as long as it lives."""
        try:
            fcntl.flock(self.lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:
            return False
        fcntl.flock(self.lock, fcntl.LOCK_UN)
        return False

    def held(self):
        """Clause S-11: whether another party is stopped, blocked within the system, or waits for its disk."""
        if (self.root / "waits-coupler").exists():
            return True
        for party in {"coupler", "mpm", "dem"} - {self.party}:
            try:
                pid = int((self.root / f"pid-{party}").read_text())
                stat = pathlib.Path(f"/proc/{pid}/stat").read_text()
            except (OSError, ValueError):
                continue
            if stat.rpartition(")")[2].split()[0] in "TtD":
                return True
        return False

    def _service(self, name):
        attributes = iox2.AttributeVerifier.new()
        attributes = attributes.require(iox2.AttributeKey.new("layout"), iox2.AttributeValue.new(LAYOUT_HASH))
        builder = self.node.service_builder(iox2.ServiceName.new(name)).publish_subscribe(iox2.Slice[ctypes.c_uint8])
        builder = builder.user_header(StepHeader).max_publishers(1).max_subscribers(1).max_nodes(3)
        builder = builder.subscriber_max_buffer_size(4).subscriber_max_borrowed_samples(1)
        return builder.history_size(0).enable_safe_overflow(False).open_with_attributes(attributes)

    def sender(self, name, room=8192):
        """The sending end of a channel; `room` is that of its first segment in bytes."""
        service = self._service(name)
        builder = service.publisher_builder().initial_max_slice_len(room)
        builder = builder.allocation_strategy(iox2.AllocationStrategy.PowerOfTwo).max_loaned_samples(1)
        # In a recorded run a message that only one of two receivers has room for cannot be sent again.
        one = service.static_config.max_subscribers == 1
        strategy = iox2.BackpressureStrategy.DiscardData if one else iox2.BackpressureStrategy.RetryUntilDelivered
        return Sender(self, service, builder.backpressure_strategy(strategy).create())

    def receiver(self, name, record):
        """The receiving end of a channel of these records."""
        return Receiver(self._service(name).subscriber_builder().create(), ctypes.sizeof(record))

    def wake(self, sender, receiver):
        """The wake-ups from one party to another one (clause B-1)."""
        return Wake(self.wakes, sender, receiver)


class Wake:
    """The wake-ups from one party to another one: a counter of messages, and whether the receiver is blocked. The sender
    calls `wake`, the receiver `block`."""

    FUTEX, WAIT, WAKE = 202, 0, 1
    SYSTEM = ctypes.CDLL(None, use_errno=True).syscall
    SYSTEM.restype = ctypes.c_long

    def __init__(self, wakes, sender, receiver):
        parties = ("coupler", "mpm", "dem")
        at = 64 * (3 * parties.index(sender) + parties.index(receiver))
        self.count, self.blocked = ctypes.c_uint32.from_buffer(wakes, at), ctypes.c_uint32.from_buffer(wakes, at + 4)
        self.seen, self.spin = 0, Spin()

    def _futex(self, what, value, limit=None):
        self.SYSTEM(ctypes.c_long(self.FUTEX), ctypes.byref(self.count), ctypes.c_int(what), ctypes.c_uint32(value),
                    limit and ctypes.byref(limit), None, 0)

    def wake(self):
        """After a message has been sent. The system is always asked: it orders the new count before its look for who
        is blocked, which Python does not."""
        self.count.value = (self.count.value + 1) & 0xFFFFFFFF
        self._futex(self.WAKE, 1)

    def block(self, at_most):
        """Until something has been sent since the last call, for `at_most` s at most. The system does not block if the
        count has moved since then, so no wake-up is lost."""
        if self.count.value == self.seen:
            self.blocked.value = 1
            limit = (ctypes.c_long * 2)(int(at_most), int(at_most % 1.0 * 1e9))
            self._futex(self.WAIT, self.seen, limit)
            self.blocked.value = 0
        self.seen = self.count.value


class Spin:
    """How long to look for a message before blocking: a little longer than answers have lately taken, and not at all for
    1, 3, 7, up to 63 waits after a spin in vain, until one succeeds again."""

    MARGIN = 5e-6

    def __init__(self):
        self.usual, self.in_vain, self.left_out = 0.5 * LONGEST_SPIN, 0, 0

    def next(self):
        """For how long in s the next wait spins."""
        if self.left_out > 0:
            self.left_out -= 1
            return 0.0
        return min(LONGEST_SPIN, 2.0 * self.usual + self.MARGIN)

    def ended(self, limit, after):
        """The answer came `after` the begin of a wait that was to spin for `limit`."""
        if after <= LONGEST_SPIN:
            self.usual = (7.0 * self.usual + after) / 8.0
        if limit > 0.0:
            self.in_vain = 0 if after <= limit + self.MARGIN else min(self.in_vain + 1, 6)
            self.left_out = 2**self.in_vain - 1


class Sender:
    """The sending end of a channel."""

    def __init__(self, run, service, publisher):
        self.run, self.service, self.publisher = run, service, publisher

    def send(self, header, count, data):
        """Sends `count` records, whose bytes are `data`, under `header` (clause C-4: the count is set here). Where there is
        no room it tries again, while the coupler lives (clause C-7)."""
        header.count = count
        begin = time.perf_counter()
        while True:
            sample = self.publisher.loan_slice_uninit(len(data))
            ctypes.memmove(sample.payload_ptr, data, len(data))
            ctypes.memmove(sample.user_header_ptr, ctypes.addressof(header), ctypes.sizeof(header))
            if sample.assume_init().send() > 0 or self.service.dynamic_config.number_of_subscribers == 0:
                return
            if not self.run.coupler_lives():
                raise CouplerGone("the coupler is gone while a channel is full")
            if time.perf_counter() - begin > SEND_TIMEOUT:
                raise SessionError(f"a channel has been full for {SEND_TIMEOUT:g} s (C-7)")
            time.sleep(NAP)


class Receiver:
    """The receiving end of a channel."""

    def __init__(self, subscriber, size):
        self.subscriber, self.size = subscriber, size

    def receive(self):
        """The header, the number of records and a copy of their bytes (clause C-5), or None."""
        sample = self.subscriber.receive()
        if sample is None:
            return None
        data = ctypes.string_at(sample.payload_ptr, sample.header.number_of_elements)
        header = StepHeader.from_buffer_copy(ctypes.string_at(sample.user_header_ptr, ctypes.sizeof(StepHeader)))
        sample.delete()
        count, rest = divmod(len(data), self.size)
        if rest:
            raise SessionError(f"a message of {len(data)} bytes, which are not whole records of {self.size} (C-4)")
        return header, count, data


def wait(look, wake, alarm, patience, late, held):
    """What `look` finds. Looks for a short while, then blocks until it is woken, again and again; `alarm` raises if there
    is no use in waiting; after `patience` s of silence `SessionError(late)`. Silence does not count while `held()`, nor
    beyond `ROUND` between two looks (clause S-11)."""
    begin = time.perf_counter()
    limit = wake.spin.next()
    while True:
        spun = time.perf_counter() - begin
        found = look()
        if found is not None:
            wake.spin.ended(limit, time.perf_counter() - begin)
            return found
        if spun >= limit:
            break
    mark = asked = begin
    silence = 0.0
    while True:
        wake.block(NAP)
        found = look()
        now = time.perf_counter()
        if found is not None:
            wake.spin.ended(limit, now - begin)
            return found
        if now - asked < NAP:
            continue
        asked = now
        alarm()
        if not held():
            silence += min(now - mark, ROUND)
        mark = now
        if silence > patience:
            raise SessionError(f"{late} (waited {silence:.1f} s)")
