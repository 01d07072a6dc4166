"""Executors of the part: ``makes`` is called as ``kendama_cli.settings.executor`` says."""

from kendama_cli.schema.registry import Variant

DASK = Variant(
    "dask",
    settings="kendama_cli.plugins.cluster.settings:DaskExecutor",
    makes="kendama_cli.plugins.cluster.dask_cluster:connected",
)
SLURM = Variant(
    "slurm",
    settings="kendama_cli.plugins.cluster.settings:SlurmExecutor",
    makes="kendama_cli.plugins.cluster.dask_cluster:connected",
)
