"""The test of pellet.py on mesh B (32k unknowns): about half a minute."""
import os
import unittest

os.environ['PELLET_MESH'] = 'B'
import pellet  # noqa: E402


class PelletB(pellet.Pellet):
    rid_fraction = 0.20
    force = 1431.115


del pellet.Pellet
if __name__ == '__main__':
    unittest.main()
