"""The one JSON text of a value: what seals and keys rest on."""

from __future__ import annotations

import json
from typing import Any


def json_text(value: Any) -> str:
    """Return the JSON text of ``value`` with sorted keys and no spaces; raises ValueError for numbers not finite."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
