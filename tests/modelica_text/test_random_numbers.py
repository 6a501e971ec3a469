"""Random numbers of texts, against the same generators in whole numbers of 64 bits, to the last bit."""

from pathlib import Path

import numpy as np
import pytest

from modelica_like import load, simulate
from modelica_like.netlist.modelica.natives import NATIVE
from modelica_like.netlist.modelica.tree import Expr

ALL = 2**64 - 1
SEEDS = {"xorshift64star": 2, "xorshift128plus": 4, "xorshift1024star": 33}


def words(state: list[int]) -> list[int]:
    return [low % 2**32 + high % 2**32 * 2**32 for low, high in zip(state[::2], state[1::2], strict=False)]


def halves(*values: int) -> list[int]:
    return [(half + 2**31) % 2**32 - 2**31 for value in values for half in (value, value >> 32)]


def uniform(word: int) -> float:
    return float(word - (word >> 63 << 64)) * 2.0**-64 + 0.5


def drawn(name: str, state: list[int]) -> tuple[float, list[int]]:
    """Return a random number and the next state, after S. Vigna's papers of 2014."""
    if name == "xorshift64star":
        (x,) = words(state)
        x ^= x >> 12
        x ^= x << 25 & ALL
        x ^= x >> 27
        x = x * 2685821657736338717 & ALL
        return uniform(x), halves(x)
    if name == "xorshift128plus":
        a, b = words(state)
        a ^= a << 23 & ALL
        new = (a ^ b ^ a >> 17 ^ b >> 26) + b & ALL
        return uniform(new), halves(b, new)
    row, place = words(state[:-1]), state[-1] % 16
    a, place = row[place], (place + 1) % 16
    b = row[place]
    b ^= b << 31 & ALL
    row[place] = b ^ b >> 11 ^ a ^ a >> 30
    return uniform(row[place] * 1181783497276652981 & ALL), [*halves(*row), place]


def text(name: str, seed: list[int]) -> str:
    size = len(seed)
    return f"""
model M
  function draw input Integer a[{size}]; output Real y; output Integer b[{size}];
    external "C" ModelicaRandom_{name}(a, b, y);
  end draw;
  Integer s[{size}];
  discrete Real r;
initial equation
  pre(s) = {{{", ".join(map(str, seed))}}};
  r = draw(pre(s));
equation
  when sample(0.1, 0.1) then
    (r, s) = draw(pre(s));
  end when;
end M;
"""


@pytest.mark.parametrize("name", SEEDS)
def test_numbers_are_those_of_the_generator_to_the_last_bit(name: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(SEEDS[name])
    seed = [int(k) for k in rng.integers(-(2**31), 2**31, SEEDS[name])]
    seed[:2] = [-(2**31), -1]
    if name == "xorshift1024star":
        seed[-1] = 14  # the place goes round
    (tmp_path / "m.mo").write_text(text(name, seed), encoding="utf-8")
    run = simulate(load(tmp_path / "m.mo"), 1.0)
    state, number = seed, drawn(name, seed)[0]
    for k in range(10):
        values = np.asarray(run["r"])[(run.time > 0.1 * k + 0.01) & (run.time < 0.1 * k + 0.09)]
        assert values.size
        assert np.all(values == number)
        number, state = drawn(name, state)
    assert [run.final[f"s[{k}]"] for k in range(1, len(seed) + 1)] == state


def test_hash_of_a_text() -> None:
    native = NATIVE["ModelicaStrings_hashString"]
    first = np.array([0xAAAAAAAA], np.uint32)  # whole numbers of 32 bits, which overflow silently in arrays
    a = first ^ (first << 7 ^ 97 * (first >> 3))
    ab = a ^ ~((a << 11) + (98 ^ a >> 5))
    for letters, value in {"": first, "a": a, "ab": ab}.items():
        given = {"string": Expr("string", (letters,))}
        assert native(None, given, 0).args[0] == int(value.astype(np.int32)[0])  # pyright: ignore[reportArgumentType]


def test_a_generator_may_take_its_seed_from_the_name_of_a_part(tmp_path: Path) -> None:
    """The path begins with the model: `M.b.c`."""
    (tmp_path / "m.mo").write_text(
        'function hash input String string; output Integer y; external "C" y = ModelicaStrings_hashString(string); '
        "end hash;\nblock C parameter Integer seed(fixed = false); Real y = seed; "
        "initial equation seed = hash(getInstanceName()); end C;\n"
        "block B C c; end B;\n"
        'model M B b; parameter Integer k = hash("M.b.c"); Real y = k - b.c.y; Real x(start = 0, fixed = true); '
        "equation der(x) = y; end M;\n",
        encoding="utf-8",
    )
    assert simulate(load(tmp_path / "m.mo"), 1.0).final["y"] == 0.0


def test_a_large_function_of_a_large_function(tmp_path: Path) -> None:
    """Each has its argument 3^6 times in its text: written out, f(f(f(f(u)))) has 3^24 names."""
    body = "y := u; for k in 1:6 loop y := (y + y)/2 + (if y > 0 then 1 else 2); end for;"
    function = f"function f input Real u; output Real y; algorithm {body} end f;"
    equations = "y = f(f(f(f(time)))); der(x) = y;"
    (tmp_path / "m.mo").write_text(
        f"{function}\nmodel M Real y; Real x(start = 0, fixed = true); equation {equations} end M;\n", encoding="utf-8"
    )
    assert simulate(load(tmp_path / "m.mo"), 1.0).final["y"] == pytest.approx(1 + 24, rel=1e-12)
