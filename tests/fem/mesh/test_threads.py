"""gmsh where it did not expect to be: outside the main thread, and beside a Ctrl-C of others."""

import subprocess
import sys

import pytest

PROGRAM = """
import sys, threading
from nanorom.fem.mesh import vetting

def mesh():
    vetting.start().finalize()
    done.append(True)

done = []
thread = threading.Thread(target=mesh)
thread.start()
thread.join()
sys.exit(0 if done else 1)
"""
INTERRUPT = """
import signal
before = signal.getsignal(signal.SIGINT)
from nanorom.fem.mesh import vetting
vetting.start().finalize()
assert signal.getsignal(signal.SIGINT) is before
"""


@pytest.mark.parametrize("program", [PROGRAM, INTERRUPT])
def test_gmsh_runs_in_any_thread_and_leaves_ctrl_c_alone(program):
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
