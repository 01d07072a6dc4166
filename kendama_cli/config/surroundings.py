"""What the interpolations of a configuration read besides it: environment variables, by ``${oc.env:NAME}`` alone."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from typing import Any

from omegaconf import OmegaConf
from omegaconf.basecontainer import BaseContainer
from omegaconf.resolvers import oc

Environment = dict[str, str | None]
"""Values by name; None for a variable that was not set."""


@contextlib.contextmanager
def recorded() -> Iterator[Environment]:
    """Every environment variable that an interpolation reads meanwhile, as it was.

    OmegaConf's own resolvers alone are there meanwhile: a clock (Hydra's ``now``) or a resolver that another library
    registered would give values that nothing could tell apart later.
    """
    read: Environment = {}

    def environment(name: str, *default: Any) -> str | None:
        read[name] = os.environ.get(name)
        return oc.env(name, *default)

    # OmegaConf has no public way of putting back the resolvers of the program that this one may be a library of
    before = BaseContainer._resolvers
    try:
        OmegaConf.clear_resolvers()
        OmegaConf.register_new_resolver("oc.env", environment, replace=True)
        yield read
    finally:
        BaseContainer._resolvers = before
