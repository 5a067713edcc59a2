"""`python -m nanorom` is the command line."""

import sys

from nanorom.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
