"""A movement primitive read from a file, instead of demonstrations."""

from __future__ import annotations

from pathlib import Path

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.errors import InputError
from kendama_cli.motion.dmp.plan_text import TextFormat, plan_from_text

TEXT_FORMATS: dict[str, TextFormat] = {".yaml": "yaml", ".yml": "yaml", ".json": "json"}
"""What a primitive is written as, by the ending of its file."""

REMEDY = "give a file that 'kendama motion export' wrote"


def text_format(path: str | Path) -> TextFormat:
    """Return JSON for ``.json``, YAML for ``.yaml`` and ``.yml``; raises InputError for any other ending."""
    ending = Path(path).suffix.lower()
    if ending not in TEXT_FORMATS:
        raise InputError(str(path), f"ends in '{ending}'", remedy="name it FILE.yaml, FILE.yml or FILE.json")
    return TEXT_FORMATS[ending]


def read_plan(path: str) -> MotionPlan:
    """Read the primitive in the JSON or YAML file ``path``; raises InputError that names the line or key."""
    form = text_format(path)
    try:
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})", remedy=REMEDY) from None
    except UnicodeDecodeError:
        raise InputError(path, "not UTF-8 text", remedy=REMEDY) from None
    try:
        return plan_from_text(text, form)
    except ValueError as error:
        raise InputError(path, str(error), remedy=REMEDY) from None
