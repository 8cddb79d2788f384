"""README, scripts and the wheel do what they say."""

import contextlib
import hashlib
import inspect
import itertools
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import textwrap
import zipfile
from typing import Any

import pytest
from campaign import NIGHTLY, nightly
from command import call
from documents import PAGES, README, TEXT

from afo_sim.common import machine_code

ROOT = pathlib.Path(__file__).parents[1]


def run(command: list[str], folder: pathlib.Path, **environment: str) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, env=os.environ | environment, timeout=280
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done


PYTHON = [
    pytest.param(textwrap.dedent(block), id=f"{page}-{number}")
    for page, text in {"README": README, **PAGES}.items()
    if page not in ("dm_control", "architecture")  # which tests of their own run
    for number, block in enumerate(re.findall(r"^ *```python\n(.*?)```", text, flags=re.S | re.M))
]


def exportable() -> bool:
    from afo_sim.common import CallbackError
    from afo_sim.native import library_file

    with contextlib.suppress(CallbackError):
        return library_file().is_file()
    return False


@pytest.mark.slow
@pytest.mark.parametrize("block", PYTHON)
@pytest.mark.filterwarnings("default")
def test_documents_python_runs(
    block: str, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if "mj_loadPluginLibrary" in block and not exportable():
        pytest.skip("this checkout has no library of its sources to export")
    if NIGHTLY:  # nothing that another test has imported is there
        assert run([sys.executable, "-c", block], tmp_path)
        return
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "<document>", "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out.startswith("ok") or "run.status" not in block
    assert "three-bar" not in block or (tmp_path / "runs" / "three-bar" / "recording.parquet").is_file()


RUNS = list(dict.fromkeys(re.findall(r"^ +\.venv/bin/afo-sim (run .*)$", TEXT, flags=re.M)))
# Lines of what another command writes first, in tests/cli and tests/study, and of a search of minutes.
FOLLOWS = ("gait.cycle=my_walk.csv", "legs/mine", "orthoses/mine", "runs/placement", "runs/least-air")


@pytest.mark.slow
@pytest.mark.parametrize("line", RUNS)
def test_documents_runs_run(
    line: str, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if any(words in line for words in FOLLOWS):
        return
    monkeypatch.chdir(tmp_path)
    quick = () if line in README else ("--no-change",)  # effects of a walk take longer than the walk
    code, said, wrong = call(capsys, *shlex.split(line), *quick)
    assert (code, bool(said)) == (0, True), wrong
    (written,) = tmp_path.glob("runs/*/summary.json")
    assert "--out" not in line or f"--out {written.parent.relative_to(tmp_path)}" in line


def test_documents_have_lines_that_run() -> None:
    assert len(RUNS) > 2 * len(FOLLOWS) and any("runs/slack" in line for line in RUNS)


def test_files_stay_small() -> None:
    """A file is read alone."""
    long = {
        path: len(path.read_text(encoding="utf-8").splitlines()) for path in (ROOT / "afo_sim").rglob("*.py")
    }
    assert not {path: lines for path, lines in long.items() if lines > 520}


def test_the_version_is_the_same_everywhere() -> None:
    import tomllib

    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\n## {version} " in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_extras_and_programs_that_workflows_and_documents_name_are_there() -> None:
    import tomllib

    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    workflows = [path.read_text() for path in sorted((ROOT / ".github" / "workflows").glob("*.yml"))]
    texts = [*workflows, TEXT, (ROOT / "CONTRIBUTING.md").read_text(), (ROOT / ".ci" / "run").read_text()]
    named = re.findall(r"(?:afo-sim|-e '\.)\[([a-z,]+)\]", "\n".join(texts))
    assert len(named) > 10 and {extra for names in named for extra in names.split(",")} <= set(extras)
    programs = re.findall(r"(?:scripts/[\w/]+\.py|\.ci/\w+(?:\.py)?)", "\n".join(texts))
    assert len(programs) > 10 and all((ROOT / name).is_file() for name in programs)
    assert len(workflows) == 4


def test_help_and_documents_have_every_command_in_its_group() -> None:
    from typer.main import get_command

    from afo_sim.cli import app
    from afo_sim.cli.commands import GROUPS
    from afo_sim.physics import LAWS

    grouped = list(itertools.chain(*GROUPS.values()))
    assert sorted(grouped) == sorted(get_command(app).commands)  # type: ignore[attr-defined]
    listed = re.findall(r"^\*\*(.+)\*\*$|^- `afo-sim ([a-z-]+)", PAGES["commands"], flags=re.M)
    assert list(dict.fromkeys(title or name for title, name in listed)) == list(
        itertools.chain(*([title, *names] for title, names in GROUPS.items()))
    )
    for law in LAWS:
        assert f"`{law}`" in PAGES["physics"]


def test_the_names_that_are_promised_and_the_others_are_all_names() -> None:
    import afo_sim

    section = PAGES["python"].split("## What is promised\n")[1].split("\n## ")[0]
    items, others = section.split("\nNot promised: ")
    promised = [name for name in re.findall(r"`([A-Za-z_]+)`", items) if name not in ("scenario", "orthosis")]
    experimental = re.findall(r"`([A-Za-z_]+)`", others.split("Their")[0])
    assert sorted(promised + experimental) == sorted(afo_sim.__all__)
    assert len(promised) <= 36


# Of a command alone: files that it writes, how it prints, and which of its kinds is meant.
OF_COMMANDS = {
    "out",
    "rrd",
    "force",
    "as_json",
    "numbers",
    "live",
    "plain",
    "change",
    "spreads",
    "bench",
    "free",
}
OF_COMMANDS |= {
    "patients",
    "spring",
    "draws",
    "vary",
    "uncertainty",
    "package",
    "to",
    "mjb",
    "worn",
    "data",
    "air",
}
OF_COMMANDS |= {"walker", "rate", "report", "extension"}


def test_options_are_called_as_the_arguments_of_their_function() -> None:
    from typer.main import get_command

    import afo_sim
    from afo_sim.cli import app
    from afo_sim.study.sizing.result import KINDS

    commands, seen = get_command(app).commands, set()  # type: ignore[attr-defined]
    for name in ("run", "walk", "both", "torque-map", "size", "stand", "fit", "credibility", "attach"):
        arguments = set(inspect.signature(getattr(afo_sim, name.replace("-", "_"))).parameters)
        if name == "size":
            arguments |= {"cadence", *(each for kind in KINDS.values() for each in kind.options)}
        for option in commands[name].params:
            several = {option.name, f"{option.name}s"}
            long = {each.removeprefix("--").replace("-", "_") for each in option.opts}
            if option.param_type_name == "option" and not several & OF_COMMANDS:
                assert several & arguments, (name, option.name)
                assert long & {option.name, (option.name or "").removesuffix("s"), "left_set"}, (name, long)
                seen.add(option.name)
    assert len(seen) > 40


@nightly("what lands a change builds the wheel and runs it")
@pytest.mark.slow
def test_wheel_carries_its_products_and_runs_alone(tmp_path: pathlib.Path) -> None:
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    run([*pip, "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", str(tmp_path), str(ROOT)], tmp_path)
    (wheel,) = tmp_path.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    products = ["models/legs/adult_75kg/leg.xml", "models/scenarios/seated.toml", "gait_data/README.md"]
    products += [f"machine_code/{name}" for name in (machine_code.LIBRARY, machine_code.CONTENT)]
    kinds = ["callbacks", "curves", "energy", "in_series", "metrics", "sensing", "first_air", "bent_toes"]
    kinds += ["activation", *(f"pads_{name}" for name in ("placed", "shared", "stands", "carried"))]
    assert {f"afo_sim/{name}" for name in products} <= set(names)
    content = zipfile.ZipFile(wheel).read(f"afo_sim/machine_code/{machine_code.CONTENT}")
    assert set(kinds) <= json.loads(content)["kinds"].keys()
    bill = json.loads(zipfile.ZipFile(wheel).read(next(name for name in names if name.endswith(".cdx.json"))))
    carried = {name.removeprefix("afo_sim/") for name in names if not name.endswith((".py", ".pyi"))}
    beside = {name for name in carried if name.startswith(("models/", "gait_data/", "machine_code/"))}
    assert beside == {part["name"] for part in bill["components"] if part["type"] != "library"}
    assert "-py3-none-" in wheel.stem and not wheel.stem.endswith("-any")
    assert not any(name.startswith(("tests", "scripts", "models/")) for name in names)
    target = tmp_path / "site"
    run([*pip, "install", "-q", "--no-deps", "--target", str(target), str(wheel)], tmp_path)
    where = "import afo_sim, pathlib; print(pathlib.Path(afo_sim.__file__).parent)"
    path = {"PYTHONPATH": str(target)}
    assert run([sys.executable, "-c", where], tmp_path, **path).stdout.strip() == str(target / "afo_sim")
    no_compiler = "import sys; sys.modules['numba'] = None; from afo_sim.cli import main; main()"
    words = ("run", "--set", "duration=1 s", "--out", "out")
    run([sys.executable, "-c", no_compiler, *words], tmp_path, AFO_SIM_CACHE="off", **path)
    assert (tmp_path / "out" / "recording.rrd").is_file()


def test_the_bill_of_materials_lists_needs_and_files_with_licences(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    from sbom import bill

    needs = {"": ["numpy>=2", "mujoco>=3.17"], "rl": ["mujoco<4", "gymnasium>=1"], "all": ["own[rl]"]}
    files = ["gait_data/norm_adult.csv", "models/scenarios/seated.toml"]
    made = bill(ROOT, "own", "1.2", needs, files)
    told = json.loads(made)
    assert made == bill(ROOT, "own", "1.2", needs, files) and str(ROOT) not in str(told)
    parts = {part["bom-ref"]: part for part in told["components"]}
    assert parts.keys() == {f"pkg:pypi/{name}" for name in ("numpy", "mujoco", "gymnasium")} | set(files)
    assert parts["pkg:pypi/gymnasium"]["scope"] == "optional"
    assert [each["value"] for each in parts["pkg:pypi/mujoco"]["properties"]] == ["mujoco>=3.17", "mujoco<4"]
    assert parts[files[0]]["licenses"] == [{"license": {"id": "CC-BY-4.0"}}]
    whole = hashlib.sha256((ROOT / files[0]).read_bytes()).hexdigest()
    assert parts[files[0]]["hashes"] == [{"alg": "SHA-256", "content": whole}]
    (needed,) = told["dependencies"]
    assert needed["ref"] == told["metadata"]["component"]["bom-ref"] == "pkg:pypi/own@1.2"
    assert set(needed["dependsOn"]) == parts.keys() - {"pkg:pypi/gymnasium"}
    assert re.fullmatch(r"urn:uuid:[0-9a-f]{8}-[0-9a-f]{4}-5[0-9a-f]{3}-[0-9a-f-]{17}", told["serialNumber"])


@pytest.mark.parametrize("fails", ["Python", "C"])
def test_a_wheel_is_built_where_nothing_can_be_compiled(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], fails: str
) -> None:
    """It is for any platform; what fails is Python's part, or that of the C compiler."""
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    import build_hook
    from hatchling.bridge.app import Application

    for name, text in (("models/a.toml", ""), ("afo_sim/__init__.py", "raise ImportError")):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_text(text)
    if fails == "C":
        told = tmp_path, "afo_sim.so", "no header"
        monkeypatch.setattr(build_hook, "compile_kernels", lambda root: build_hook.link(root, *told))
        monkeypatch.setattr(build_hook, "compiler", lambda: [sys.executable, "-c", "import no_compiler"])
    build: Any = {"force_include": {}}
    nothing: Any = None
    monkeypatch.setattr(build_hook.DataFolders, "list_parts", lambda hook, data: None)
    hook = build_hook.DataFolders(str(tmp_path), {}, nothing, nothing, "", "wheel", Application())
    hook.initialize("standard", build)
    assert build == {"force_include": {str(tmp_path / "models" / "a.toml"): "afo_sim/models/a.toml"}}
    assert "no machine code is shipped" in capsys.readouterr().err


def test_the_library_is_linked_by_the_c_compiler_that_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else a package brings one."""
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    import build_hook

    core: Any = type("Core", (), {"dependencies": ["numba>=0.61", "rich>=13"]})
    metadata: Any = type("Metadata", (), {"core": core})
    nothing: Any = None
    hook = build_hook.DataFolders(str(ROOT), {}, nothing, metadata, "", "wheel")
    monkeypatch.setenv("CC", sys.executable)
    assert (build_hook.compiler(), hook.dependencies()) == ([sys.executable], ["numba>=0.61"])
    monkeypatch.setenv("PATH", "")
    monkeypatch.setenv("CC", "no-such-compiler")
    assert build_hook.compiler() == [] and hook.dependencies()[1].startswith("ziglang")


def test_documents_links_lead_somewhere() -> None:
    pages = {ROOT / "README.md": README} | {
        ROOT / "docs" / f"{name}.md": text for name, text in PAGES.items()
    }
    links = [
        (page, link)
        for page, text in pages.items()
        for link in re.findall(r"\]\(([^)\s#]+)", text)
        if not link.startswith("http")
    ]
    assert len(links) > 200
    assert not [f"{page.name}: {link}" for page, link in links if not (page.parent / link).exists()]


def test_readme_leads_to_every_page() -> None:
    assert "(docs/index.md)" in README and len(README.split()) <= 600
    assert all(f"({page}.md)" in PAGES["index"] for page in PAGES if page != "index")


@pytest.mark.slow
def test_readme_shows_what_its_first_command_prints(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    (command,) = re.findall(r"^    python3 -m venv .*bin/afo-sim (run [a-z-]+)$", README, re.M)
    code, said, wrong = call(capsys, *command.split(), "--no-rrd")
    shown = re.search(r"The run prints:\n\n((?:    .*\n)+)", README)
    assert code == 0 and shown is not None, wrong
    # on a terminal of 24 rows
    assert len(said.splitlines()) <= 23 and set(textwrap.dedent(shown[1]).splitlines()) <= set(
        said.splitlines()
    )


def test_options_that_the_documents_name_are_there() -> None:
    from typer.main import get_command

    from afo_sim.cli import app

    def options(command: Any) -> set[str]:
        own = {name for parameter in command.params for name in (*parameter.opts, *parameter.secondary_opts)}
        return own.union(*map(options, getattr(command, "commands", {}).values()))

    # of Slurm, of Dask, of pytest, and of scripts/
    foreign = {"--array", "--cpus-per-task", "--nthreads", "--nworkers", "--port", "--dist"}
    foreign |= {"--dashboard-address", "--host", "--protocol"}
    foreign |= {"--strict", "--check", "--cost", "--mjcf", "--parts", "--walkers", "--write"}
    known = options(get_command(app)) | {"--help"}
    assert not set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", TEXT)) - known - foreign


def test_every_test_that_the_threat_model_names_is_there() -> None:
    defined = {
        name
        for file in (ROOT / "tests").rglob("*.py")
        for name in re.findall(r"^def (test_\w+)", file.read_text(), re.M)
    }
    named = re.findall(r"`(test_\w+|tests/[\w/.]+)`", PAGES["security"])
    assert len(named) > 20
    assert [name for name in named if name not in defined and not (ROOT / name).exists()] == []
