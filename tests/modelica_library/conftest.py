"""Tests that read the standard library's text, which is not part of this project."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
