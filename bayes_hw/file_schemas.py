"""JSON Schemas (draft 2020-12) of the files that the commands read and write.

A file may hold more keys than its schema names; none of those required may be missing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias

from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

from bayes_hw.errors import InputError
from bayes_hw.files import read_json
from bayes_hw.format_names import CONTROLLER, POSTERIOR, VERDICT
from bayes_hw.gap.effects.labels import BLOCKS, LABEL_BLOCKS

Schema: TypeAlias = dict[str, Any]

DIALECT = "https://json-schema.org/draft/2020-12/schema"

NUMBER: Schema = {"type": "number"}
POSITIVE: Schema = {"type": "number", "exclusiveMinimum": 0}
NOT_NEGATIVE: Schema = {"type": "number", "minimum": 0}
COUNT: Schema = {"type": "integer", "minimum": 0}
TEXT: Schema = {"type": "string"}
PROBABILITY: Schema = {"type": "number", "minimum": 0, "maximum": 1}
NUMBER_OR_NULL: Schema = {"type": ["number", "null"]}


def listed(items: Schema, least: int = 0, most: int | None = None) -> Schema:
    """A list of `items`, from `least` to `most` of them."""
    return {
        "type": "array",
        "items": items,
        "minItems": least,
        **({} if most is None else {"maxItems": most}),
    }


def pair(items: Schema) -> Schema:
    """A list of two."""
    return listed(items, 2, 2)


def record_of(required: Mapping[str, Schema], optional: Mapping[str, Schema] | None = None) -> Schema:
    """An object with these keys; others are allowed."""
    properties = {**required, **(optional or {})}
    return {"type": "object", "properties": properties, "required": list(required)}


def named(values: Schema, pattern: str | None = None) -> Schema:
    """An object of any keys, or of those of a pattern, with values of one kind."""
    keys = {} if pattern is None else {"propertyNames": {"pattern": pattern}}
    return {"type": "object", "additionalProperties": values, **keys}


def case_schema() -> Schema:
    """case.json: a model and its records, paths relative to the file."""
    return record_of({"model": TEXT, "train": listed(TEXT, 1), "holdout": listed(TEXT, 1)})


def model_schema() -> Schema:
    """model.json: saturation, linear block, dead zone, noise."""
    roots = record_of(
        {"zeros": listed(pair(NUMBER)), "poles": listed(pair(NUMBER), 1), "gain": NUMBER},
        {"delay_samples": COUNT},
    )
    polynomials = record_of(
        {"numerator": listed(NUMBER, 1), "denominator": listed(NUMBER, 1)}, {"delay_samples": COUNT}
    )
    mode = record_of({"frequency_hz": POSITIVE, "damping_ratio": NUMBER})
    known = record_of(
        {
            "column": TEXT,
            "way": {"enum": ["torque", "reading"]},
            "gain": NUMBER,
            "delay_samples": NUMBER,
            "frequency_hz": POSITIVE,
        },
        {
            "unit": TEXT,
            "lag_s": NUMBER,
            "poles": listed(pair(NUMBER)),
            "residues": listed(pair(NUMBER)),
        },
    )
    return record_of(
        {
            "sample_rate_hz": POSITIVE,
            "saturation": record_of({"lower": NUMBER, "upper": NUMBER}),
            "linear": {"anyOf": [roots, polynomials]},
            "dead_zone": record_of({"half_width": NOT_NEGATIVE}),
        },
        {
            "name": TEXT,
            "units": record_of({}, {"time": TEXT, "input": TEXT, "output": TEXT}),
            "dominant_modes": listed(mode),
            "noise": record_of({}, {"sigma": NOT_NEGATIVE}),
            "normalization": record_of({}, {"c1": NUMBER, "c2": NUMBER, "c3": NUMBER}),
            "known": listed(known),
            "physical": {"anyOf": [physical_states(), physical_masses()]},
        },
    )


def physical_states() -> Schema:
    """Of model.json: mechanics as a state space, their loop closed."""
    row = listed(NUMBER, 1)
    return record_of(
        {
            "A": listed(row, 1),
            "B": listed(pair(NUMBER), 1),
            "sensor": row,
            "motor": row,
            "load": row,
            "inertias": pair(POSITIVE),
            "stiffness": POSITIVE,
            "damping": NOT_NEGATIVE,
        }
    )


def physical_masses() -> Schema:
    """Of model.json: mechanics as masses and springs with a loop at the motor."""
    spring = record_of({"between": pair(COUNT), "stiffness": POSITIVE, "damping": NOT_NEGATIVE})
    return record_of(
        {
            "inertias": listed(POSITIVE, 2),
            "springs": listed(spring, 1),
            "motor": COUNT,
            "load": COUNT,
            "sensor": COUNT,
            "loop": record_of({"kp": NOT_NEGATIVE, "ki": NOT_NEGATIVE}),
        },
        {"bearings": listed(NOT_NEGATIVE, 2)},
    )


def controller_schema() -> Schema:
    """A controller file of `bayes-hw design`: what is left out is zero or unlimited."""
    notch = record_of(
        {"frequency_hz": POSITIVE, "numerator_damping": NOT_NEGATIVE, "denominator_damping": POSITIVE}
    )
    return record_of(
        {"sample_rate_hz": POSITIVE, "proportional": NUMBER},
        {
            "schema": {"const": CONTROLLER},
            "name": TEXT,
            "type": TEXT,
            "integral": NUMBER,
            "derivative": NUMBER,
            "derivative_filter_s": NOT_NEGATIVE,
            "speed_limit": {"anyOf": [{"type": "null"}, POSITIVE, pair(NUMBER)]},
            "rate_of_change_limit": {"anyOf": [{"type": "null"}, POSITIVE]},
            "anti_windup_s": {"anyOf": [{"type": "null"}, NOT_NEGATIVE]},
            "delay_samples": COUNT,
            "low_pass_hz": {"anyOf": [{"type": "null"}, POSITIVE]},
            "notches": listed(notch),
        },
    )


def posterior_schema() -> Schema:
    """posterior.json: parameters with 94 % intervals and convergence diagnostics."""
    summary = record_of(
        {
            "mean": NUMBER,
            "sd": NOT_NEGATIVE,
            "median": NUMBER,
            "hdi94": pair(NUMBER),
            "ess_bulk": NUMBER_OR_NULL,
            "ess_tail": NUMBER_OR_NULL,
            "r_hat": NUMBER_OR_NULL,
            "mcse_mean": NUMBER_OR_NULL,
            "unit": TEXT,
        }
    )
    return record_of(
        {
            "schema": {"const": POSTERIOR},
            "parameters": named(summary),
            "converged": {"type": "boolean"},
            "seconds": NOT_NEGATIVE,
        },
        {"derived": named(summary), "problems": listed(TEXT), "priors": named(TEXT)},
    )


def verdict_schema() -> Schema:
    """verdict.json: what is missing from a simulator, how sure, where, and how far the gap shrinks."""
    estimate = record_of({"mean": NUMBER, "sd": NOT_NEGATIVE, "hdi94": pair(NUMBER), "unit": TEXT})
    closure = record_of(
        {
            "rmse_before": NUMBER_OR_NULL,
            "rmse_after": NUMBER_OR_NULL,
            "noise_floor": NUMBER_OR_NULL,
            "closed": NUMBER_OR_NULL,
            "closed_hdi94": pair(NUMBER_OR_NULL),
        }
    )
    followed = record_of(
        {"follows": {"type": "boolean"}, "probability": PROBABILITY, "nats": NUMBER},
        {
            "way": {"enum": ["torque", "reading"]},
            "block": {"enum": list(BLOCKS)},
            "gain": estimate,
            "lag_s": estimate,
            "gap": record_of({"train": closure, "holdout": closure}),
            "sentence": TEXT,
        },
    )
    return record_of(
        {
            "schema": {"const": VERDICT},
            "answer": listed(TEXT, 0, 2),
            "probability": {
                "type": "object",
                "required": ["none", "other", *LABEL_BLOCKS],
                "additionalProperties": PROBABILITY,
            },
            "confusable": listed(pair(TEXT)),
            "where": record_of(
                {
                    "block": {"enum": ["none", *BLOCKS]},
                    "band_hz": pair(NUMBER_OR_NULL),
                    "regime": TEXT,
                    "share": named(PROBABILITY),
                }
            ),
            "gap": record_of({"train": closure, "holdout": closure}),
            "parameters": named(estimate, r"^[^.]+\..+$"),
            "base": named(estimate),
            "next_experiment": {"type": ["string", "null"]},
            "seconds": NOT_NEGATIVE,
        },
        {"notes": listed(TEXT), "white_choice": listed(TEXT), "known": named(followed)},
    )


MAKERS: Mapping[str, Callable[[], Schema]] = MappingProxyType(
    {
        "case": case_schema,
        "model": model_schema,
        "controller": controller_schema,
        "posterior": posterior_schema,
        "verdict": verdict_schema,
    }
)
"""The kinds of files, by name."""


def schema_of(kind: str) -> Schema:
    """The JSON Schema of a kind of file, one of MAKERS, with its dialect and title."""
    make = MAKERS[kind]
    summary = " ".join((make.__doc__ or "").split())
    return {"$schema": DIALECT, "title": f"bayes-hw {kind}", "description": summary, **make()}


LONGEST_MESSAGE = 200
"""Characters of what is wrong: a message may quote the whole file."""


def check_file(path: Path, kind: str | None = None) -> str:
    """The kind of a valid file, as given or as its name or `schema` key says.

    Raises InputError that names the file, the place in it and what is wrong there.
    """
    content = read_json(path)
    found = kind or kind_of(path, content)
    wrong = best_match(Draft202012Validator(schema_of(found)).iter_errors(content))
    if wrong is not None:
        place = wrong.json_path.removeprefix("$").removeprefix(".") or "the top level"
        raise InputError(f"{path}: {place}: {shortened(wrong.message)}; see the format of a {found}")
    return found


def kind_of(path: Path, content: Any) -> str:
    """What a file is, by its `schema` key or its name; raises InputError where neither says."""
    said = content.get("schema") if isinstance(content, dict) else None
    for kind in MAKERS:
        if (isinstance(said, str) and said.startswith(f"bayes-hw/{kind}/")) or path.stem == kind:
            return kind
    if isinstance(content, dict) and {"linear", "saturation", "effects"} <= set(content):
        return "model"
    raise InputError(f"{path}: neither name nor content say what it is; give --kind {' or '.join(MAKERS)}")


def shortened(message: str) -> str:
    """Both ends of a long message."""
    half = LONGEST_MESSAGE // 2
    return message if len(message) <= LONGEST_MESSAGE else f"{message[:half]} ... {message[-half:]}"
