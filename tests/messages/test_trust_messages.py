"""A module beside a netlist, in a folder that nobody trusts."""

from pathlib import Path

import pytest

from modelica_like.errors import UntrustedModule
from modelica_like.netlist import load


def test_a_module_in_a_folder_that_is_not_trusted(tmp_path: Path):
    folder = tmp_path.resolve()
    (folder / "unseen_hub.py").write_text("raise RuntimeError('it ran')\n")
    (folder / "drive.toml").write_text('[parts]\nk = { is = "unseen_hub:Hub" }\n')
    with pytest.raises(UntrustedModule) as caught:
        load(folder / "drive.toml")
    assert str(caught.value) == (
        f"'unseen_hub' is a Python module, '{folder}/unseen_hub.py', in a folder that is not trusted.\n"
        '  in drive.toml:2 `k = { is = "unseen_hub:Hub" }`\n'
        "A module can do all that you can; a netlist without one only computes.\n"
        f"If you know who wrote it, trust the folder: `modelica-like trust {folder}`; or run it this once: `--trust`, "
        "in Python load(…, trust=True)."
    )
