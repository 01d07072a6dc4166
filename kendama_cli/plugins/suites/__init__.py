"""Laws of cameras, demonstrators, detectors, learners and robots: what ``kendama_cli.conformance`` runs."""
