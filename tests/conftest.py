"""For all tests."""

import os
import signal
import sys
from pathlib import Path

# Signals, limits on files, pipes of a browser, nm, sanitizers, an FMU that crashes: not on Windows.
_POSIX = [
    "cli/test_interrupts.py", "exact/test_random_drives_exactly.py", "fmi/test_build.py", "fmi/test_codegen.py",
    "fmi/test_runtime.py", "fmi/test_sanitized.py", "fmus/test_safety.py", "messages/test_fmu_messages.py", "page",
    "netlist/test_trust.py", "messages/test_trust_messages.py", "report/test_writing.py",
]  # fmt: skip
collect_ignore = _POSIX if os.name == "nt" else []


sys.path.insert(0, str(Path(__file__).parent / "helpers"))


def pytest_configure() -> None:
    # A shell starts what runs in its background with Ctrl-C ignored, and children inherit that.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    # The folders that the user trusts are none of the tests'.
    os.environ["MODELICA_LIKE_CONFIG"] = str(Path(__file__).parent / "no_configuration")
