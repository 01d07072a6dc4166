"""OmegaConf's reader of YAML on libyaml, where that is: a fifth of what a composition takes."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import omegaconf._utils
import yaml
from omegaconf._utils import get_yaml_loader


@contextmanager
def quick_yaml() -> Iterator[None]:
    """Files that OmegaConf loads meanwhile are parsed by libyaml; what their text means is for OmegaConf as ever."""
    omegaconf._utils.get_yaml_loader = quick_loader
    try:
        yield
    finally:
        omegaconf._utils.get_yaml_loader = get_yaml_loader


@functools.cache
def quick_loader() -> Any:
    """OmegaConf's loader, with its rules for keys and numbers, behind libyaml's parser; as it is where that is not."""
    loader = get_yaml_loader()
    if not yaml.__with_libyaml__:
        return loader
    parser = yaml.cyaml.CParser  # type: ignore[attr-defined]

    class Quick(parser, loader):  # type: ignore[misc, valid-type]
        def __init__(self, stream: Any) -> None:
            parser.__init__(self, stream)
            yaml.constructor.SafeConstructor.__init__(self)
            yaml.resolver.Resolver.__init__(self)

    return Quick
