"""Search settings of the swing-up with Optuna: python examples/optuna_over_runs.py [HOME] [TRIALS]

Needs: ``pip install . optuna``. What was run before is taken from the store. A search finds what was lucky on its
seeds, so the shipped settings and the best are compared on others.
"""

import statistics
import sys

import optuna

import kendama_cli as kendama

home = sys.argv[1] if len(sys.argv) > 1 else ".kendama"
trials = int(sys.argv[2]) if len(sys.argv) > 2 else 20
SEARCHED, JUDGED = range(10_000, 10_005), range(20_000, 20_010)


def rollouts(overrides: list[str], seeds: range) -> float:
    """Return the mean number of rollouts to a solved policy; one that is never solved counts as the cap of 1000."""
    chosen = ["simulation/engine=rail", *overrides]
    runs = [kendama.run("swingup", [*chosen, f"seed={seed}"], until="learn", home=home) for seed in seeds]
    metrics = [run.metrics("learn") for run in runs]
    return statistics.mean(one["rollouts_to_solved"] if one["solved"] else 1000 for one in metrics)


def objective(trial: optuna.Trial) -> float:
    """Return the number that Optuna minimises."""
    return rollouts(
        settings(
            {
                "alpha": trial.suggest_float("alpha", 0.1, 0.9),
                "trace_decay": trial.suggest_float("trace_decay", 0.5, 1.0),
            }
        ),
        SEARCHED,
    )


def settings(params: dict[str, float]) -> list[str]:
    """Return the overrides of one trial."""
    return [f"learn.{name}={value:.3f}" for name, value in params.items()]


optuna.logging.set_verbosity(optuna.logging.WARNING)
study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=0))
study.optimize(objective, n_trials=trials)
best = settings(study.best_params)
print(f"best of {trials}: {study.best_value:.0f} rollouts with {' '.join(best)}")
print(f"on other seeds: {rollouts(best, JUDGED):.0f}, as shipped {rollouts([], JUDGED):.0f}")
