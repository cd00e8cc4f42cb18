"""Bytes of messages and records, against the examples of PROTOCOL.md section 3."""

import ctypes
import math
import unittest

from tandem_solver import BODY, DEM, Readiness, Refusal, check_fields
from tandem_solver import blake3, control, wire


class Control(unittest.TestCase):
    def test_the_bytes_of_the_protocol_page(self):
        hello = "00000000 08000000 00000000 02000000 0800000000000000 6469736320302e31 67120000"
        capabilities = "0100000000000000 0400000000000000 73617665"
        self.assertEqual(control.hello("dem", "disc 0.1", 4711, ["save"]), bytes.fromhex(hello + capabilities))
        order = control.decode_order(bytes.fromhex(
            "00000000 0400000000000000 61623132 0200000000000000 7b7d 01 0000000000003e40 00"))
        self.assertEqual(order, control.Configure("ab12", "{}", True, 30.0))
        self.assertIsInstance(control.decode_order(bytes.fromhex("01000000")), control.Drain)
        ready = (
            "01000000 0400000000000000 61623132 0100000000000000 0000000000000000 0000000000000000"
            "0000000000000440 00000000004ced40 0100000000000000 0200000000000000 6869"
        )
        said = Readiness(items=1, mass_min=2.5, stiffness_max=6e4, notes=["hi"])
        self.assertEqual(control.ready("ab12", said), bytes.fromhex(ready))

    def test_a_fault_says_which_kind_it_is(self):
        data = control.failed(3, control.NotFinite("velocity", "body 0"), "m")
        self.assertEqual(data[:17], bytes.fromhex("03000000 0300000000000000 01 00000000"))
        self.assertEqual(control.failed(3, None, "m")[12:13], b"\0")

    def test_bytes_that_are_no_message_are_refused(self):
        good = bytes.fromhex("03000000 0200000000000000 6869")
        self.assertEqual(control.decode_order(good), control.Abort("hi"))
        lying = bytes.fromhex("03000000 ffffffffffffffff 6869")
        unknown, not_text = bytes.fromhex("04000000"), bytes.fromhex("03000000 0100000000000000 ff")
        for bad in [good[:-1], good + b"\0", lying, unknown, not_text, b""]:
            with self.assertRaises(control.DecodeError):
                control.decode_order(bad)


class Hash(unittest.TestCase):
    def test_lengths_at_the_edges_of_blocks_and_chunks(self):
        """Digests of the reference implementation for bytes that count up to 250 again and again."""
        known = {
            0: "af1349b9f5f9a1a6a0404dea36dcc9499bcb25c9adc112b7cc9a93cae41f3262",
            1: "2d3adedff11b61f14c886e35afa036736dcd87a74d27b5c1510225d0f592e213",
            1023: "10108970eeda3eb932baac1428c7a2163b0e924c9a9e25b35bba72b28f70bd11",
            1024: "42214739f095a406f3fc83deb889744ac00df831c10daa55189b5d121c855af7",
            1025: "d00278ae47eb27b34faecf67b4fe263f82d5412916c1ffd97c8cb7fb814b8444",
            2049: "5f4d72f40d7a5f82b15ca2b2e44b1de3c2ef86c426c95c1af0b6879522563030",
            5121: "628bd2cb2004694adaab7bbd778a25df25c47b9d4155a55f8fbd79f2fe154cff",
        }
        for length, digest in known.items():
            self.assertEqual(blake3.digest(bytes(i % 251 for i in range(length))).hex(), digest, length)


class Configuration(unittest.TestCase):
    GOOD = {
        "gravity": [0, -9.81], "body": [], "contact": {}, "body_contact": None, "overlap": "each_edge",
        "contact_pair": [], "point_surfaces": [], "group_pair": [], "contact_resolution": None, "interface": "points",
        "skin": 1e-3, "threads": 1,
    }

    def test_what_is_missing_odd_or_unknown_is_refused_by_its_key(self):
        check_fields("dem", self.GOOD, DEM)
        without = {name: value for name, value in self.GOOD.items() if name != "skin"}
        for bad, key in [
            (without, "dem.skin"),
            ({**self.GOOD, "skin": "thick"}, "dem.skin"),
            ({**self.GOOD, "threads": 0}, "dem.threads"),
            ({**self.GOOD, "threads": True}, "dem.threads"),
            ({**self.GOOD, "gravity": [0.0]}, "dem.gravity"),
            ({**self.GOOD, "overlap": 1}, "dem.overlap"),
            ({**self.GOOD, "buoyancy": 1}, "dem"),
        ]:
            with self.assertRaises(Refusal) as refused:
                check_fields("dem", bad, DEM)
            self.assertEqual(refused.exception.key, key)
        with self.assertRaises(Refusal):
            check_fields("dem.body.0", {}, BODY)


class Records(unittest.TestCase):
    def test_flat_tuples_are_the_same_bytes(self):
        force = wire.ImpForce(force=(1.0, -2.0), couple=0.5, stiffness=3.0, tangential=2.0)
        self.assertEqual(bytes(force), wire.ImpForce.FLAT.pack(1.0, -2.0, 0.5, 3.0, 2.0))
        point = (7, 0.1, 0.2, 0.3, 0.4, 1.0, 2.0, 3.0, 4.0, 1e-4, 0.5, 2)
        self.assertEqual(wire.pack_point(point), wire.PointState.FLAT.pack(*point, 0))
        strained = wire.PointState.from_buffer_copy(wire.pack_point((*point, 0.25)))
        self.assertEqual((strained.plastic_strain, strained.group, strained.mass), (0.25, 2, 0.5))
        info = wire.ImpInfo.FLAT.pack(7, 1e-3, 0.5, 2, 0)
        self.assertEqual(wire.ImpInfo.from_buffer_copy(info).group, 2)

    def test_a_number_that_is_not_finite_is_named(self):
        self.assertIsNone(wire.Report().fault())
        self.assertEqual(wire.ImpState(velocity=(0.0, math.nan)).fault(), "velocity")
        self.assertEqual(wire.Limits(speed=-1.0).fault(), "speed")
        self.assertEqual(wire.Report(limits=wire.Limits(omega_sq=math.inf)).fault(), "limits")

    def test_the_layout_is_that_of_ctypes(self):
        self.assertEqual(wire.layout_lines(), wire.LAYOUT.splitlines())
        self.assertEqual(ctypes.sizeof(wire.Report), 320)
        self.assertTrue(all(ctypes.alignment(record) == 8 for record in wire.RECORDS.values()))


if __name__ == "__main__":
    unittest.main()
