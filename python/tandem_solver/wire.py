"""The records of PROTOCOL.md section 4, made from its layout lines.

`python3 -m tandem_solver.wire` prints the lines as ctypes has laid the records out, and the layout hash;
`tests/python.rs` compares both with the Rust ones.
"""

import ctypes
import math
import re
import struct
from itertools import chain

LAYOUT = """\
StepHeader:48{epoch:u64@0;step:u64@8;count:u64@16;flags:u64@24;travel:f64@32;set:u64@40;}
ImpState:40{position:[f64; 2]@0;velocity:[f64; 2]@16;spin:f64@32;}
ImpInfo:32{id:u64@0;radius:f64@8;mass:f64@16;group:u32@24;next:u32@28;}
ImpForce:40{force:[f64; 2]@0;couple:f64@16;stiffness:f64@24;tangential:f64@32;}
EnvelopeVertex:32{body:u64@0;position:[f64; 2]@8;reach:f64@24;}
Grant:88{epoch:u64@0;first:u64@8;steps:u64@16;flags:u64@24;epoch_start:f64@32;steps_in_epoch:u64@40;\
dt_before_epoch:f64@48;dt:f64@56;budget_omega_sq:f64@64;budget_speed:f64@72;budget_damping:f64@80;}
Limits:48{omega_sq:f64@0;contact_omega_sq:f64@8;damping:f64@16;speed:f64@24;radius_min:f64@32;mobility:f64@40;}
Ledger:184{kinetic:f64@0;kinetic_rotation:f64@8;elastic:f64@16;gravity:f64@24;contact:f64@32;friction_work:f64@40;\
viscous_work:f64@48;plastic_work:f64@56;driven_work:f64@64;momentum:[f64; 2]@72;applied_impulse:[f64; 2]@88;\
contact_impulse:[f64; 2]@104;contact_force:[f64; 2]@120;contacts:u64@136;stress_work:f64@144;\
transfer_work:f64@152;angular_momentum:f64@160;applied_moment:f64@168;contact_moment:f64@176;}
Report:320{epoch:u64@0;next:u64@8;halted:u64@16;measured:u64@24;items:u64@32;imps:u64@40;rebuilds:u64@48;\
compute_ns:u64@56;exchange_ns:u64@64;wait_ns:u64@72;cpu_ns:u64@80;limits:Limits@88;ledger:Ledger@136;}
GroupState:136{mass:f64@0;position:[f64; 2]@8;velocity:[f64; 2]@24;kinetic:f64@40;contact_force:[f64; 2]@48;\
lower:[f64; 2]@64;upper:[f64; 2]@80;contacts:u64@96;loaded_lower:[f64; 2]@104;loaded_upper:[f64; 2]@120;}
BodyState:120{position:[f64; 2]@0;velocity:[f64; 2]@16;angle:f64@32;spin:f64@40;mass:f64@48;inertia:f64@56;\
point_force:[f64; 2]@64;point_torque:f64@80;body_force:[f64; 2]@88;body_torque:f64@104;contacts:u64@112;}
PointState:96{id:u64@0;position:[f64; 2]@8;velocity:[f64; 2]@24;stress:[f64; 4]@40;volume:f64@72;mass:f64@80;\
group:u32@88;plastic_strain:f32@92;}
ContactState:56{body:u64@0;other:u64@8;with:u64@16;position:[f64; 2]@24;force:[f64; 2]@40;}"""

# Of the BLAKE3 hash of LAYOUT (clause C-3); a constant because Python's standard library has no BLAKE3.
LAYOUT_HASH = "66f7275e5398ecd8"

# Bits of StepHeader.flags and Grant.flags.
HALT_BEFORE, HALT_AFTER, WANT_ENVELOPES, NEW_SET, MEASURE, FRAME, CHECKPOINT, LAST = 1, 2, 4, 8, 16, 32, 64, 128

# Fields that may not be negative (clause W-1).
_NOT_NEGATIVE = {
    "StepHeader": ("travel",),
    "ImpForce": ("stiffness", "tangential"),
    "EnvelopeVertex": ("reach",),
    "Grant": ("dt", "dt_before_epoch", "budget_omega_sq", "budget_speed", "budget_damping"),
    "Limits": ("omega_sq", "contact_omega_sq", "damping", "speed", "radius_min", "mobility"),
    "PointState": ("volume", "mass"),
}

