"""The packing of scenes/bardenhagen2000/shear.toml: sizes as the paper gives them, and no two grains in one place."""

import math
import pathlib
import sys
import tomllib
import unittest

SCENES = pathlib.Path(__file__).resolve().parents[2] / "scenes" / "bardenhagen2000"
sys.path.insert(0, str(SCENES))

import packing  # noqa: E402


def gaps(discs, height):
    """Between every two, round the box."""
    for k, (x, y, r) in enumerate(discs):
        for u, v, q in discs[:k]:
            dy = (v - y + 0.5 * height) % height - 0.5 * height
            yield math.hypot(u - x, dy) - r - q


class Packing(unittest.TestCase):
    def test_sizes_have_the_range_and_the_mean_that_are_asked_for(self):
        found = packing.sizes(369, 31.0, 57.0, 250.0)
        self.assertEqual(len(found), 369)
        for value, expected in ((min(found), 31.0), (max(found), 250.0), (sum(found) / 369, 57.0)):
            self.assertAlmostEqual(value, expected, delta=1e-9)

    def test_discs_keep_their_gap_round_the_box_and_are_the_same_again(self):
        radii = [0.5 * d for d in packing.sizes(40, 31.0, 57.0, 120.0)]
        side = math.sqrt(sum(math.pi * r * r for r in radii) / 0.7)
        centres = packing.pack(radii, side, side, 2.0, 7)
        discs = [(x, y, r) for (x, y), r in zip(centres, radii)]
        self.assertGreater(min(gaps(discs, side)), 2.0)
        self.assertTrue(all(0.0 <= x <= side for x, _, _ in discs))
        self.assertEqual(centres, packing.pack(radii, side, side, 2.0, 7))
        # Some are across the periodic walls from one another.
        self.assertTrue(any(y < r or y > side - r for _, y, r in discs))

    def test_what_does_not_fit_is_refused(self):
        with self.assertRaises(ValueError):
            packing.pack([1.0] * 20, 5.0, 5.0, 0.0, 1, rounds=50)

    def test_no_two_grains_of_the_scene_are_in_one_place(self):
        with open(SCENES / "shear.toml", "rb") as file:
            fills = [group["fill"] for group in tomllib.load(file)["mpm"]["points"]]
        self.assertEqual(len(fills), 369)
        discs = [(*fill["disc"]["center"], fill["disc"]["radius"]) for fill in fills if "disc" in fill]
        self.assertGreater(min(gaps(discs, 1.2e-3)), 2.8e-6)
        # Those that a wall cuts: their corners are in no disc, and in no other's reach.
        cut = [fill["polygon"]["vertices"] for fill in fills if "polygon" in fill]
        self.assertEqual(len(discs) + len(cut), 369)
        for k, corners in enumerate(cut):
            dots = [(x, y, 0.0) for x, y in corners]
            for disc in discs:
                self.assertGreater(min(gap for dot in dots for gap in gaps([disc, dot], 1.2e-3)), 2.8e-6)
            for other in cut[:k]:
                between = min(gap for a in dots for b in other for gap in gaps([a, (*b, 0.0)], 1.2e-3))
                self.assertGreater(between, 2.8e-6)


if __name__ == "__main__":
    unittest.main()
