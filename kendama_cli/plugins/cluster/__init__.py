"""More than one machine: a store that homes share, and stages on the workers of Dask and Slurm."""
