"""The netlists of examples/components and examples/elements: each runs, keeps its energy, gives its closed forms."""

import circuit_numbers as circuit_numbers
import component_numbers as component_numbers
import element_numbers as element_numbers
import mover_numbers as mover_numbers
import pytest
from closed_forms import CHECKS, ROOT, run_of


@pytest.mark.parametrize("folder", ["components", "elements"])
def test_every_netlist_has_numbers_and_a_line_on_the_page(folder: str) -> None:
    netlists = {f"{folder}/{path.stem}" for path in (ROOT / "examples" / folder).glob("*.toml")}
    assert netlists == {name for name in CHECKS if name.startswith(f"{folder}/")}
    text = (ROOT / "docs" / "examples" / f"{folder}.md").read_text(encoding="utf-8")
    assert [name for name in sorted(netlists) if f"../../examples/{name}.toml" not in text] == []


@pytest.mark.parametrize("name", CHECKS)
def test_closed_form(name: str) -> None:
    CHECKS[name](run_of(name))


@pytest.mark.parametrize("name", CHECKS)
def test_energy_closes(name: str) -> None:
    energy = run_of(name).energy()
    assert energy.throughput > 0
    assert energy.power_closure < 1e-8
