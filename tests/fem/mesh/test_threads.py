"""gmsh where it did not expect to be: outside the main thread."""

import subprocess
import sys

PROGRAM = """
import sys, threading
from nanorom.fem.mesh import vetting

def mesh():
    gmsh = vetting.gmsh()
    gmsh.initialize(readConfigFiles=False)
    gmsh.finalize()
    done.append(True)

done = []
thread = threading.Thread(target=mesh)
thread.start()
thread.join()
sys.exit(0 if done else 1)
"""


def test_gmsh_runs_outside_the_main_thread():
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
