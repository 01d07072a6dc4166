"""A URDF file as XML elements: read as leniently as ROS reads it, and called what it is where it is no URDF."""

from __future__ import annotations

import codecs
import os
import re
import xml.etree.ElementTree as ET
from xml.parsers import expat

from kendama_cli.errors import InputError

MOST_BYTES = 64 * 2**20
MERGE_MARK = re.compile(r"^(<{7} |={7}\s*$|>{7} )", re.MULTILINE)
OTHERS = {
    "sdf": "an SDF model",
    "mujoco": "a MuJoCo model",
    "mujocoinclude": "a MuJoCo model",
    "COLLADA": "a COLLADA mesh",
    "html": "a web page",
    "launch": "a ROS launch file",
    "package": "a ROS package manifest",
}
"""Files that stand beside a URDF or are saved in its place, by their root element."""


def read_xml(path: str) -> ET.Element:
    """Return the element ``<robot>`` of the URDF at ``path``.

    Comments are dropped before XML is parsed, and namespaces are not resolved, as in ROS's own reader: comments with
    two hyphens and prefixes that nobody declares are frequent in real files. Raises InputError, naming the line where
    there is one, for what is no URDF: another format, a file to be expanded by xacro, a git merge left unfinished.
    """
    text = _text(path)
    plain = re.sub(r"<!--.*?-->|<\?xml.*?\?>", _lines_of, text, flags=re.DOTALL)
    builder = ET.TreeBuilder()
    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = builder.start, builder.end
    try:
        parser.Parse(plain, True)
    except (expat.ExpatError, UnicodeEncodeError) as error:
        raise _not_xml(path, plain, error) from None
    root = builder.close()
    if root.tag != "robot":
        is_kind = f"is {kind}, not a URDF" if (kind := OTHERS.get(root.tag)) else "is not a URDF"
        problem = f"{is_kind}: its root is <{root.tag}>, not <robot>"
        raise InputError(path, problem, remedy="set robot.path to a URDF")
    if _is_xacro(root):
        name = os.path.basename(path)
        expanded = name.removesuffix(".xacro").removesuffix(".urdf")
        expanded += "_plain.urdf" if name.endswith(".urdf") else ".urdf"
        remedy = f"expand it first: xacro {name} > {expanded}"
        raise InputError(path, "is a xacro file, not a URDF yet", remedy=remedy)
    return root


def _text(path: str) -> str:
    """The characters of the file, in UTF-8, in the encoding that it declares, or byte for byte."""
    try:
        size = os.path.getsize(path)
        if size > MOST_BYTES:
            problem = f"has {size / 2**20:.0f} MB; allowed for a URDF: {MOST_BYTES / 2**20:.0f} MB"
            raise InputError(path, problem, remedy="set robot.path to a URDF file")
        with open(path, "rb") as file:
            data = file.read(MOST_BYTES)
    except (OSError, ValueError) as error:
        raise InputError(path, f"cannot be read as a URDF ({error})", remedy="set robot.path to a URDF file") from None
    if not data.strip():
        raise InputError(path, "is empty", remedy="set robot.path to a URDF file")
    if data.startswith(b"version https://git-lfs"):
        raise InputError(path, "is a pointer of Git LFS, not the file itself", remedy="fetch it: git lfs pull")
    declared = re.match(rb"\s*<\?xml[^>]*encoding=[\"']([\w.-]+)", data)
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    for encoding in ("utf-16",) if wide else ("utf-8-sig", declared.group(1).decode() if declared else "latin-1"):
        try:
            return data.decode(encoding)
        except (UnicodeError, LookupError):
            continue
    return data.decode("latin-1")


def _lines_of(found: re.Match[str]) -> str:
    """The line ends of what is dropped, so that those after it keep their numbers."""
    return "\n" * found.group().count("\n")


def _not_xml(path: str, text: str, error: Exception) -> InputError:
    if mark := MERGE_MARK.search(text):
        line = f"line {text.count(chr(10), 0, mark.start()) + 1}"
        remedy = "finish the merge: keep one of both sides and delete the marks <<<<<<<, ======= and >>>>>>>"
        return InputError(path, "has the marks of an unfinished git merge", where=line, remedy=remedy)
    remedy = "repair it or choose another URDF"
    if not isinstance(error, expat.ExpatError):
        return InputError(path, "is not well-formed XML", remedy=remedy)
    problem = f"is not well-formed XML ({expat.ErrorString(error.code)})"
    return InputError(path, problem, where=f"line {error.lineno}", remedy=remedy)


def _is_xacro(root: ET.Element) -> bool:
    """Return True if something is left to expand; a property that nothing uses, or a prefix declared, is not."""
    prefixes = [name[6:] for name, value in root.attrib.items() if name.startswith("xmlns:") and "xacro" in value]
    for element in root.iter():
        prefix, _, kind = element.tag.rpartition(":")
        if prefix and prefix in {*prefixes, "xacro"} and kind not in ("property", "arg"):
            return True
        if any("${" in value or "$(arg" in value for value in element.attrib.values()) and not prefix:
            return True
    return False
