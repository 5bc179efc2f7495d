"""Samplers of OptunaHub from an archive of its registry, since a trial has no network to download them; TuRBO unless given."""
import os
import sys
import tempfile
import zipfile

os.environ.setdefault("GIT_PYTHON_REFRESH", "quiet")  # optunahub imports GitPython, which asks for git
import numpy as np
import optuna
import optunahub

from relign_bench.plugin import GeneratorSearch, parameter, serve
from relign_bench.plugin.generators import OptunaGenerator


class OptunaHubSearch(GeneratorSearch):
    id = "optunahub"
    license = "MIT"
    citation = "OptunaHub, https://hub.optuna.org; Eriksson et al., Scalable Global Optimization via Local BO, NeurIPS 2019."
    reproducible = "this_cpu"

    registry = parameter(type="file", description="Zip archive of the registry or a part of it, as git archive makes it")
    package = parameter("samplers/turbo", description="Folder of the sampler in the registry's folder package")
    sampler = parameter("TuRBOSampler", description="Class of the sampler, which has an argument seed")
    options = parameter({}, description="Further arguments of the sampler")

    def generator(self, space):
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        for name in [name for name in sys.modules if name.startswith("optunahub_registry.")]:
            del sys.modules[name]  # of an earlier trial, perhaps of another archive
        folder = tempfile.TemporaryDirectory()
        with zipfile.ZipFile(self.registry) as archive:
            if f"package/{self.package}/__init__.py" not in archive.namelist():
                raise ValueError(f"{self.registry} has no package/{self.package}/__init__.py")
            archive.extractall(folder.name)
        np.random.seed(space.seed)  # some samplers draw from numpy's global generator besides their own
        module = optunahub.load_local_module(self.package, registry_root=os.path.join(folder.name, "package"))
        sampler = getattr(module, self.sampler)(seed=space.seed, **self.options)
        if not isinstance(sampler, optuna.samplers.BaseSampler):  # of None, Optuna makes its own default
            raise ValueError(f"{self.sampler} of package/{self.package} makes {sampler!r}, not a sampler of Optuna")
        generator = OptunaGenerator(optuna.create_study(sampler=sampler), space)
        generator.finalize = folder.cleanup
        return generator


if __name__ == "__main__":
    serve(OptunaHubSearch)
