"""Reading of result files: every fault names the file and the dataset."""

import json

import h5py


class ResultsError(Exception):
    """A result file that cannot be used."""


class Results:
    """A result file open for reading."""

    def __init__(self, path):
        self.path = path
        try:
            self.file = h5py.File(path)
        except OSError as error:
            raise ResultsError(f"cannot read {path}: {error}") from error

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.file.close()

    def __contains__(self, name):
        return name in self.file

    def __getitem__(self, name):
        if name not in self.file:
            raise ResultsError(f"{self.path} has no dataset {name}")
        return self.file[name][()]

    @property
    def stem(self):
        return self.path.stem

    @property
    def job(self):
        """The resolved job, as a dictionary."""
        if "provenance/job" not in self:
            return {}
        return json.loads(self["provenance/job"])

    def companion(self, suffix):
        """Path of a file that goes with this one."""
        return self.path.with_name(f"{self.path.stem}.{suffix}")


def lookup(job, path, default=None):
    """Value of a dotted path in a job."""
    for key in path.split("."):
        if not isinstance(job, dict) or key not in job:
            return default
        job = job[key]
    return job
