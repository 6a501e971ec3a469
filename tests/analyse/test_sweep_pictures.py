"""Pictures of sweeps show the numbers of the sweep."""

import numpy as np
import pytest
import xarray

from modelica_like.analyse.sweeps.pictures import plot_sweep
from modelica_like.errors import UnknownName, ValueOutOfRange


def swept(**axes: list[float]) -> xarray.Dataset:
    """A grid as `sweep` returns it, with y = the sum of the parameters, and one failed run."""
    shape = tuple(map(len, axes.values()))
    y = np.sum(np.meshgrid(*axes.values(), indexing="ij"), axis=0, dtype=float)
    failure = np.full(shape, "", object)
    failure[(0,) * len(shape)], y[(0,) * len(shape)] = "it failed", np.nan
    data = {"y": (tuple(axes), y, {"units": "N.m"}), "failure": (tuple(axes), failure)}
    coords = {name: (name, values, {"units": "mm"}) for name, values in axes.items()}
    return xarray.Dataset(data, coords=coords, attrs={"model": "drive"})


def test_one_parameter_gives_lines_and_failures_are_told() -> None:
    figure = plot_sweep(swept(a=[1, 2, 3]))
    (axes,) = figure.axes
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), [np.nan, 2, 3])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("a in mm", "y in N\u00b7m")
    assert "1 of 3 runs failed." in [text.get_text() for text in figure.texts]


def test_few_values_of_a_second_one_give_a_family_along_the_longer_one() -> None:
    (axes,) = plot_sweep(swept(a=[1, 2], b=[10, 20, 30])).axes
    assert [line.get_label() for line in axes.lines] == ["a = 1 mm", "a = 2 mm"]
    np.testing.assert_array_equal(axes.lines[1].get_ydata(), [12, 22, 32])


def test_two_parameters_give_a_map() -> None:
    axes, bar = plot_sweep(swept(a=list(range(7)), b=list(range(0, 80, 10)))).axes
    (mesh,) = axes.collections
    values = np.ma.getdata(mesh.get_array()).reshape(8, 7)
    assert values[3, 2] == 32
    assert bar.get_ylabel() == "y in N\u00b7m"


def test_three_parameters_give_parallel_coordinates_between_their_ends() -> None:
    (axes,) = plot_sweep(swept(a=[1, 2], b=[3, 4], c=[5, 7])).axes
    lines = axes.collections[0].get_segments()
    assert len(lines) == 7
    assert [tick.get_text() for tick in axes.get_xticklabels()] == [
        "a\nin mm", "b\nin mm", "c\nin mm", "y\nin N\u00b7m",
    ]  # fmt: skip
    best = max(lines, key=lambda line: line[-1][1])
    assert best[:, 1].tolist() == [1, 1, 1, 1]
    assert {text.get_text() for text in axes.texts} >= {"1", "2", "7", "10", "13"}


def test_what_cannot_be_drawn_is_told() -> None:
    with pytest.raises(UnknownName, match="no output 'z'"):
        plot_sweep(swept(a=[1, 2]), "z")
    with pytest.raises(ValueOutOfRange, match="No run of the sweep has succeeded"):
        plot_sweep(swept(a=[1]))
