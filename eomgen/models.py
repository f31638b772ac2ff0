"""The cached models as importable modules: `eomgen.models.<name>_<digest>`.

A module of the cache has the same name in every process, so its functions pickle by reference.
"""

from eomgen.backends import cache
from eomgen.errors import BuildError

try:
    __path__ = [str(cache.folder() / "models")]
except BuildError:
    __path__ = []
