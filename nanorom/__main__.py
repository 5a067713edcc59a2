"""`python -m nanorom` is the command line."""

import sys

from nanorom.cli import main

sys.exit(main())
