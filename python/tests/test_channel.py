"""Channels that are full (clause C-7)."""

import ctypes
import fcntl
import os
import pathlib
import tempfile
import unittest
from unittest import mock

import iceoryx2 as iox2

from tandem_solver import channel, wire


class FullChannel(unittest.TestCase):
    def setUp(self):
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        self.enterContext(mock.patch.dict(os.environ, {"TANDEM_RUNTIME_DIR": place.name}))
        root = pathlib.Path(place.name) / "tandem-full"
        root.mkdir()
        (root / "wakes").write_bytes(bytes(channel.WAKES_SIZE))
        self.lock = (root / "lock").open("w")
        fcntl.flock(self.lock, fcntl.LOCK_EX)
        self.run_ = channel.Run("full", "mpm")
        layout = iox2.AttributeSpecifier.new()
        layout = layout.define(iox2.AttributeKey.new("layout"), iox2.AttributeValue.new(wire.LAYOUT_HASH))
        builder = self.run_.node.service_builder(iox2.ServiceName.new("mpm/saved"))
        builder = builder.publish_subscribe(iox2.Slice[ctypes.c_uint8]).user_header(wire.StepHeader).max_publishers(1)
        builder = builder.max_subscribers(1).max_nodes(3).subscriber_max_buffer_size(4).history_size(0)
        self.service = builder.enable_safe_overflow(False).create_with_attributes(layout)
        self.receiver = self.run_.receiver("mpm/saved", ctypes.c_uint8)
        self.sender = self.run_.sender("mpm/saved")

    def tearDown(self):
        self.lock.close()
        # Before their directory.
        del self.sender, self.receiver, self.service, self.run_

    def test_what_has_no_room_is_sent_again(self):
        """A receiver that had not looked yet lost what came after four messages."""
        received = []

        def look():
            received.append(self.receiver.receive())
            return True

        with mock.patch.object(self.run_, "coupler_lives", look):
            for step in range(8):
                self.sender.send(wire.StepHeader(step=step), 1, b"x")
        received += [self.receiver.receive() for _ in range(4)]
        self.assertEqual([found[0].step for found in received], list(range(8)))

    def test_a_send_ends_when_the_coupler_is_gone(self):
        """It went on trying for ever."""
        self.sender.send(wire.StepHeader(), 1, b"x")
        self.assertIsNotNone(self.receiver.receive())
        self.lock.close()
        with self.assertRaises(channel.CouplerGone):
            for _ in range(5):
                self.sender.send(wire.StepHeader(), 1, b"x")
