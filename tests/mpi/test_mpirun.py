"""A part of the suite again on several ranks."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CHOSEN = [
    "tests/mpi/test_agreement.py",
    "tests/mpi/test_verification.py",
    "tests/fem/routes/test_drum.py",
]
NAMES = {  # by number of ranks
    2: "agreement or verification or table_1 or more_modes",
    3: "verification or agreement and (paper or static or columns or dealt or formed)",
}
LIMIT = 600  # seconds


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", NAMES)
def test_suite_passes_on_ranks(ranks):
    suite = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", NAMES[ranks]]
    done = subprocess.run(
        ["mpirun", "-n", str(ranks), *suite, *CHOSEN],
        cwd=ROOT,
        env=dict(os.environ),  # without what MPI, if loaded here, has put in beside Python
        capture_output=True,
        text=True,
        timeout=LIMIT,
    )
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-2000:]
    assert done.stdout.count(" passed") == ranks, done.stdout[-5000:]
