import inspect as _inspect

from hybmss import _hybmss
from hybmss._hybmss import *
from hybmss._hybmss import __doc__, __version__
from hybmss._picture import Picture, picture

for _value in [*vars(_hybmss).values(), Picture]:
    if _inspect.isclass(_value):
        _value.__module__ = "hybmss"
Lattice._repr_html_ = lambda self: picture(self)._repr_html_()
Simulation._repr_html_ = lambda self: picture(self.lattice, self.displacements, f"t = {self.time:.6g} s")._repr_html_()
del _value
