"""Equations as machine code: the same runs to the bit, compiled once, and tapes where there is no compiler."""

import os
import shutil
import subprocess
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest
from some import some

from modelica_like import build, simulate
from modelica_like.analyse.sweeps.sweep import sweep
from modelica_like.fmi import build as compiler
from modelica_like.fmi import sources
from modelica_like.fmi.interface import interface
from modelica_like.fmi.model_file import generate
from modelica_like.fmi.straight import straight
from modelica_like.fmi.tables import make_tables
from modelica_like.language import Component, Equations, Events, Mode, Parameter, Variable, param, var
from modelica_like.native import code, model

EXAMPLES = Path(__file__).parents[2] / "examples"
STARTUP = EXAMPLES / "machine_tool_startup.toml"
NETLISTS = sorted(
    path.relative_to(EXAMPLES).with_suffix("").as_posix()
    for path in EXAMPLES.rglob("*.toml")
    if path.parent.name != "cosim"
    and {"parts", "simulate"} <= set(content := tomllib.loads(path.read_text()))
    and "until" in content["simulate"]
)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty folder for what is compiled."""
    monkeypatch.setattr(code, "cache_folder", lambda: tmp_path)
    code._version.cache_clear()
    return tmp_path


def counted(monkeypatch):
    """Notes what is compiled."""
    names = []
    build_really = code.build

    def noted(sources, *rest):
        names.append(sources)
        return build_really(sources, *rest)

    monkeypatch.setattr(code, "build", noted)
    return names


def same(first, second):
    """Whether two runs have the same numbers and events; of zeros, the sign is free: x + 0 of a tape is x."""
    assert second.notices == first.notices
    assert second.events == first.events
    assert second.statistics.steps == first.statistics.steps
    for ours, theirs in zip(first.segments, second.segments, strict=True):
        assert np.array_equal(ours.times, theirs.times)
        for one, other in ((ours.x, theirs.x), (ours.z, theirs.z), (ours.d, theirs.d)):
            assert np.array_equal(one, other, equal_nan=True)


@pytest.mark.parametrize("name", some(NETLISTS))
def test_examples_are_equal_to_the_bit(name):
    drive = build(EXAMPLES / f"{name}.toml")
    same(*(simulate(drive, solver="native", compiled=compiled) for compiled in (False, True)))


def test_long_tapes_are_cut(monkeypatch, cache):
    """Values pass from one function to the next by the slots, those of conditional blocks, too."""
    monkeypatch.setattr("modelica_like.fmi.straight._LONGEST", 7)
    drive = build(STARTUP)
    same(*(simulate(drive, 1.0, solver="native", compiled=compiled) for compiled in (False, True)))


def test_without_exchanges_only_where_that_is_precise(monkeypatch, cache):
    """Without the compiled LU, or with one that always refuses, linear.c does the same."""
    drive = build(STARTUP)
    expected = simulate(drive, 0.2, solver="native")
    monkeypatch.setattr("modelica_like.fmi.straight_lu._MOST", 0)
    same(expected, simulate(build(STARTUP), 0.2, solver="native", compiled=True))
    monkeypatch.setattr("modelica_like.fmi.straight_lu._MOST", 600)
    monkeypatch.setattr("modelica_like.fmi.straight_lu._Lu.factor", lambda _: iter(["return 0;"]))
    same(expected, simulate(build(STARTUP), 0.2, solver="native", compiled=True))


def test_a_handle_with_inputs_that_move_and_change(cache):
    """Tuned parameters, copies, states and gradients of a handle."""
    drive = build(STARTUP)
    found = []
    for compiled in (False, True):
        handle = drive.native(["force", "k1"], ["J3.w", "shaft1.tau"], by=["J1.J"], compiled=compiled)
        handle.reset({"J1.J": 1.7}, until=1.0)
        values = []
        for k in range(1, 101):
            handle.inputs[0] = 5000.0 + 20.0 * (k % 7)
            handle.inputs[1] = 6120.0 + 5.0 * (k % 3)
            values.append(handle.step(2e-3 * k).copy())
        copy, slope = handle.copy(), handle.gradient()
        times, after = handle.run(0.6, 50)
        handle.restore(copy)
        again = handle.run(0.6, 50)[1]
        assert np.array_equal(after, again)
        found.append((np.array(values), slope, times, after, handle.states))
    for one, other in zip(*found, strict=True):
        assert np.array_equal(one, other)


class Blink(Component):
    """Nothing is integrated."""

    y: Variable = var("1", "light")
    lamp = Mode("dark", "bright")
    at: Parameter = param("s", "when", default=1 / 3)

    def equations(self) -> Equations:
        yield self.y == self.lamp.choose(dark=0, bright=1)

    def events(self) -> Events:
        yield self.lamp.go("dark", "bright", when=self.time > self.at)


def test_without_states(cache):
    drive = build(Blink())
    runs = [simulate(drive, 1.0, solver="native", compiled=compiled) for compiled in (False, True)]
    same(*runs)
    assert [one.time for one in runs[1].events] == pytest.approx([1 / 3], abs=1e-9)


def test_fixed_steps(cache):
    drive = build(STARTUP)
    ends = []
    for compiled in (False, True):
        handle = drive.native([], ["J3.w"], fixed_step="1 ms", compiled=compiled)
        handle.reset(until=1.0)
        ends.append(handle.run(1.0, 100)[1])
    assert np.array_equal(*ends)


def test_it_is_compiled_once(cache, monkeypatch):
    made = counted(monkeypatch)
    first = build(STARTUP).native(outputs=["J3.w"], compiled=True)
    assert first.notice == ""
    assert len(made) == 1
    build(STARTUP).native(compiled=True)  # another model, of the same structure
    build(STARTUP).with_parameters({"J1.J": 1.9}).native(compiled=True)
    assert len(made) == 1
    assert [one.name for one in (cache / compiler.native_platform()).iterdir()] == [
        one.name for one in (cache / compiler.native_platform()).glob("code-*")
    ]


def test_what_is_old_or_too_much_goes(cache, monkeypatch):
    """The newest files stay, up to a size; a use makes one new."""
    build(STARTUP).native(compiled=True)
    (library,) = cache.rglob("code-*")
    now, day = time.time(), 86_400

    def stored(name, size, days):
        file = library.parent / name
        file.write_bytes(size * b"x")
        os.utime(file, (now, now - days * day))
        return file

    old, large, small, other = (
        stored(*file) for file in (("code-a", 1, 100), ("code-b", 9000, 3), ("code-c", 1, 2), ("runtime-d", 1, 100))
    )
    monkeypatch.setattr(code, "_MOST_BYTES", library.stat().st_size + 5000)
    os.utime(library, (now, now - 50 * day))
    build(STARTUP).native(compiled=True)
    assert library.stat().st_mtime > now - day
    code._tidy(library)
    assert [file.exists() for file in (library, old, large, small, other)] == [True, False, False, True, True]


def test_twins_share_the_code(cache, monkeypatch):
    made, drive = counted(monkeypatch), build(STARTUP)
    for inertia in (1.5, 1.9):
        twin = drive.with_parameters({"J1.J": inertia})
        same(*(simulate(twin, 0.3, solver="native", compiled=compiled) for compiled in (False, True)))
    assert len(made) == 1


def test_a_sweep_uses_it(cache, monkeypatch):
    made, values = counted(monkeypatch), {"J1.J": [1.5, 1.6, 1.7]}
    first, second = (
        sweep(build(STARTUP), values, ["J3.w", "max(shaft1.tau)"], until=0.5, compiled=compiled)
        for compiled in (False, True)
    )
    assert len(made) == 1
    assert first.equals(second)
    assert second.attrs["notice"] == ""


def test_long_sweeps_have_it_by_themselves(cache, monkeypatch, tmp_path):
    """A checkpoint does not ask for it: what is resumed may have it or not."""
    made, values = counted(monkeypatch), {"J1.J": np.linspace(1.5, 1.7, 100)}
    short = sweep(build(STARTUP), values, ["J3.w"], until=0.05, compiled=None, checkpoint=tmp_path / "kept")
    assert made == []
    monkeypatch.setattr("modelica_like.analyse.sweeps.sweep._WORTH_CODE", 0.0)
    assert short.equals(sweep(build(STARTUP), values, ["J3.w"], until=0.05))
    assert len(made) == 1
    assert short.equals(sweep(build(STARTUP), values, ["J3.w"], until=0.05, checkpoint=tmp_path / "kept"))
    sweep(build(STARTUP), {"J1.J": [1.5, 1.6]}, ["J3.w"], until=0.06)
    sweep(build(STARTUP), values, ["J3.w"], until=0.05, compiled=False)
    assert len(made) == 1


def test_without_a_compiler_tapes_run(cache, monkeypatch):
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(compiler.shutil, "which", lambda _: None)
    monkeypatch.setattr(compiler, "find_spec", lambda _: None)
    told = (
        "The equations run as tapes, since they cannot be compiled. There is no C compiler.\n"
        "Install cc, gcc or clang, or zig by `pip install modelica-like[cross]`."
    )
    drive = build(STARTUP)
    assert drive.native(compiled=True).notice == told
    expected, found = (simulate(drive, 0.2, solver="native", compiled=compiled) for compiled in (False, True))
    assert found.notices == (told,)
    assert found.events == expected.events
    assert np.array_equal(found["J3.w"], expected["J3.w"])
    assert sweep(drive, {"J1.J": [1.5]}, ["J3.w"], until=0.2, compiled=True).attrs["notice"] == told


def test_with_a_broken_compiler_tapes_run(cache, monkeypatch):
    broken = cache / "broken"
    broken.write_text("#!/bin/sh\necho 'error: it is broken' >&2\nexit 1\n")
    broken.chmod(0o755)
    monkeypatch.setenv("CC", str(broken))
    run = simulate(STARTUP, 0.2, solver="native", compiled=True)
    (told,) = run.notices
    assert told.startswith(
        "The equations run as tapes, since they cannot be compiled. "
        f"The C compiler failed for {compiler.native_platform()}: error: it is broken\n"
    )
    assert not list(cache.rglob("code-*"))


MAIN = """
#include "core.h"
extern const Codes codes;
Model *native_open(const unsigned char *bytes, size_t size, char *message);
void native_close(Model *m), native_compiled(Model *m, const Codes *codes), native_free(void *n);
void *native_new(const Model *m);
int native_reset(void *n, double start, double stop, double rtol, double atol), native_begin(void *n);
int native_step(void *n, double time, int64_t n_set, const uint32_t *set, const double *given, int64_t n_get,
    const uint32_t *get, double *values);
