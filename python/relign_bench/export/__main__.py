"""python3 -m relign_bench.export: the same as relign-export."""

import sys

from .cli import main

sys.exit(main())
