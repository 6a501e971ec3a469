"""Puts the compiled run-time of FMUs into the wheel, for this machine or for the platforms of a release, and examples.

`MODELICA_LIKE_PLATFORMS` chooses: names with commas, `all`, `none`, or by default this machine's platform if there is a
compiler. The wheel is tagged for the platforms that it has a library for; without any it is pure Python.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from shutil import which
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

OLDEST_GLIBC = (2, 17)
_TAGS = {
    "x86_64-windows": "win_amd64",
    "aarch64-windows": "win_arm64",
    "x86_64-darwin": "macosx_11_0_x86_64",
    "aarch64-darwin": "macosx_11_0_arm64",
}


class RuntimeHook(BuildHookInterface):  # pyright: ignore[reportMissingTypeArgument]
    """Compiles the run-time before a wheel, or an editable install, is made."""

    def dependencies(self) -> list[str]:
        """FMPy has the headers of the standard; zig compiles for other platforms, and where there is no compiler."""
        release = os.environ.get("MODELICA_LIKE_PLATFORMS", "none") != "none"
        compiler = os.environ.get("CC") or any(map(which, ("cc", "gcc", "clang")))
        return ["fmpy>=0.3.20", *(["ziglang>=0.13"] if release or not compiler else [])]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, and tell hatch what to take along. Frontends that ask for the metadata first call this twice."""
        sys.path.insert(0, self.root)
        from modelica_like.errors import ModelicaLikeError
        from modelica_like.fmi.build import BROWSER, RUNTIMES, native_platform
        from modelica_like.fmi.runtime import SHIPPED, build_runtime

        asked = os.environ.get("MODELICA_LIKE_PLATFORMS", "")
        try:
            named = asked or native_platform()
            names = () if named == "none" else tuple(RUNTIMES) if named == "all" else tuple(named.split(","))
            built = [build_runtime(name, SHIPPED / name) for name in names]
        except ModelicaLikeError as error:
            if asked:
                raise
            self.app.display_warning(f"The run-time of FMUs is not compiled now, but at first use. {error}")
            built = []
        for old in {*SHIPPED.glob("*/*")} - {*built}:
            old.unlink()
        if version == "standard":
            build_data["force_include"][str(Path(self.root) / "examples")] = "modelica_like/examples"
        if built:
            tags = [wheel_tag(library) for library in built if library.parent.name != BROWSER.name]
            if tags:
                build_data.update(pure_python=False, tag=f"py3-none-{'.'.join(tags)}")
            build_data["artifacts"].append("modelica_like/fmi/runtimes/*/*")


def wheel_tag(library: Path) -> str:
    """Return the platform tag of a library: on Linux by the glibc that it needs."""
    name = library.parent.name
    if name in _TAGS:
        return _TAGS[name]
    found = re.findall(rb"GLIBC_(\d+)\.(\d+)", library.read_bytes())
    machine = name.partition("-")[0]
    if not found:  # another C library
        return f"linux_{machine}"
    major, minor = max(OLDEST_GLIBC, *((int(a), int(b)) for a, b in found))
    return f"manylinux_{major}_{minor}_{machine}"
