"""One part of the configuration as YAML, each value under the sentence of its declaration."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping
from typing import Any

import yaml

from kendama_cli.pipeline.nodes import node_schemas
from kendama_cli.schema.hints import unknown_key
from kendama_cli.schema.setting_facts import SettingFact, sentence, setting_facts

WIDTH = 78


def part_with_comments(config: Mapping[str, Any], key: str) -> str:
    """Return the part of ``config`` at the dotted ``key``; raises ConfigError, with the nearest key, where none is."""
    node: Any = config
    walked = ""
    for part in key.split("."):
        walked = f"{walked}.{part}" if walked else part
        if not isinstance(node, Mapping) or part not in node:
            raise unknown_key(walked, node if isinstance(node, Mapping) else ())
        node = node[part]
    top = key.partition(".")[0]
    schemas, _ = node_schemas()
    facts = list(setting_facts(top, schemas[top])) if top in schemas else []
    before, _, name = key.rpartition(".")
    return "\n".join(_Commented(facts).lines(name, node, before, ""))


class _Commented:
    """YAML of values with the sentences of their declarations."""

    def __init__(self, facts: list[SettingFact]) -> None:
        self._facts = facts

    def lines(self, name: str, value: Any, before: str, indent: str, kind: object = None) -> Iterator[str]:
        """Yield the lines of ``name`` below ``before``, in a group of the ``kind``."""
        path = f"{before}.{name}" if before else name
        having = sorted((one for one in self._facts if one.key == path), key=lambda one: one.kind not in (None, kind))
        if having and (words := sentence(having[0].field)):
            yield from textwrap.wrap(words, WIDTH, initial_indent=f"{indent}# ", subsequent_indent=f"{indent}# ")
        if isinstance(value, Mapping) and value:
            yield f"{indent}{name}:"
            for inner, one in value.items():
                yield from self.lines(str(inner), one, path, f"{indent}  ", value.get("kind"))
        else:
            text = yaml.safe_dump(value, allow_unicode=True, default_flow_style=True, width=10_000)
            yield f"{indent}{name}: {text.removesuffix('...' + chr(10)).rstrip()}"
