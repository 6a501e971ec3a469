"""Functions of Python in CasADi's expressions."""

from __future__ import annotations

from typing import Any

import casadi as ca


class NamedCallback(ca.Callback):
    """A function of Python whose arguments and results have names and patterns."""

    def declare(self, name: str, arguments: dict[str, Any], results: dict[str, Any], **options: Any) -> None:
        """Create it: names, and patterns of arguments and results."""
        self._arguments, self._results = list(arguments.items()), list(results.items())
        self.construct(name, options)

    def get_n_in(self) -> int:
        """Number of arguments, for CasADi."""
        return len(self._arguments)

    def get_n_out(self) -> int:
        """Number of results, for CasADi."""
        return len(self._results)

    def get_name_in(self, i: int) -> str:
        """Name of an argument, for CasADi."""
        return self._arguments[i][0]

    def get_name_out(self, i: int) -> str:
        """Name of a result, for CasADi."""
        return self._results[i][0]

    def get_sparsity_in(self, i: int) -> Any:
        """Pattern of an argument, for CasADi."""
        return self._arguments[i][1]

    def get_sparsity_out(self, i: int) -> Any:
        """Pattern of a result, for CasADi."""
        return self._results[i][1]