int main(void) {
    char message[MESSAGE_LENGTH];
    double ends[2][2], value;
    uint32_t time = 0;
    Model *m = native_open((const unsigned char *)model_data, model_data_size, message);
    for (int compiled = 0; compiled < 2; compiled++) {
        if (compiled) native_compiled(m, &codes);
        void *n = native_new(m);
        if (native_reset(n, 0, END, 1e-7, 1e-9) || native_begin(n)) return 1;
        if (native_step(n, END, 0, NULL, NULL, 1, &time, &value)) return 2;
        const Instance *c = native_instance(n);
        double sum = 0;
        for (int k = 0; k < m->n_x; k++) sum += c->x[k];
        ends[compiled][0] = sum, ends[compiled][1] = c->state.n_steps;
        native_free(n);
    }
    native_close(m);
    return ends[0][0] == ends[1][0] && ends[0][1] == ends[1][1] ? 0 : 3;
}
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", ["lepelletier", "machine_tool_startup"])
def test_sanitizers_find_nothing(name, tmp_path):
    """The code of a model under AddressSanitizer and UBSan, in one program with the run-time."""
    drive = build(EXAMPLES / f"{name}.toml")
    face = interface(drive)
    texts = generate(drive, face, token="{t}") | sources.own_sources(("native",))
    texts["straight.c"] = "#define CODE_ONLY\n" + straight(make_tables(drive, face.start))
    texts["main.c"] = "void *native_instance(const void *n);\n" + MAIN.replace("END", "2.0")
    texts["model_data.c"] = generate(drive, face, token="{t}")["model_data.c"]
    for file, text in texts.items():
        (tmp_path / file).write_text(text)
    files = ["model_data.c", *sources.RUNTIME, "native.c", "batch.c", "straight.c", "main.c"]
    flags = ["-g", "-O1", "-std=c99", "-Wall", "-Wextra", "-Werror", "-fsanitize=address,undefined"]
    command = [shutil.which("gcc") or "clang", *flags, "-fno-sanitize-recover=undefined", "-o", "driver", *files, "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True)
    result = subprocess.run([tmp_path / "driver"], capture_output=True, text=True, timeout=300, check=False)
    assert (result.returncode, result.stderr) == (0, "")


def test_the_text_has_only_numbers_and_operations(monkeypatch):
    """Whatever a netlist calls its parts does not get to a compiler."""
    tables = []
    monkeypatch.setattr(model, "compiled_code", lambda made: (tables.append(made), (None, ""))[1])
    drive = build(STARTUP)
    drive.native(compiled=True)
    text = straight(tables[0])
    assert len(text) > 10_000
    assert not [one.path for one in drive.flat_variables if one.path in text]
    assert set(text) <= set('abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_ \n;=()[]{},.*+-/<>!&|#"')
