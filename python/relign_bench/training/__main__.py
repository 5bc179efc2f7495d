"""python3 -m relign_bench.training: the same as relign-train."""

import sys

from .cli import main

sys.exit(main())
