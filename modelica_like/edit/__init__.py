"""Netlists are changed by operations on their text: only the lines that must change do."""

from __future__ import annotations

from modelica_like.edit import document as _document
from modelica_like.edit import grouping as _grouping
from modelica_like.edit import values as _values
from modelica_like.edit import wires as _wires
from modelica_like.edit.document import Document as Document
from modelica_like.edit.document import Edited as Edited
from modelica_like.edit.document import apply as apply

_on_text = _document.on_text
add = _on_text(_values.add)
insert = _on_text(_wires.insert)
connect = _on_text(_wires.connect)
disconnect = _on_text(_wires.disconnect)
remove = _on_text(_wires.remove)
rename = _on_text(_wires.rename)
replace = _on_text(_values.replace)
set = _on_text(_values.set)
unset = _on_text(_values.unset)
duplicate = _on_text(_values.duplicate)
group = _on_text(_grouping.group)

__all__ = [
    "Document", "Edited", "add", "apply", "connect", "disconnect", "duplicate", "group", "insert", "remove", "rename",
    "replace", "set", "unset",
]  # fmt: skip
