"""Control messages: orders and notices of PROTOCOL.md section 3, bytes in the layout of bincode 1."""

import struct
from dataclasses import dataclass, field

PROTOCOL = (8, 0)
PARTIES = {"coupler": 0, "mpm": 1, "dem": 2}
# Clause M-1.
MAX_BYTES = 256 << 20


class DecodeError(Exception):
    """Bytes that are not the message they should be (clause S-1)."""


class _Reader:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, count):
        if count > len(self.data) - self.at:
            raise DecodeError(f"{count} bytes at {self.at} of {len(self.data)}")
        self.at += count
        return self.data[self.at - count : self.at]

    def number(self, packing):
        return struct.unpack("<" + packing, self.take(struct.calcsize("<" + packing)))[0]

    def string(self):
        try:
            return self.take(self.number("Q")).decode()
        except UnicodeDecodeError as error:
            raise DecodeError(str(error)) from None

    def bool(self):
        byte = self.number("B")
        if byte > 1:
            raise DecodeError(f"{byte} is not a bool")
        return byte == 1


@dataclass(frozen=True)
class Configure:
    scene_hash: str
    config: str
    coupled: bool
    deadline: float
    restore: bool = False


class Drain:
    """No more grants."""


class Close:
    """The process may end."""


@dataclass(frozen=True)
class Abort:
    reason: str


def decode_order(data):
    """The order in `data`, all of which must be used."""
    if len(data) > MAX_BYTES:
        raise DecodeError(f"{len(data)} bytes")
    reader = _Reader(data)
    variant = reader.number("I")
    if variant == 0:
        order = Configure(reader.string(), reader.string(), reader.bool(), reader.number("d"), reader.bool())
    elif variant == 1:
        order = Drain()
    elif variant == 2:
        order = Close()
    elif variant == 3:
        order = Abort(reader.string())
    else:
        raise DecodeError(f"there is no order {variant}")
    if reader.at != len(data):
        raise DecodeError(f"{len(data) - reader.at} bytes left over")
    return order


def _string(text):
    data = text.encode()
    return struct.pack("<Q", len(data)) + data


@dataclass
class Readiness:
    """What a solver says of itself once it is configured (the fields of Ready after the hash)."""

    items: int
    bytes: int = 0
    courant_time: float = 0.0
    mass_min: float = 0.0
    stiffness_max: float = 0.0
    notes: list = field(default_factory=list)


class Refusal(Exception):
    """The configuration is not taken: dotted key, and what would be accepted."""

    def __init__(self, key, message):
        super().__init__(f"{key}: {message}")
        self.key, self.message = key, message


class Fault(Exception):
    """A solver cannot go on."""

    def encoded(self):
        return struct.pack("<I", 4) + _string(str(self))


class NotFinite(Fault):
    """`what` of `item` is no longer finite."""

    def __init__(self, what, item):
        super().__init__(f"{what} of {item} is not finite")
        self.what, self.item = what, item

    def encoded(self):
        return struct.pack("<I", 0) + _string(self.what) + _string(self.item)


def hello(party, identity, pid, capabilities=()):
    said = struct.pack("<4I", 0, *PROTOCOL, PARTIES[party]) + _string(identity) + struct.pack("<I", pid)
    return said + struct.pack("<Q", len(capabilities)) + b"".join(_string(name) for name in capabilities)


def ready(scene_hash, r):
    numbers = struct.pack("<QQddd", r.items, r.bytes, r.courant_time, r.mass_min, r.stiffness_max)
    notes = struct.pack("<Q", len(r.notes)) + b"".join(map(_string, r.notes))
    return struct.pack("<I", 1) + _string(scene_hash) + numbers + notes


def refused(refusal):
    return struct.pack("<I", 2) + _string(refusal.key) + _string(refusal.message)


def failed(step, fault, message):
    option = b"\0" if fault is None else b"\1" + fault.encoded()
    return struct.pack("<IQ", 3, step) + option + _string(message)


def bye():
    return struct.pack("<I", 4)
