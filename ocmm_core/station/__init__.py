"""The measuring station: everything that runs while a job is measured."""
