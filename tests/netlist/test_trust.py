"""A netlist is data: modules beside it run only in trusted folders."""

import os
import pty
import select
import subprocess
import sys
from pathlib import Path

import pytest

from modelica_like.errors import NetlistError, UntrustedModule
from modelica_like.netlist import find_type, load, loads
from modelica_like.simulation import build
from modelica_like.trust import distrust, trust, trusted_folders, trusting

NETLIST = '[parts]\na = { is = "hub_of_test:Hub", J = 1, w = 1, phi = 0 }\n[simulate]\nuntil = 1\n'
MODULE = """
from pathlib import Path
from components import Inertia

Path(__file__).with_name("has_run").touch()

class Hub(Inertia):
    pass
"""


@pytest.fixture
def drive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A netlist with a module beside it that leaves a mark when it runs; nothing is trusted."""
    monkeypatch.setenv("MODELICA_LIKE_CONFIG", str(tmp_path / "config"))
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.delitem(sys.modules, "hub_of_test", raising=False)
    folder = tmp_path / "my drives"
    folder.mkdir(mode=0o755)
    (folder / "hub_of_test.py").write_text(MODULE)
    (folder / "drive.toml").write_text(NETLIST)
    return folder / "drive.toml"


def _ran(drive: Path) -> bool:
    return (drive.parent / "has_run").exists()


def _command(drive: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "modelica_like", *words]
    return subprocess.run(command, capture_output=True, text=True, cwd=drive.parent, check=False)


def test_a_module_does_not_run_before_its_folder_is_trusted(drive: Path) -> None:
    with pytest.raises(UntrustedModule) as caught:
        load(drive)
    home = drive.parent.resolve()
    assert str(caught.value) == (
        f"'hub_of_test' is a Python module, '{home}/hub_of_test.py', in a folder that is not trusted.\n"
        '  in drive.toml:2 `a = { is = "hub_of_test:Hub", J = 1, w = 1, phi = 0 }`\n'
        "A module can do all that you can; a netlist without one only computes.\n"
        f"If you know who wrote it, trust the folder: `modelica-like trust '{home}'`; or run it this once: "
        "`--trust`, in Python load(…, trust=True)."
    )
    with pytest.raises(UntrustedModule):
        loads(NETLIST, str(drive))
    for command in ("check", "draw", "describe", "explore"):
        told = _command(drive, command, "drive.toml")
        assert (told.returncode, told.stdout) == (2, ""), command
        assert "is not trusted" in " ".join(told.stderr.split())
    assert _command(drive, "describe", "hub_of_test:Hub").returncode == 2
    assert not _ran(drive)


def test_trust_by_the_list_by_an_argument_by_a_context(drive: Path, tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to(drive.parent)
    assert trust(link) == drive.parent.resolve()
    assert trusted_folders() == [drive.parent.resolve()]
    assert (tmp_path / "config" / "trusted.json").stat().st_mode & 0o777 == 0o600
    assert _command(drive, "check", "drive.toml").returncode == 0
    assert distrust(drive.parent) == drive.parent.resolve()
    assert _command(drive, "check", "drive.toml").returncode == 2
    assert _command(drive, "check", "drive.toml", "--trust").returncode == 0
    assert _command(drive, "--trust", "check", "drive.toml").returncode == 0
    trust(tmp_path)  # and all that is in it
    assert _command(drive, "check", "drive.toml").returncode == 0
    distrust(tmp_path)
    kind = type(load(drive, trust=True).find("a"))
    assert type(load(drive).find("a")) is kind, "what the program has imported itself may be named"
    with trusting():
        assert find_type("hub_of_test:Hub", drive.parent) is kind


def test_examples_need_no_trust(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """They came with the code that reads them."""
    monkeypatch.setenv("MODELICA_LIKE_CONFIG", str(tmp_path))
    netlist = Path(__file__).parents[2] / "examples" / "elements" / "full_turns.toml"
    told = _command(netlist, "check", netlist.name)
    assert told.returncode == 0, told.stderr


@pytest.mark.slow
def test_other_commands_trust_by_the_same_rule(drive: Path) -> None:
    """A sizing file runs a netlist; a sweep sends the model to processes."""
    drive.with_name("size.toml").write_text(
        '[checks.shaft]\nis = "shaft_stress"\nbending = 0\ndiameter = "40 mm"\nyield_strength = "275 N/mm2"\n'
        'torque = { from = "drive.toml", peak = "a.tau", until = "1 s" }\n'
    )
    sweep = ("sweep", "drive.toml", "--over", "a.J=1:2:3", "--of", "a.w", "--solver", "idas", "--processes", "2")
    for words in (("size", "size.toml"), sweep):
        told = _command(drive, *words)
        assert told.returncode == 2
        assert "is not trusted" in " ".join(told.stderr.split())
    assert not _ran(drive)
    told = _command(drive, *sweep, "--trust", "-o", "-")
    assert told.returncode == 0, told.stderr
    assert [line.rpartition(",")[0] for line in told.stdout.splitlines()[1:]] == ["1.0,1.0", "1.5,1.0", "2.0,1.0"]


def test_a_module_may_lie_above_its_netlists(drive: Path) -> None:
    """`split` writes netlists into a folder below."""
    below = drive.parent / "deep" / "below"
    below.mkdir(parents=True)
    (drive.parent / "deep" / "hub_of_test").mkdir()  # not a module: the one above is meant
    (below / "drive.toml").write_text(NETLIST)
    with pytest.raises(UntrustedModule):
        load(below / "drive.toml")
    trust(drive.parent)
    assert type(load(below / "drive.toml").find("a")).__module__ == "hub_of_test"


def test_a_module_is_a_file_of_the_netlists_folder(
    drive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither of the current folder nor of an installed package, and never of modelica_like."""
    other = tmp_path / "other"
    other.mkdir()
    (other / "drive.toml").write_text(NETLIST)
    monkeypatch.chdir(drive.parent)
    with pytest.raises(
        NetlistError, match=r"^There is no module 'hub_of_test' beside the netlist, or in a folder above\."
    ):
        load(other / "drive.toml", trust=True)
    load(drive, trust=True)
    with pytest.raises(NetlistError, match="There is no module 'hub_of_test' beside"):
        load(other / "drive.toml", trust=True)
    for name in ("this", "antigravity", "modelica_like.__main__"):
        with pytest.raises(NetlistError, match=f"There is no module '{name}' beside"):
            loads(NETLIST.replace("hub_of_test", name), str(drive), trust=True)
        assert name not in sys.modules


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("raise SystemExit(0)", "The module 'hub_of_test' cannot be imported: SystemExit: 0 (hub_of_test.py:1)."),
        ("class E(BaseException): pass\nraise E('no')",
         "The module 'hub_of_test' cannot be imported: E: no (hub_of_test.py:2)."),
        (MODULE + "    def __init__(self):\n        raise SystemExit(3)\n",
         "Hub cannot be created with no values: 3."),
        (MODULE + "    def equations(self):\n        yield self.J == 1\n        raise SystemExit(0)\n",
         "Hub.equations() fails."),
    ],
    ids=["ends the program", "any exception", "when it is created", "in its equations"],
)  # fmt: skip
def test_what_a_module_raises_is_one_sentence(drive: Path, code: str, message: str) -> None:
    drive.with_name("hub_of_test.py").write_text(code)
    with pytest.raises(NetlistError if "equations()" not in message else Exception) as caught:
        build(load(drive, trust=True))
    assert str(caught.value).partition("\n")[0] == message
    told = _command(drive, "check", "drive.toml", "--trust")
    assert told.returncode == 2
    assert told.stderr.partition("\n")[0] == message


