"""Search settings of the swing-up with Optuna, a few seeds each: python examples/optuna_over_runs.py [HOME] [TRIALS]

Needs: pip install kendama optuna. What was run before is taken from the store.
"""

import statistics
import sys

import optuna

import kendama_cli as kendama

home = sys.argv[1] if len(sys.argv) > 1 else ".kendama"
trials = int(sys.argv[2]) if len(sys.argv) > 2 else 20
SEEDS = range(10000, 10005)


def rollouts(trial: optuna.Trial) -> float:
    """The mean number of rollouts to a proven policy, 1000 where none came."""
    alpha, trace = trial.suggest_float("alpha", 0.1, 0.9), trial.suggest_float("lambda", 0.5, 1.0)
    overrides = ["simulation/engine=rail", f"learn.alpha={alpha:.3f}", f"learn.trace_decay={trace:.3f}"]
    runs = [kendama.run("swingup", [*overrides, f"seed={seed}"], until="learn", home=home) for seed in SEEDS]
    return statistics.mean(run.metrics("learn")["rollouts_to_proof"] or 1000 for run in runs)


optuna.logging.set_verbosity(optuna.logging.WARNING)
study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=0))
study.optimize(rollouts, n_trials=trials)
print(f"best of {trials}: {study.best_value:.0f} rollouts with {study.best_params}")
