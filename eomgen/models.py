"""The cached models as importable modules: `eomgen.models.<name>_<digest>`.

A module of the cache has the same name in every process, so its functions pickle by reference.
"""

from eomgen.backends.cache import folder

__path__ = [str(folder() / "models")]
