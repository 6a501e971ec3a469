"""Compiled models of which only some fields are given."""

from __future__ import annotations

from dataclasses import fields
from types import SimpleNamespace
from typing import Any

from modelica_like.compile.compiled import CompiledDae
from modelica_like.compile.groups import Equations, EventTables, Held, Starts

GROUPS = {"equations": Equations, "events": EventTables, "held": Held, "starts": Starts}


def fake_model(**given: Any) -> Any:
    """Return a stand-in for a compiled model; fields of its groups are given by their own names."""
    known = {one.name: group for group, kind in GROUPS.items() for one in fields(kind)}
    model: Any = SimpleNamespace(**{group: SimpleNamespace() for group in GROUPS}, places={})
    model.places_of = lambda paths: CompiledDae.places_of(model, paths)
    for name, value in given.items():
        setattr(getattr(model, known[name]) if name in known else model, name, value)
    return model
