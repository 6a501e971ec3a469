"""Circuits with ideal elements."""

import numpy as np

from components import (
    Capacitor,
    Ground,
    IdealDiode,
    Inductor,
    Resistor,
    SignalVoltage,
    Sine,
)
from modelica_like import Assembly, Component


def circuit(connect: dict[str, list[str]], **parts: Component) -> Assembly:
    return Assembly("circuit", parts=parts | {"earth": Ground()}, connect=connect)


def network(seed: int) -> Assembly:
    """A random network: a tree of resistors, sources with a resistor or an inductor, a capacitor, up to ten diodes."""
    r, connect = np.random.default_rng(seed), {"n0": ["earth.p"]}
    count, diodes, parts = int(r.integers(3, 7)), int(r.integers(2, 11)), dict[str, Component]()

    def put(name: str, part: Component, a: int, b: int) -> None:
        parts[name] = part
        connect.setdefault(f"n{a}", []).append(f"{name}.p")
        connect.setdefault(f"n{b}", []).append(f"{name}.n")

    for k in range(1, count):
        put(f"R{k}", Resistor(R=float(10 ** r.uniform(-1, 2))), k, int(r.integers(0, k)))
    for k in range(int(r.integers(1, 4))):
        a, b = (int(one) for one in r.choice(count, 2, replace=False))
        parts[f"s{k}"] = Sine(amplitude=r.uniform(5, 20), f=r.uniform(20, 80), phase=r.uniform(0, 6))
        connect[f"signal{k}"] = [f"s{k}.y", f"u{k}.v_ref"]
        put(f"u{k}", SignalVoltage(), a, count + k)
        ohmic = r.random() < 0.6
        value = r.uniform(0.1, 3) if ohmic else float(10 ** r.uniform(-3, -1))
        put(f"Q{k}", Resistor(R=value) if ohmic else Inductor(L=value, i=0.0), count + k, b)
    if r.random() < 0.6:
        a, b = (int(one) for one in r.choice(count, 2, replace=False))
        put("C", Capacitor(C=float(10 ** r.uniform(-4, -2)), v=0.0), a, b)
    for k in range(diodes):
        a, b = (int(one) for one in r.choice(count, 2, replace=False))
        put(f"D{k}", IdealDiode(), a, b)
    return circuit(connect, **parts)
