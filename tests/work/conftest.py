"""The work of examples is a module beside the test."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
