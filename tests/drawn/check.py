"""Scenes drawn from the documents alone: at the centre and at the corners of the ranges full order's results balance, by identities of statics that
were written beside each scene (forces on floating bodies, reactions and contact forces). With HYCO_LONG also the three whose paths take minutes."""
import os
import subprocess
import sys

sys.exit(subprocess.run([sys.executable, os.path.join(os.path.dirname(os.path.abspath(__file__)), 'run'), '--check', *([] if 'HYCO_LONG' in os.environ else ['--quick'])], check=False).returncode)
