"""Overrides as people type them: what Hydra's grammar cannot read is quoted where its meaning is plain, else refused
with the line to type.

Standard library only, and nothing of it is asked before Hydra is.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from pathlib import Path

from kendama_cli.config.site import Site, group_options, groups
from kendama_cli.errors import ConfigError
from kendama_cli.pipeline.catalogue import pipeline_names
from kendama_cli.schema.declaration import stage_names

QUOTES = "\N{LEFT SINGLE QUOTATION MARK}\N{RIGHT SINGLE QUOTATION MARK}\N{SINGLE LOW-9 QUOTATION MARK}" + (
    "\N{LEFT DOUBLE QUOTATION MARK}\N{RIGHT DOUBLE QUOTATION MARK}\N{DOUBLE LOW-9 QUOTATION MARK}"
    "\N{LEFT-POINTING DOUBLE ANGLE QUOTATION MARK}\N{RIGHT-POINTING DOUBLE ANGLE QUOTATION MARK}"
)
DASHES = "\N{EN DASH}\N{EM DASH}\N{MINUS SIGN}\N{NON-BREAKING HYPHEN}"
TYPESET = {ord(sign): "-" for sign in DASHES} | {ord(sign): "'" for sign in QUOTES} | {0xA0: " "}
"""Signs that word processors and web pages put in the place of those on the keyboard."""
STRIPPED = "'\" "
PLAIN = re.compile(r"[\w./@+~-]+=[\w./@:+*-]*", re.ASCII)
"""Overrides that Hydra reads as they stand."""
RANGE = re.compile(r"(-?\d+)\.{2,3}(-?\d+)")
DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+")
FUNCTIONS = "range|choice|glob|interval|sort|shuffle|tag|extend_list|int|float|str|bool|json_str"
STRUCTURE = re.compile(rf"\s*([\[{{'\"]|({FUNCTIONS})\()")
"""Beginning of a value that Hydra reads as a list, a group, a quoted text or a function."""
FILE_KEYS = {".urdf": "robot.path", ".xacro": "robot.path", ".xml": "robot.path"}
EXAMPLE = "seed=1 or capture.path=swing.csv"


def for_shell(text: str) -> str:
    """Return an override as it is typed in a shell."""
    return f'"{text}"' if "'" in text and not set(text) & set('"$`\\!') else shlex.quote(text)


def quoted(text: str) -> str:
    """Return ``KEY=VALUE`` with its value in the quotes of Hydra's grammar."""
    key, _, value = text.partition("=")
    return f"{key}='{_escaped(value)}'"


def _escaped(value: str) -> str:
    return re.sub(r"\\+(?='|$)", lambda slashes: 2 * slashes[0], value).replace("'", "\\'")


def as_meant(site: Site, overrides: Sequence[str]) -> list[str]:
    """Return ``overrides`` in Hydra's grammar: the value is quoted where it can only be a text.

    Raises ConfigError, with the line to type, for blanks around the equals sign, typographic signs, a range of other
    programs, and a word without a key.
    """
    _refuse_split(overrides)
    return [text if PLAIN.fullmatch(text) and ".." not in text else _as_meant(site, text) for text in overrides]


def _as_meant(site: Site, text: str) -> str:
    key, equals, value = text.partition("=")
    if not equals and not text.startswith("~"):
        raise _not_an_override(site, text)
    if not key:
        raise ConfigError("", f"'{text}' has no key; type KEY=VALUE, as in {EXAMPLE}")
    if key != key.strip() or value != value.lstrip():
        line = for_shell(f"{key.strip()}={value.strip()}")
        raise ConfigError(key, f"'{text}' has blanks around '='; type {line}")
    names_a_file = bool(value) and len(value) < 250 and any((root / value).exists() for root in site.data_roots)
    if (plain := text.translate(TYPESET)) != text and not names_a_file:
        name, _, meant = plain.partition("=")
        line = for_shell(f"{name}={meant.strip(STRIPPED)}")
        raise ConfigError(key, f"'{text}' has typographic signs; type {line}")
    if found := RANGE.fullmatch(value):
        low, high = int(found[1]), int(found[2])
        line = for_shell(f"{key}=range({low},{high + 1})")
        raise ConfigError(key, f"'{text}' is no range here; type kendama sweep {line}, which ends before {high + 1}")
    if "," in value and not names_a_file and not STRUCTURE.match(value):
        return text  # several values, which a sweep takes
    return quoted(text) if equals and (names_a_file or not _is_read(text)) else text


