"""Kernel tests run on the devices of the whole suite; this folder's own modules are importable by name."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