def test_an_interrupt_stays_one(drive: Path) -> None:
    drive.with_name("hub_of_test.py").write_text("raise KeyboardInterrupt\n")
    assert _command(drive, "check", "drive.toml", "--trust").returncode == 130


def test_trust_ends_where_everyone_can_write(drive: Path, tmp_path: Path) -> None:
    """A folder for all, in a trusted one or around it: what lies there may be of others."""
    trust(tmp_path)
    drive.parent.chmod(0o777)
    with pytest.raises(UntrustedModule):
        load(drive)
    drive.parent.chmod(0o755)
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o1777)
    below = shared / drive.parent.name
    drive.parent.rename(below)
    with pytest.raises(UntrustedModule):
        load(below / "drive.toml")
    assert not (below / "has_run").exists()
    shared.chmod(0o755)
    load(below / "drive.toml")


def test_trust_ends_with_the_rights_of_the_folder(drive: Path) -> None:
    trust(drive.parent)
    drive.parent.chmod(0o777)
    with pytest.raises(UntrustedModule):
        load(drive)
    assert not _ran(drive)


def test_a_link_to_a_module_elsewhere_is_refused_before_it_runs(drive: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    other.mkdir()
    drive.with_name("hub_of_test.py").rename(other / "hub_of_test.py")
    drive.with_name("hub_of_test.py").symlink_to(other / "hub_of_test.py")
    with pytest.raises(NetlistError) as caught:
        load(drive, trust=True)
    home = drive.parent.resolve()
    assert str(caught.value) == (
        f"The module 'hub_of_test' of '{home}' is a link to '{other.resolve()}/hub_of_test.py'.\n"
        '  in drive.toml:2 `a = { is = "hub_of_test:Hub", J = 1, w = 1, phi = 0 }`\n'
        "A module is a file of the netlist's folder: copy it there."
    )
    assert not (other / "has_run").exists()


def test_the_list_is_the_users_alone(drive: Path, tmp_path: Path) -> None:
    store = tmp_path / "config" / "trusted.json"
    trust(drive.parent)
    store.chmod(0o666)
    with pytest.raises(NetlistError, match=r"can be written by others\.\n.*\nLook through it, and then: chmod go-w '"):
        load(drive)
    store.chmod(0o600)
    for text in ("{", "[]", '{"folders": 3}', "[" * 100_000, "\xff"):
        store.write_bytes(text.encode("latin-1"))
        with pytest.raises(NetlistError, match=r"The list of trusted folders, '.*', (is damaged|cannot be read)"):
            load(drive)
    store.unlink()
    drive.parent.chmod(0o777)
    with pytest.raises(NetlistError, match=r"cannot be trusted: everyone can write there\.\nTrust a folder of yours"):
        trust(drive.parent)
    with pytest.raises(NetlistError, match=r"^'.*drive.toml' is not a folder\.$"):
        trust(drive)
    with pytest.raises(NetlistError, match=r"^'.*my drives' is not on the list\.$"):
        distrust(drive.parent)
    trust(tmp_path)
    with pytest.raises(NetlistError, match=r"^'.*my drives' is not on the list; '.*', around it, is\.$"):
        distrust(drive.parent)


@pytest.mark.parametrize(("answer", "code"), [(b"y\n", 0), (b"\n", 2)], ids=["yes", "no"])
def test_a_terminal_is_asked_once(drive: Path, answer: bytes, code: int) -> None:
    drive.write_text(NETLIST.replace("[simulate]", 'b = { is = "hub_of_test:Hub", J = 1, w = 1, phi = 0 }\n[simulate]'))
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "modelica_like", "check", "drive.toml"]
    process = subprocess.Popen(
        command, cwd=drive.parent, stdin=theirs, stdout=subprocess.DEVNULL, stderr=theirs, start_new_session=True
    )
    os.close(theirs)
    os.write(ours, answer)
    said = b""
    while select.select([ours], [], [], 30)[0]:
        try:
            said += os.read(ours, 10_000)
        except OSError:  # Linux tells the end of a terminal so
            break
    os.close(ours)
    assert process.wait(30) == code
    assert said.count(b"Trust this folder from now on? [y/N]") == 1
    assert trusted_folders() == ([drive.parent.resolve()] if code == 0 else [])
    assert _ran(drive) == (code == 0)
