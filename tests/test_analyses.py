"""The table of analyses: all it names is there, every schema is whole, options are refused by it alone."""

from __future__ import annotations

import dataclasses
import inspect
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Unpack, get_args, get_origin, get_type_hints

import pytest
from typer.testing import CliRunner

from identify.api.options import DiscoverOptions, ExplainOptions, FitOptions, given
from identify.cli import app
from identify.core.analyses import ANALYSES, BY_NAME, OF_KIND, WITH_CONFIG, analysis_for, check_options
from identify.core.config import family_of
from identify.core.errors import InputError
from identify.core.registry import load
from identify.core.schema import config_schema
from identify.results.header import Header

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("analysis", ANALYSES, ids=lambda one: one.name)
def test_all_that_the_table_names_is_there(analysis: Any) -> None:
    result = load(analysis.result)
    assert issubclass(result, Header)
    assert analysis.kind == result.KIND
    if analysis.success:
        assert analysis.success in dir(result) or analysis.success in result.__dataclass_fields__
    for command, run in analysis.runs.items():
        function = load(run.function)
        taken = set(inspect.signature(function).parameters)
        for hint in get_type_hints(getattr(function, "func", function)).values():
            if get_origin(hint) is Unpack:
                taken |= set(get_args(hint)[0].__annotations__)
        wanted = [*run.options, *(["overrides"] if run.overrides else [])]
        wanted += ["progress"] if run.progress else []
        assert [name for name in ("config", "out", *wanted) if name not in taken] == [], command
        assert callable(load(run.progress)) if run.progress else not run.progress
    if analysis.study:
        fields = load(analysis.study).model_fields
        assert analysis.schema in fields["schema_"].annotation.__args__
        assert set(analysis.plugs) <= set(fields)


def test_names_and_kinds_are_told_apart() -> None:
    assert len(BY_NAME) == len(OF_KIND) == len(ANALYSES)
    assert WITH_CONFIG == ("vibration", "motion", "explain", "joints", "excite", "batch", "stability")


def _objects(node: Any, where: str = "#") -> Iterator[tuple[str, dict[str, Any]]]:
    """Every mapping of a schema with its place."""
    if isinstance(node, dict):
        yield where, node
    pairs = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in pairs:
        yield from _objects(value, f"{where}/{key}")


def _undescribed(schema: dict[str, Any]) -> list[str]:
    """The keys without a description."""
    keyed = ((where, found.get("properties")) for where, found in _objects(schema))
    return [
        f"{where}/{key}"
        for where, keys in keyed
        if isinstance(keys, dict)
        for key, value in keys.items()
        if not value.get("description")
    ]


@pytest.mark.parametrize("kind", WITH_CONFIG)
def test_every_schema_is_printed_with_every_key_described(kind: str) -> None:
    printed = CliRunner().invoke(app, ["config", "--kind", kind])
    assert printed.exit_code == 0, printed.output
    schema = json.loads(printed.stdout)
    assert schema["properties"]["schema"]["const"] == BY_NAME[kind].schema
    assert _undescribed(schema) == []
    for where, found in _objects(schema):
        if isinstance(found.get("$ref"), str):
            target: Any = schema
            for key in found["$ref"].split("/")[1:]:
                assert key in target, f"{where} points to {found['$ref']}"
                target = target[key]


def test_a_key_without_description_would_be_seen() -> None:
    schema = config_schema(BY_NAME["joints"])
    del schema["$defs"]["Payload"]["properties"]["mass_kg"]["description"]
    assert _undescribed(schema) == ["#/$defs/Payload/mass_kg"]


@pytest.mark.parametrize("kind", WITH_CONFIG)
def test_every_plug_point_lists_its_kinds(kind: str) -> None:
    analysis = BY_NAME[kind]
    properties = config_schema(analysis)["properties"]
    assert {key for key, value in properties.items() if "kinds" in value} == set(analysis.plugs)
    for key, plug in analysis.plugs.items():
        names = set(load(plug).names())
        if (kind, key) == ("motion", "effects"):
            names = {"base-compliance", "joint-compliance", "link-flexibility"}
        assert set(properties[key]["kinds"]) == names


def test_the_keys_of_a_stage_stand_beside_those_of_its_optimizer() -> None:
    for kind, more in (("vibration", {"cost"}), ("motion", set())):
        stage = config_schema(BY_NAME[kind])["properties"]["optimizer"]["kinds"]["gauss-newton"]
        expected = {"kind", "evaluations", "tolerance", "parameters", "measurements"}
        assert set(stage["properties"]) == expected | more


def test_without_kind_the_schema_is_that_of_vibration() -> None:
    run = CliRunner().invoke
    assert run(app, ["config"]).stdout == run(app, ["config", "--kind", "vibration"]).stdout
    assert run(app, ["config", "--motion"]).stdout == run(app, ["config", "--kind", "motion"]).stdout
    refused = run(app, ["config", "--kind", "modes"])
    assert isinstance(refused.exception, InputError)
    assert "one of vibration, motion, explain, joints, excite, batch, stability" in str(refused.exception)


@pytest.mark.parametrize("words", [["--seed", "0"], ["--seed", "1"], ["--starts", "0"], ["--resume"]])
def test_an_option_that_does_not_apply_is_refused_whatever_its_value(words: list[str]) -> None:
    config = ROOT / "configs" / "joint_runs.yaml"
    refused = CliRunner().invoke(app, ["fit", str(config), *words])
    assert isinstance(refused.exception, InputError)
    assert f"`{words[0]}` with a study of joints; expected a study of vibration" in str(refused.exception)


def test_which_options_apply_is_said_by_the_table() -> None:
    seeds = given(FitOptions(seed=0))
    assert seeds == {"seed": 0}
    check_options(BY_NAME["vibration"], "fit", seeds, "config")
    check_options(BY_NAME["motion"], "fit", seeds, "config")
    check_options(BY_NAME["joints"], "fit", {}, "config")
    with pytest.raises(
        InputError, match="`--profile` with a study of motion; expected a study of vibration;"
    ):
        check_options(BY_NAME["motion"], "fit", given(FitOptions(profile=["x"])), "config")
    with pytest.raises(InputError, match="`--seed` and `--starts` with a study of joints"):
        check_options(BY_NAME["joints"], "fit", given(FitOptions(seed=0, starts=1)), "config")
    with pytest.raises(InputError, match="`--starts` with a study of recorded motion"):
        check_options(BY_NAME["explain"], "discover", given(DiscoverOptions(starts=0, workers=1)), "config")
    assert given(FitOptions(out=Path("x.h5"), report=False, quiet=True)) == {}
    assert given(ExplainOptions()) == {}


def test_a_config_of_another_kind_is_sent_to_its_command() -> None:
    config = ROOT / "configs" / "joint_runs.yaml"
    for command in ("simulate", "discover", "explain", "batch"):
        with pytest.raises(
            InputError, match=r"a study of joints, schema identify-joints/1; .*`identify fit`"
        ):
            analysis_for(command, family_of(config), str(config))
    assert analysis_for("fit", family_of(config), str(config)) is BY_NAME["joints"]
    assert analysis_for("fit", "", str(config)) is BY_NAME["vibration"]


def test_every_option_of_a_command_is_one_of_the_table_or_of_all() -> None:
    commands = {"fit": FitOptions, "discover": DiscoverOptions, "explain": ExplainOptions}
    for command, options in commands.items():
        runs = [one.runs[command] for one in ANALYSES if command in one.runs]
        known = {name for run in runs for name in (*run.overrides, *run.options)}
        assert {field.name for field in dataclasses.fields(options)} == known | {"out", "report", "quiet"}
