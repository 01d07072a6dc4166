"""Every body and marker of a recording, whatever program wrote it."""
