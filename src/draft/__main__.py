"""`python -m draft` is the same as `draft`."""

import sys

from draft.cli import main

sys.exit(main())
