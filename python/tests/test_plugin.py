"""The plugin for pytest, with a program that says verdicts in the place of the kit."""

import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

try:
    import pytest  # noqa: F401
except ImportError as error:
    raise unittest.SkipTest(str(error)) from None

CLAUSES = [
    {"id": "A-1", "level": "MUST", "title": "first", "verdict": "pass", "measured": "3 s"},
    {"id": "A-2", "level": "MUST", "title": "second", "verdict": "fail", "step": 4, "expected": "one", "got": "two"},
    {"id": "A-3", "level": "MUST", "title": "third", "verdict": "fail", "step": None, "expected": "a", "got": "b"},
    {"id": "A-4", "level": "SHOULD", "title": "fourth", "verdict": "not_applicable", "reason": "does not take discs"},
    {"id": "A-5", "level": "MUST", "title": "fifth", "verdict": "blocked", "by": "A-2"},
]
KIT = """#!{python}
import sys
words = sys.argv[1:]
assert words[:3] == ["conformance", "--mpm", "my solver"] and words[5:] == ["--require", "held"], words
open(words[words.index("--json") + 1], "w").write({document!r})
print("the last words")
sys.exit({status})
"""


class Plugin(unittest.TestCase):
    def pytest(self, clauses, status):
        with tempfile.TemporaryDirectory() as folder:
            kit = Path(folder) / "kit"
            kit.write_text(KIT.format(python=sys.executable, document=json.dumps({"clauses": clauses}), status=status))
            kit.chmod(0o755)
            # The plugin of this tree, whatever is installed.
            path = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
            words = ["-m", "pytest", "-p", "tandem_pytest", "-rsxf", "--tandem-mpm", "my solver"]
            ended = subprocess.run(
                [sys.executable, *words, "--tandem-options", "--require held", folder],
                capture_output=True, text=True, cwd=folder, env={**os.environ, "TANDEM": str(kit), "PYTHONPATH": path},
            )
            return ended.returncode, ended.stdout + ended.stderr

    def test_a_clause_is_a_test_and_skips_are_told(self):
        status, said = self.pytest(CLAUSES, 1)
        self.assertEqual(status, 1, said)
        self.assertIn("3 failed, 1 passed, 2 skipped", said)
        for words in ("step 4\nexpected one\ngot      two", "does not take discs", "blocked by A-2", "the last words"):
            self.assertIn(words, said)

    def test_a_kept_protocol_passes_and_one_that_was_not_judged_enough_fails(self):
        status, said = self.pytest(CLAUSES[:1], 0)
        self.assertEqual(status, 0, said)
        self.assertIn("2 passed", said)
        status, said = self.pytest(CLAUSES[:1], 1)
        self.assertEqual(status, 1, said)
        self.assertIn("1 failed, 1 passed", said)


if __name__ == "__main__":
    unittest.main()