_SCALARS = {"f64": (ctypes.c_double, "d"), "u64": (ctypes.c_uint64, "Q"), "u32": (ctypes.c_uint32, "I"), "f32": (ctypes.c_float, "f")}


class Record(ctypes.LittleEndianStructure):
    """A record of the wire; fields start at zero and may be given by keyword."""

    NAME: str
    # The same bytes as a flat tuple of numbers, for the arrays of a step: `ImpState` is (x, y, vx, vy, spin).
    FLAT: struct.Struct

    @classmethod
    def type_name(cls):
        """The name by which iceoryx2 compares headers (clause C-2)."""
        return "tandem/" + cls.NAME

    def fault(self):
        """Name of the first field that breaks W-1 (not finite, or negative where it may not be), or None."""
        for name, kind in self._fields_:
            value = getattr(self, name)
            if isinstance(value, Record):
                bad = value.fault() is not None
            else:
                numbers = value if isinstance(value, ctypes.Array) else (value,)
                bad = not all(map(math.isfinite, numbers))
                bad |= name in _NOT_NEGATIVE.get(self.NAME, ()) and value < 0.0
            if bad:
                return name
        return None


def _records():
    made, flat = {}, {}
    for line in LAYOUT.splitlines():
        name, size, body = re.fullmatch(r"(\w+):(\d+)\{(.*)\}", line).groups()
        fields, offsets, packing = [], [], ""
        for field, kind, offset in re.findall(r"(\w+):([^@]+)@(\d+);", body):
            vector = re.fullmatch(r"\[(\w+); (\d+)\]", kind)
            if vector:
                scalar, letter = _SCALARS[vector[1]]
                fields.append((field, scalar * int(vector[2])))
                packing += letter * int(vector[2])
            elif kind in _SCALARS:
                fields.append((field, _SCALARS[kind][0]))
                packing += _SCALARS[kind][1]
            else:
                fields.append((field, made[kind]))
                packing += flat[kind]
            offsets.append(int(offset))
        record = type(name, (Record,), {"_fields_": fields, "NAME": name, "FLAT": struct.Struct("<" + packing)})
        real = [getattr(record, field).offset for field, _ in fields]
        if (ctypes.sizeof(record), real, record.FLAT.size) != (int(size), offsets, int(size)):
            raise TypeError(f"{name} cannot be laid out as {line}")
        made[name], flat[name] = record, packing
    return made


RECORDS = _records()

def pack_point(point):
    """The bytes of a PointState from its numbers; the last one, the plastic strain (clause R-5), may be left out."""
    return RECORDS["PointState"].FLAT.pack(*point, *([0.0] if len(point) == 12 else []))


StepHeader, ImpState, ImpInfo = RECORDS["StepHeader"], RECORDS["ImpState"], RECORDS["ImpInfo"]
ImpForce, EnvelopeVertex = RECORDS["ImpForce"], RECORDS["EnvelopeVertex"]
Grant, Limits, Ledger, Report = RECORDS["Grant"], RECORDS["Limits"], RECORDS["Ledger"], RECORDS["Report"]
GroupState, BodyState, PointState = RECORDS["GroupState"], RECORDS["BodyState"], RECORDS["PointState"]
ContactState = RECORDS["ContactState"]


def finite(rows):
    """Whether every number of some flat tuples is finite."""
    return all(map(math.isfinite, chain.from_iterable(rows)))


def layout_lines():
    """The layout lines of the records as ctypes has them."""
    scalar = {kind: name for name, (kind, _) in _SCALARS.items()}

    def written(kind):
        if issubclass(kind, ctypes.Array):
            return f"[{written(kind._type_)}; {kind._length_}]"
        return kind.NAME if issubclass(kind, Record) else scalar[kind]

    def line(record):
        fields = (f"{name}:{written(kind)}@{getattr(record, name).offset};" for name, kind in record._fields_)
        return f"{record.NAME}:{ctypes.sizeof(record)}{{{''.join(fields)}}}"

    return [line(record) for record in RECORDS.values()]


if __name__ == "__main__":
    print("\n".join([*layout_lines(), LAYOUT_HASH]))
