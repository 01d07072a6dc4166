"""Meaning of names, content of an installation, and the pages: ``kendama explain``, ``doctor`` and ``docs``."""
