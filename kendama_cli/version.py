"""The version of kendama, which ``pyproject.toml`` reads here."""

__version__ = "0.3.0"
