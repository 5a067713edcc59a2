"""A command in a process of its own, and what it leaves."""

import subprocess
import sys

LONGEST = 120  # seconds; ranks that wait for each other for ever must not stop the suite

SWEEP = """
[damping]
quality_factor = 50
[drive]
direct = ["1 mPa", "2 mPa"]
[sweep]
from = "0.98 f1"
to = "1.02 f1"
"""


def python(*arguments, **options):
    return subprocess.run(
        [sys.executable, *map(str, arguments)], capture_output=True, text=True, **options
    )


def names(directory):
    return sorted(path.name for path in directory.iterdir())
