"""Runs a command as one rank of mpirun and leaves what it took: `rank.py FOLDER COMMAND...` writes FOLDER/RANK.json."""

import json
import os
import resource
import subprocess
import sys
import time

begun = time.perf_counter()
code = subprocess.call(sys.argv[2:])
used = resource.getrusage(resource.RUSAGE_CHILDREN)
taken = {"wall": time.perf_counter() - begun, "cpu": used.ru_utime + used.ru_stime, "memory": used.ru_maxrss * 1024}
with open(os.path.join(sys.argv[1], os.environ.get("OMPI_COMM_WORLD_RANK", "0") + ".json"), "w") as file:
    json.dump(taken, file)
sys.exit(code)
