"""`python -m eomgen` is `eomgen`."""

import sys

from eomgen.cli import main

sys.exit(main())
