"""Many runs: a scenario over links, levels of autonomy and whatever else, with common random numbers.

``run_sweep(plan, directory)`` runs what is missing there; ``load_sweep(directory)`` gives the index as a DataFrame.
"""
