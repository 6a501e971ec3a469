"""A small file cannot make a large or an endless job of itself: each limit is one sentence."""

import time
from pathlib import Path

import pytest

from modelica_like.errors import ModelicaLikeError
from modelica_like.netlist import load, loads


def _told(make: object) -> str:
    with pytest.raises(ModelicaLikeError) as caught:
        make()  # type: ignore[operator]
    return str(caught.value)


def test_netlists_in_netlists_have_a_depth(tmp_path: Path) -> None:
    for k in range(200):
        (tmp_path / f"d{k}.toml").write_text(f'[parts]\na = {{ is = "./d{k + 1}.toml" }}\n')
    assert _told(lambda: load(tmp_path / "d0.toml")) == (
        "Netlists are in each other more than 50 deep: 'd51.toml' is the next.\n"
        '  in d50.toml:2 `a = { is = "./d51.toml" }`'
    )


@pytest.mark.slow
def test_netlists_that_double_are_refused_soon(tmp_path: Path) -> None:
    """2**40 parts in 40 files of 60 bytes."""
    for k in range(40):
        (tmp_path / f"e{k}.toml").write_text(
            f'[parts]\na = {{ is = "./e{k + 1}.toml", count = 2 }}\n' if k < 39 else '[parts]\na = { is = "Inertia" }\n'
        )
    begin = time.process_time()
    assert _told(lambda: load(tmp_path / "e0.toml")).partition("\n")[0] == "The netlist has more than 200000 parts."
    assert time.process_time() - begin < 30.0


def test_a_fault_in_a_netlist_that_is_used_often_is_told_once(tmp_path: Path) -> None:
    """40 files that use the next one twice: the last one would be read 2**39 times."""
    for k in range(40):
        (tmp_path / f"f{k}.toml").write_text(
            f'[parts]\na = {{ is = "./f{k + 1}.toml" }}\nb = {{ is = "./f{k + 1}.toml" }}\n[start]\n"b.a.w" = 1\n'
            if k < 39
            else '[parts]\na = { is = "Inertia", K = 1 }\n'
        )
    assert _told(lambda: load(tmp_path / "f0.toml")) == (
        "Inertia has no parameter or variable 'K'. It has J, phi, w.\n  in f39.toml:2 `a = { is = \"Inertia\", K = 1 }`"
    )


@pytest.mark.slow
def test_parts_and_parameters_are_counted() -> None:
    many = "[parts]\n" + "".join(f'{name} = {{ is = "Inertia", count = 100000 }}\n' for name in "abc")
    assert _told(lambda: loads(many)) == (
        "The netlist has more than 200000 parts.\n"
        '  in netlist.toml:4 `c = { is = "Inertia", count = 100000 }`\n'
        "Its assemblies are counted with all that is in them."
    )
    parameters = "[parameters]\n" + "".join(f"p{k} = 1\n" for k in range(10_001))
    assert _told(lambda: loads(parameters + '[parts]\na = { is = "Inertia" }\n')) == (
        "'netlist.toml' has 10001 parameters, more than 10000."
    )
