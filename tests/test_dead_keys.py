"""No key of any settings is read nowhere: of every study, tool and batch, and of every kind of effect, cost,
optimizer, curve and controller.

That a key that is read changes what comes out is the contract of `tests/test_keys.py`, for studies of
vibration, modal settings and motion.
"""

from __future__ import annotations

import ast
import importlib
import pkgutil
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from pydantic import BaseModel

import identify

ROOT = Path(identify.__file__).parent
TOLD = {"kind", "schema_", "schema"}
"""What says which settings these are."""


def settings() -> list[type[BaseModel]]:
    """Every model that refuses unknown keys, as what a user writes does."""
    for module in pkgutil.walk_packages([str(ROOT)], "identify."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    found, todo = set[type[BaseModel]](), list(BaseModel.__subclasses__())
    while todo:
        one = todo.pop()
        todo += one.__subclasses__()
        if one.__module__.startswith("identify.") and one.model_config.get("extra") == "forbid":
            found.add(one)
    return sorted(found, key=lambda one: f"{one.__module__}.{one.__qualname__}")


@cache
def read() -> frozenset[str]:
    """Every attribute that is read, and every name in a constant such as motor.torque_limit."""
    names = set[str]()
    for path in ROOT.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names.update(_named(node))
    return frozenset(names)


def _named(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Load):
        yield node.attr
    if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " not in node.value:
        yield from node.value.split(".")


def dead(model: type[BaseModel]) -> list[str]:
    return [name for name in model.model_fields if name not in TOLD and name not in read()]


@pytest.mark.parametrize("model", settings(), ids=lambda one: f"{one.__module__}.{one.__qualname__}")
def test_every_key_is_read(model: type[BaseModel]) -> None:
    assert dead(model) == []


def test_a_key_that_nothing_reads_is_noticed() -> None:
    class Settings(BaseModel):
        stiffness: float = 1.0
        nobody_reads_this_key: float = 1.0

    assert dead(Settings) == ["nobody_reads_this_key"]
