"""Homes, logs and files of settings that an older version wrote, by the names of today."""
