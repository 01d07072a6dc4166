"""Run a pipeline, and read what its stages made: metrics, artifacts, logs as pandas. The folder comes from argv."""

import sys

import kendama_cli as kendama

run = kendama.run("imitation", ["seed=3"], until="encode", home=sys.argv[1])
plan = run.artifact("encode")
path = run.log("encode").table("/encode/reproduced")
print(run.name, run.outcome, run.metrics("encode")["rmse_mm"], "mm rms")
print(plan.weights.shape, "weights;", len(path), "samples in the log, columns", sorted(path.columns)[:4])
