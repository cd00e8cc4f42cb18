"""`python3 -m tandem`: the folder of the scenes that came with the program."""

from .program import SCENES

print(SCENES)
