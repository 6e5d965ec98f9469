"""The schema that editors and validators use: jobs of the project fit it, and a misspelt key is named."""

import json
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

ROOT = Path(__file__).parents[2]
SCHEMA = json.loads((ROOT / "schemas/job.schema.json").read_text(encoding="utf-8"))
JOBS = sorted((ROOT / "jobs").glob("*.json"))
VALIDATOR = Draft202012Validator(SCHEMA)


def job(name: str) -> dict[str, Any]:
    made: dict[str, Any] = json.loads((ROOT / f"jobs/{name}.json").read_text(encoding="utf-8"))
    return made


def test_the_schema_is_one() -> None:
    Draft202012Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("path", JOBS, ids=lambda path: path.stem)
def test_jobs_of_the_project_fit(path: Path) -> None:
    errors = list(VALIDATOR.iter_errors(json.loads(path.read_text(encoding="utf-8"))))
    assert not errors, [(error.json_path, error.message) for error in errors]


def test_keys_may_be_null_where_they_may_be_left_out() -> None:
    made = job("two-cylinders")
    made["analyses"]["stability"] = None
    made["contact"]["roughness"] = None
    assert VALIDATOR.is_valid(made)


MISSPELT = [
    # Optional objects, at the top and within others.
    ("two-cylinders", "contact", "frictoin"),
    ("two-cylinders", "contact.creepage", "lateal"),
    ("two-cylinders", "analyses.steady", "tolerence"),
    ("wheel-on-rail", "analyses.stability", "max_freqency"),
    ("wheel-on-rail", "vehicle", "wheel_bas"),
    # Forms that are chosen by a key, and objects beside numbers or words.
    ("two-cylinders", "bodies.lower.mesh.cylinder", "tickness"),
    ("two-cylinders", "bodies.lower.mesh", "cilinder"),
    ("wheel-on-rail", "bodies.lower.mesh.extruded", "sectoin"),
    ("friction-modifier", "contact.friction.exponential", "statik"),
    ("friction-modifier", "contact.friction", "exponentail"),
    ("drawn-wheel", "bodies.upper.mesh.revolved.section.file", "radus"),
]


@pytest.mark.parametrize(("name", "place", "key"), MISSPELT)
def test_a_misspelt_key_is_named(name: str, place: str, key: str) -> None:
    made = job(name)
    holder = made
    for part in place.split("."):
        inner = holder.get(part)
        if not isinstance(inner, dict):
            inner = holder[part] = {}
        holder = inner
    holder[key] = 1
    errors = list(VALIDATOR.iter_errors(made))
    messages = [error.message for error in errors]
    # Every error is plain, none hides others within alternatives, and one names the key where it stands.
    assert not any(error.context for error in errors), messages
    assert not any("null" in message for message in messages), messages
    named = [error for error in errors if f"'{key}' was unexpected" in error.message or f"('{key}', " in error.message]
    assert named and any(error.json_path == f"$.{place}" for error in named), [(e.json_path, e.message) for e in errors]
    first = best_match(errors)
    assert first is not None and "any of the given schemas" not in first.message


def test_a_wrong_word_is_answered_with_the_words() -> None:
    made = job("two-cylinders")
    made["contact"]["compliance"] = "halfspace"
    (error,) = VALIDATOR.iter_errors(made)
    assert error.message.startswith("'halfspace' is not one of ['fe', ") and error.json_path == "$.contact.compliance"


def test_every_key_is_described() -> None:
    missing = []

    def visit(node: Any, path: str) -> None:
        if isinstance(node, dict):
            properties = node.get("properties")
            for key, child in properties.items() if isinstance(properties, dict) else ():
                if not isinstance(child, dict) or len(child.get("description", "")) < 10:
                    missing.append(f"{path}/{key}")
            for key, inner in node.items():
                visit(inner, f"{path}/{key}")
        elif isinstance(node, list):
            for inner in node:
                visit(inner, path)

    visit(SCHEMA, "")
    assert not missing
