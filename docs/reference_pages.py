"""The reference, written from the code: every command with its options, every key of every config, a page for
each effect with its formula from formulas.md.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar, get_args, get_origin, get_type_hints

import typer.main

from identify.cli import app
from identify.core.analyses import ANALYSES, BY_NAME, WITH_CONFIG, load
from identify.core.schema import config_schema
from identify.model.effects.base import EFFECTS
from identify.results.comparison import Comparison
from identify.results.header import Header
from identify.results.labels import declared, unit_of_name

_FENCE = "```"


def write_reference(docs: Path) -> None:
    """Write docs/reference; files that are the same already are left alone, and not built anew."""
    folder = docs / "reference"
    _write(folder / "options.md", options())
    _write(folder / "results.md", results())
    for name in WITH_CONFIG:
        _write(folder / f"config_{name}.md", config(name))
    formulas = formulas_in((docs / "formulas.md").read_text(encoding="utf-8"))
    kinds = config_schema(BY_NAME["vibration"])["properties"]["effects"]["kinds"]
    for kind in EFFECTS.builtin:
        _write(folder / "effects" / f"{kind}.md", effect(kind, kinds[kind], formulas[kind]))
    rows = "\n".join(EFFECTS.builtin)
    _write(folder / "effects" / "index.md", f"# Effects\n\n{_FENCE}{{toctree}}\n{rows}\n{_FENCE}\n")


def formulas_in(text: str) -> dict[str, str]:
    """The sections of formulas.md by kind."""
    _, *parts = re.split(r"^## ", text, flags=re.MULTILINE)
    return {head.strip(): body.strip() for head, _, body in (part.partition("\n") for part in parts)}


def options() -> str:
    """Every command with its arguments and options."""
    group: Any = typer.main.get_command(app)
    parts = ["# Commands and options\n"]
    for name, command in group.commands.items():
        rows = [_parameter(one) for one in command.params if one.name != "help"]
        parts.append(f"## identify {name}\n\n{_plain(command.help or '')}\n")
        parts.append(_table(("option", "default", "meaning"), rows))
    return "\n".join(parts)


def _parameter(one: Any) -> tuple[str, str, str]:
    if one.param_type_name == "argument":
        return f"`{(one.metavar or one.name).upper()}`", "", _plain(one.help or "")
    names = ", ".join(f"`{name}`" for name in (*one.opts, *one.secondary_opts))
    default = "" if one.default in (None, False, []) or callable(one.default) else f"`{one.default}`"
    return names, default, _plain(one.help or "")


def config(name: str) -> str:
    """Every key of a config."""
    analysis = BY_NAME[name]
    schema = config_schema(analysis)
    parts = [f"# Config: {analysis.takes}\n", f"`schema: {analysis.schema}`\n", _keys(schema)]
    for key, field in schema["properties"].items():
        for kind, inside in field.get("kinds", {}).items():
            parts.append(f"## {key}: {kind}\n\n{_plain(inside.get('description', ''))}\n")
            parts.append(_keys(inside))
    for inner, definition in schema.get("$defs", {}).items():
        if definition.get("properties"):
            parts.append(f"## {inner}\n\n{_plain(definition.get('description', ''))}\n\n{_keys(definition)}")
    return "\n".join(parts)


def effect(kind: str, schema: dict[str, Any], formula: str) -> str:
    """The page of an effect."""
    inner = [f"## {name}\n\n{_keys(one)}" for name, one in schema.get("$defs", {}).items()]
    said = _plain(schema["description"])
    return "\n\n".join([f"# {kind}", said, "## Formula", formula, "## Keys", _keys(schema), *inner]) + "\n"


def results() -> str:
    """Every dataset of every kind of result file."""
    common = list(datasets(Header))
    parts = [
        "# Datasets of result files\n\n[How to read them](../results.md).\n",
        "## In all\n",
        _rows(common),
    ]
    for analysis in ANALYSES:
        if analysis.kind != Comparison.KIND:  # which is never in a file
            rows = [row for row in datasets(load(analysis.result)) if row not in common]
            parts += [f"## {analysis.kind}\n\nA file that holds {analysis.holds}.\n", _rows(rows)]
    return "\n".join(parts)


def _rows(found: list[tuple[str, tuple[str, ...], str]]) -> str:
    rows = [(f"`{path}`", ", ".join(dims), unit) for path, dims, unit in found]
    return _table(("dataset", "over", "units"), rows)


def datasets(kind: Any, place: str = "") -> Iterator[tuple[str, tuple[str, ...], str]]:
    """Path, dimensions and unit of all datasets of a class of results; `*` stands for names that users give,
    and a whole result in another one for its datasets.
    """
    said = declared(kind)
    for name, hint in get_type_hints(kind).items():
        if get_origin(hint) is ClassVar or name == "layout":
            continue
        held, at = (get_args(hint) or (hint,))[0], f"{place}/{name}"
        if get_origin(hint) is dict or dict in map(get_origin, get_args(hint)):
            inside = hint if get_origin(hint) is dict else get_args(hint)[0]
            yield from datasets(get_args(inside)[1], f"{at}/*")
        elif dataclasses.is_dataclass(held) and issubclass(held, Header):  # type: ignore[arg-type]
            yield f"{at}/...", (), f"as of kind {held.KIND}"
        elif dataclasses.is_dataclass(held):
            yield from datasets(held, at)
        else:
            dims, unit = said.get(name, ((), unit_of_name(name)))
            text = held is str or held == tuple[str, ...]
            yield at, dims, "" if text else unit.replace("$", "see ").replace("~", " ")


def _keys(schema: dict[str, Any]) -> str:
    if not schema.get("properties"):
        return ""
    needed = schema.get("required", [])
    rows = []
    for key, field in schema["properties"].items():
        default = "required" if key in needed else _default(field.get("default"))
        rows.append(
            (
                f"`{key}`",
                " or ".join(dict.fromkeys(_types(field))),
                default,
                _plain(field.get("description", "")),
            )
        )
    return _table(("key", "takes", "default", "meaning"), rows)


def _types(field: dict[str, Any]) -> Iterator[str]:
    for one in field.get("anyOf", [field]):
        if "$ref" in one:
            yield one["$ref"].rpartition("/")[2]
        elif "enum" in one or "const" in one:
            yield ", ".join(f"`{value}`" for value in one.get("enum", [one.get("const")]))
        elif one.get("type") == "array":
            inner = " or ".join(_types(one.get("items", {}))) if isinstance(one.get("items"), dict) else ""
            yield f"list of {inner}" if inner else "list"
        elif one.get("type") not in (None, "null"):
            yield one["type"]


def _default(value: Any) -> str:
    return "" if value is None or isinstance(value, dict | list) else f"`{value}`"


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return (
        "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in lines) + "\n"
    )


def _plain(text: str) -> str:
    """One paragraph, in which nothing is taken for markup."""
    return re.sub(r"\s+", " ", text).replace("<", "\\<").replace("*", "\\*").replace("$", "\\$").strip()


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")