def _is_read(text: str) -> bool:
    """Return True if Hydra reads ``text``, or its value has a structure that somebody has to mend."""
    from hydra.core.override_parser.overrides_parser import OverridesParser  # noqa: PLC0415 - a tenth of a second
    from hydra.errors import OverrideParseException  # noqa: PLC0415 - as above

    try:
        OverridesParser.create().parse_overrides([text])
    except OverrideParseException:
        return bool(STRUCTURE.match(text.partition("=")[2]))
    return True


def several_values(text: str, key: str) -> ConfigError:
    """Return the error for an override of a run that gives several values."""
    value = text.partition("=")[2]
    sweep = f"kendama sweep {for_shell(text)}"
    if DECIMAL_COMMA.fullmatch(value) and key != "seed":
        decimal = value.replace(",", ".")
        return ConfigError(key, f"'{text}' has a decimal comma; type {key}={decimal}, or for one run each {sweep}")
    listed = for_shell(f"{key}=[{value}]")
    return ConfigError(key, f"'{text}' gives several values; type {sweep} for one run each, or {listed} for a list")


def unreadable(text: str, key: str) -> ConfigError:
    """Return the error for an override whose value has a structure that is not closed, or holds odd signs."""
    value = text.partition("=")[2]
    closing = "".join(
        end * (value.count(begin) - value.count(end)) for begin, end in (("[", "]"), ("(", ")"), ("{", "}"))
    )
    if closing:
        return ConfigError(key, f"'{text}' has a bracket that is not closed; type {for_shell(text + closing)}")
    bare = f"{key}={value.strip(STRIPPED)}"
    whole = for_shell(bare if PLAIN.fullmatch(bare) else quoted(bare))
    return ConfigError(key, f"'{text}' cannot be read as KEY=VALUE; if the value is a text, type {whole}")


def _refuse_split(overrides: Sequence[str]) -> None:
    for i, word in enumerate(overrides):
        following = overrides[i + 1] if i + 1 < len(overrides) else ""
        if word[:1] in DASHES:
            plain = f"{word} {following}".strip().translate(TYPESET).lstrip("-")
            option = f"-{plain}" if len(word) == 2 else f"--{plain}"
            raise ConfigError(word, f"'{word}' begins with a typographic dash; type {option}")
        if word.startswith("=") and i:
            parts = [overrides[i - 1], word, *([following] if word == "=" and following else [])]
        elif word.endswith("=") and word != "=" and following and "=" not in following:
            parts = [word, following]
        else:
            continue
        shown = " ".join(parts)
        raise ConfigError(parts[0], f"'{shown}' has blanks around '='; type {for_shell(''.join(parts))}")


def _not_an_override(site: Site, word: str) -> ConfigError:
    line = f"{word}=VALUE" if word == "seed" or (re.fullmatch(r"\w+(\.\w+)+", word) and not Path(word).exists()) else ""
    if line := _meant_by(site, word) or line:
        return ConfigError(word, f"'{word}' is not KEY=VALUE; type {line}")
    return ConfigError(word, f"'{word}' is not KEY=VALUE; type a key, '=' and a value, as in {EXAMPLE}")


def _meant_by(site: Site, word: str) -> str:
    """Return what to type for a lone word: a file, a pipeline, a stage, a choice of a group, or a key."""
    path, names = Path(word), groups(site)
    choosing = next((name for name in names if word in group_options(site, name)), "")
    if path.suffix in (".yaml", ".yml"):
        line = f"-p {for_shell(word)} for a pipeline, or {for_shell(f'setup={word}')} for measured values"
    elif path.suffix in FILE_KEYS:
        line = f"robot=urdf {for_shell(f'{FILE_KEYS[path.suffix]}={word}')}"
    elif path.is_dir():
        line = for_shell(f"capture.path={word.rstrip('/')}/*.csv")
    elif path.is_file() or "*" in word or re.fullmatch(r"\.[A-Za-z]\w{1,8}", path.suffix):
        line = for_shell(f"capture.path={word}")
    elif word in pipeline_names(site.pipeline_folders):
        line = f"-p {word}"
    elif word in stage_names():
        line = f"--until {word}, which stops after this stage"
    elif word in names:
        line = f"{word}=CHOICE; allowed: {', '.join(group_options(site, word))}"
    else:
        line = f"{choosing}={word}" if choosing else ""
    return line
