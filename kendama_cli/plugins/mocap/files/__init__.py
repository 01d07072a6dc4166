"""Files that motion capture systems and animation programs write, for the entry point group ``kendama.recordings``."""
